//! The side from which a scene is seen.

use glam::{DQuat, DVec3};

/// The side of a scene on which a camera stands. The camera looks at the middle of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewDirection {
    /// The angle from the front (+z) toward the right (+x), in degrees.
    pub azimuth: f64,
    /// The angle above the plane of x and z, in degrees from −90 to 90.
    pub elevation: f64,
}

impl ViewDirection {
    /// From +z, as viewers of Inventor and VRML see a scene without a camera.
    pub const FRONT: Self = Self::new(0.0, 0.0);
    /// From the right, the front and above, so that three sides of a box show.
    pub const THREE_QUARTER: Self = Self::new(35.0, 25.0);
    /// The six sides of a scene, and a view of three of them, with their names.
    pub const NAMED: [(&'static str, Self); 7] = [
        ("front", Self::FRONT),
        ("back", Self::new(180.0, 0.0)),
        ("right", Self::new(90.0, 0.0)),
        ("left", Self::new(-90.0, 0.0)),
        ("top", Self::new(0.0, 90.0)),
        ("bottom", Self::new(0.0, -90.0)),
        ("three-quarter", Self::THREE_QUARTER),
    ];

    /// Returns a direction by its azimuth and elevation in degrees.
    pub const fn new(azimuth: f64, elevation: f64) -> Self {
        Self { azimuth, elevation }
    }

    /// Returns the direction's name, or its azimuth and elevation as in `35,25`.
    pub fn name(self) -> String {
        let named = Self::NAMED.into_iter().find(|(_, known)| *known == self);
        named.map_or_else(
            || format!("{},{}", self.azimuth, self.elevation),
            |(name, _)| name.to_owned(),
        )
    }

    /// Returns the direction with a name that [`ViewDirection::name`] returns.
    pub fn named(text: &str) -> Option<Self> {
        if let Some((_, known)) = Self::NAMED.into_iter().find(|(name, _)| *name == text) {
            return Some(known);
        }
        let (azimuth, elevation) = text.split_once(',')?;
        let (azimuth, elevation): (f64, f64) =
            (azimuth.trim().parse().ok()?, elevation.trim().parse().ok()?);
        let is_valid = azimuth.abs() <= 360.0 && elevation.abs() <= 90.0;
        is_valid.then_some(Self::new(azimuth, elevation))
    }

    /// Returns the rotation that turns a camera at the front to this side.
    pub fn rotation(self) -> DQuat {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        DQuat::from_axis_angle(DVec3::Y, azimuth) * DQuat::from_axis_angle(DVec3::X, -elevation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_stands_on_the_side_that_is_named() {
        for (name, at) in [
            ("front", DVec3::Z),
            ("back", DVec3::NEG_Z),
            ("right", DVec3::X),
            ("left", DVec3::NEG_X),
            ("top", DVec3::Y),
            ("bottom", DVec3::NEG_Y),
            ("90,-90", DVec3::NEG_Y),
        ] {
            let direction = ViewDirection::named(name).expect("a name of a side");
            assert!(
                (direction.rotation() * DVec3::Z - at).length() < 1e-12,
                "{name}"
            );
            assert_eq!(direction.name(), name);
        }
        for word in ["", "above", "1", "1,2,3", "0,91", "nan,0", "400,0"] {
            assert_eq!(ViewDirection::named(word), None, "{word}");
        }
    }
}
