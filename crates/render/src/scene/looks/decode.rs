//! Decoding of colors that were made for a display, for a model that computes with light.

use std::sync::LazyLock;

use glam::{Vec3, Vec4};
use ivcam_inventor::iv::{display_of_linear, linear_of_display};

use crate::scene::options::ColorCoding;

impl ColorCoding {
    /// Returns the light of a level. Above 1 the curve goes on as a power.
    pub fn light_of(self, level: f32) -> f32 {
        match self {
            Self::Levels | Self::Linear => level,
            Self::Display => linear_of_display(level),
        }
    }

    /// Returns the light of a color.
    pub(in crate::scene) fn light(self, color: Vec3) -> Vec3 {
        color.map(|level| self.light_of(level))
    }
}

static LIGHTS: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|level| 255.0 * linear_of_display(level as f32 / 255.0)));

/// Returns the light of each level of 8 bits, from 0 to 255.
#[inline]
pub(super) fn lights() -> &'static [f32; 256] {
    &LIGHTS
}

/// Returns the light of a texel, from 0 to 255, by that of each level.
#[inline(always)]
pub(super) fn light(lights: &[f32; 256], [r, g, b, a]: [u8; 4]) -> Vec4 {
    let [r, g, b] = [r, g, b].map(|level| lights[usize::from(level)]);
    Vec4::new(r, g, b, a.into())
}

/// Returns the level with the mean light of four levels, each with its weight.
pub(super) fn mean_level(levels: [u8; 4], weights: [u32; 4]) -> u8 {
    let all: u32 = weights.iter().sum();
    let parts = levels.into_iter().zip(weights);
    let sum: f32 = parts.map(|(l, w)| LIGHTS[usize::from(l)] * w as f32).sum();
    (255.0 * display_of_linear(sum / (255 * all.max(1)) as f32)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_display_shows_half_the_level_with_a_fifth_of_the_light() {
        let half = ColorCoding::Display.light(Vec3::new(0.5, 1.0, 0.0));
        assert!((half - Vec3::new(0.214_041, 1.0, 0.0)).abs().max_element() < 1e-6);
        for level in 0..=255 {
            let texel = light(lights(), [level; 4]);
            let expected = ColorCoding::Display.light_of(f32::from(level) / 255.0);
            assert!((texel.x / 255.0 - expected).abs() < 1e-7);
            assert_eq!(texel.w, f32::from(level));
            assert_eq!(mean_level([level; 4], [0, 3, 0, 255]), level);
        }
        assert!(ColorCoding::Display.light_of(2.0) > 4.0);
    }

    #[test]
    fn black_and_white_have_the_mean_level_of_half_the_light() {
        assert_eq!(mean_level([0, 255, 0, 255], [1; 4]), 188);
        assert_eq!(mean_level([9, 255, 255, 255], [255, 0, 0, 0]), 9);
    }
}
