//! Decoding of colors that were made for a display, for a model that computes with light.

use std::sync::OnceLock;

use glam::{Vec3, Vec4};

use crate::scene::options::ColorCoding;

impl ColorCoding {
    /// Returns the light of a level.
    pub fn light_of(self, level: f32) -> f32 {
        match self {
            Self::Linear => level,
            Self::Display => decoded(level),
        }
    }

    /// Returns the light of a color. Above 1 the curve goes on as a power.
    pub(in crate::scene) fn light(self, color: Vec3) -> Vec3 {
        color.map(|level| self.light_of(level))
    }
}

/// Decodes a level by the sRGB curve (IEC 61966-2-1).
fn decoded(level: f32) -> f32 {
    if level <= 0.040_45 {
        level / 12.92
    } else {
        libm::powf((level + 0.055) / 1.055, 2.4)
    }
}

/// The intervals of the table.
const STEPS: usize = 1024;

/// Decodes the color of a texel by a table, to 1e-6.
pub(in crate::scene) fn decoded_texel(texel: Vec4) -> Vec4 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let levels = (0..=STEPS).map(|i| i as f32 / STEPS as f32);
        levels.map(decoded).collect()
    });
    let light = |level: f32| {
        let at = level.clamp(0.0, 1.0) * STEPS as f32;
        let low = (at as usize).min(STEPS - 1);
        table[low] + (table[low + 1] - table[low]) * (at - low as f32)
    };
    Vec4::new(light(texel.x), light(texel.y), light(texel.z), texel.w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_display_shows_half_the_level_with_a_fifth_of_the_light() {
        let light = ColorCoding::Display.light(Vec3::new(0.5, 1.0, 0.0));
        assert!((light - Vec3::new(0.214_041, 1.0, 0.0)).abs().max_element() < 1e-6);
        for i in 0..=3000 {
            let level = i as f32 / 3000.0;
            let texel = decoded_texel(Vec4::splat(level));
            assert!(
                (texel.x - decoded(level)).abs() < 2e-6 && texel.w == level,
                "{level}"
            );
        }
        assert!(ColorCoding::Display.light(Vec3::splat(2.0)).x > 4.0);
    }
}
