//! The side from which a scene is seen.

use glam::{DQuat, DVec3};

/// The axis of a scene that is up in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +y, as in Inventor and VRML.
    #[default]
    Y,
    /// +z, as in many programs of design and in maps.
    Z,
    /// −z: z is down, as in the frames of rovers' sites.
    MinusZ,
}

impl UpAxis {
    /// The axes with their names.
    const NAMED: [(&'static str, Self); 3] = [("y", Self::Y), ("z", Self::Z), ("-z", Self::MinusZ)];

    /// Returns the rotation that turns +y to the axis, about x.
    pub fn rotation(self) -> DQuat {
        let quarters = match self {
            Self::Y => 0.0,
            Self::Z => 1.0,
            Self::MinusZ => -1.0,
        };
        DQuat::from_axis_angle(DVec3::X, quarters * std::f64::consts::FRAC_PI_2)
    }
}

/// The side of a scene on which a camera stands. The camera looks at the middle of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewDirection {
    /// The angle from the front (+z) toward the right (+x), in degrees.
    pub azimuth: f64,
    /// The angle above the plane of x and z, in degrees from −90 to 90.
    pub elevation: f64,
    /// The axis that is up. The angles are those of the scene turned so that it is +y.
    pub up: UpAxis,
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
        let up = UpAxis::Y;
        Self {
            azimuth,
            elevation,
            up,
        }
    }

    /// Returns the direction's name, or its azimuth and elevation as in `35,25`; behind it, as in
    /// `top,-z`, the axis that is up if it is not +y.
    pub fn name(self) -> String {
        let upright = Self::new(self.azimuth, self.elevation);
        let named = Self::NAMED.into_iter().find(|(_, known)| *known == upright);
        let side = named.map_or_else(
            || format!("{},{}", self.azimuth, self.elevation),
            |(name, _)| name.to_owned(),
        );
        let mut axes = UpAxis::NAMED[1..].iter();
        let up = axes.find(|(_, up)| *up == self.up);
        up.map_or(side.clone(), |(name, _)| format!("{side},{name}"))
    }

    /// Returns the direction with a name that [`ViewDirection::name`] returns.
    pub fn named(text: &str) -> Option<Self> {
        if let Some((_, known)) = Self::NAMED.into_iter().find(|(name, _)| *name == text) {
            return Some(known);
        }
        let mut axes = UpAxis::NAMED.into_iter();
        let with_axis = axes.find_map(|(name, up)| {
            let side = text.strip_suffix(name)?.trim_end().strip_suffix(',')?;
            Some((side.trim_end(), up)).filter(|(side, _)| !side.ends_with(','))
        });
        if let Some((side, up)) = with_axis {
            let side = Self::named(side).filter(|side| side.up == UpAxis::Y)?;
            return Some(Self { up, ..side });
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
        let side = DQuat::from_axis_angle(DVec3::Y, azimuth);
        self.up.rotation() * side * DQuat::from_axis_angle(DVec3::X, -elevation)
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
            ("top,z", DVec3::Z),
            ("top,-z", DVec3::NEG_Z),
            ("front,z", DVec3::NEG_Y),
            ("right,-z", DVec3::X),
            ("90,0,z", DVec3::X),
        ] {
            let direction = ViewDirection::named(name).expect("a name of a side");
            assert!(
                (direction.rotation() * DVec3::Z - at).length() < 1e-12,
                "{name}"
            );
            assert_eq!(
                ViewDirection::named(&direction.name()),
                Some(direction),
                "{name}"
            );
        }
        for word in [
            "", "above", "1", "1,2,3", "0,91", "nan,0", "400,0", "z", "1,2,x", "top,z,-z",
        ] {
            assert_eq!(ViewDirection::named(word), None, "{word}");
        }
    }
}
