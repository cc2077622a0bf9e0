//! What a ray that meets nothing sees: VRML 97's `Background`, or nothing.
//!
//! Sky and ground are colors by the angle from the zenith and the nadir (6.5). Panorama pictures
//! are not drawn.

use glam::Vec3;

use crate::graph::read::Fields;
use crate::iv::NodeRef;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Background {
    /// Angle from straight up, and the color there.
    sky: Vec<(f32, Vec3)>,
    /// Angle from straight down.
    ground: Vec<(f32, Vec3)>,
}

impl Background {
    pub fn of(node: NodeRef<'_>) -> Self {
        let band = |colors: &str, angles: &str| -> Vec<(f32, Vec3)> {
            let colors = node.read::<[Vec3]>(colors).unwrap_or(&[]);
            let angles = node.read::<[f32]>(angles).unwrap_or(&[]);
            let at = std::iter::once(0.0).chain(angles.iter().copied());
            at.zip(colors.iter().copied()).collect()
        };
        Self {
            sky: band("skyColor", "skyAngle"),
            ground: band("groundColor", "groundAngle"),
        }
    }

    /// The color in a direction; black without a background.
    pub fn color(&self, direction: Vec3) -> Vec3 {
        let up = direction.normalize_or(Vec3::NEG_Z).y.clamp(-1.0, 1.0);
        let from_below = libm::acosf(-up);
        match self.ground.last() {
            Some((reach, _)) if from_below <= *reach => along(&self.ground, from_below),
            _ => along(&self.sky, libm::acosf(up)),
        }
    }

    pub fn is_nothing(&self) -> bool {
        self.sky.is_empty()
    }
}

/// The color at an angle: straight between its neighbors, the last one beyond.
fn along(band: &[(f32, Vec3)], angle: f32) -> Vec3 {
    let above = band.partition_point(|(a, _)| *a <= angle);
    match (
        above.checked_sub(1).and_then(|i| band.get(i)),
        band.get(above),
    ) {
        (Some((a, low)), Some((b, high))) => low.lerp(*high, (angle - a) / (b - a)),
        (Some((_, color)), None) | (None, Some((_, color))) => *color,
        (None, None) => Vec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_turns_from_one_color_to_the_next() {
        let quarter = std::f32::consts::FRAC_PI_2;
        let sky = Background {
            sky: vec![(0.0, Vec3::ZERO), (quarter, Vec3::ONE)],
            ground: Vec::new(),
        };
        assert_eq!(sky.color(Vec3::Y), Vec3::ZERO);
        let half = sky.color(Vec3::new(1.0, 1.0, 0.0));
        assert!((half.x - 0.5).abs() < 1e-5);
        assert_eq!(sky.color(Vec3::NEG_Y), Vec3::ONE);
    }
}
