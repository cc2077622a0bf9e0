//! Decenters and tilts of surfaces.

use glam::{DAffine3, DMat3, DVec3};

/// A shift of the axis and a tilt about the point that it is shifted to.
///
/// The coordinates turn about x, then about the new y, then about the new z, each counterclockwise
/// as seen from the tip of the axis, as in a coordinate break of Zemax. In the order of CODE V and
/// OSLO the signs of the first two are opposite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decenter {
    /// The shift in millimeters.
    pub shift: DVec3,
    /// The angles about x, y and z in degrees.
    pub tilt: DVec3,
}

impl Decenter {
    /// No shift and no tilt.
    pub const NONE: Self = Self {
        shift: DVec3::ZERO,
        tilt: DVec3::ZERO,
    };

    /// Whether it changes nothing.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Whether it has only finite numbers.
    pub(crate) fn is_finite(&self) -> bool {
        self.shift.is_finite() && self.tilt.is_finite()
    }

    /// The map from coordinates behind the decenter to those in front of it. Its sines and cosines
    /// are the same on every machine, and those of multiples of 90 degrees are exact.
    pub(crate) fn affine(&self) -> DAffine3 {
        let turns = self.tilt.to_array().map(|degrees| {
            let quarters = (degrees / 90.0).round();
            let (sin, cos) = libm::sincos((degrees - 90.0 * quarters).to_radians());
            match quarters.rem_euclid(4.0) {
                0.0 => (sin, cos),
                1.0 => (cos, -sin),
                2.0 => (-sin, -cos),
                _ => (-cos, sin),
            }
        });
        let [(sx, cx), (sy, cy), (sz, cz)] = turns;
        let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
        let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
        let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
        DAffine3 {
            matrix3: x * y * z,
            translation: self.shift,
        }
    }

    /// The decenter of a map, which must be a rotation and a translation.
    pub(crate) fn from_affine(map: &DAffine3) -> Self {
        let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
        let across = libm::hypot(x.x, y.x);
        let tilt = match across > 1e-12 {
            true => DVec3::new(
                libm::atan2(-z.y, z.z),
                libm::atan2(z.x, across),
                libm::atan2(-y.x, x.x),
            ),
            // x and z turn about one axis: the turn about z takes both.
            false => DVec3::new(0.0, libm::atan2(z.x, across), libm::atan2(x.y, y.y)),
        };
        Self {
            shift: map.translation,
            tilt: tilt.map(f64::to_degrees),
        }
    }

    /// This decenter and then another one, in the coordinates behind it.
    pub(crate) fn then(&self, next: &Self) -> Self {
        if self.is_none() {
            return *next;
        }
        if next.is_none() {
            return *self;
        }
        if self.tilt == DVec3::ZERO {
            return Self {
                shift: self.shift + next.shift,
                tilt: next.tilt,
            };
        }
        Self::from_affine(&(self.affine() * next.affine()))
    }

    /// The decenter that takes this one back.
    pub fn inverse(&self) -> Self {
        if self.tilt == DVec3::ZERO {
            return Self {
                shift: -self.shift + DVec3::ZERO,
                ..*self
            };
        }
        let found = Self::from_affine(&inverse(&self.affine()));
        // A turn about one axis keeps its digits.
        let turns = self
            .tilt
            .to_array()
            .iter()
            .filter(|angle| **angle != 0.0)
            .count();
        match turns {
            1 => Self {
                tilt: -self.tilt + DVec3::ZERO,
                ..found
            },
            _ => found,
        }
    }

    /// The shift in the coordinates behind the decenter. What rounding made of 0 is 0.
    pub(crate) fn shift_behind(&self) -> DVec3 {
        let shift = -self.inverse().shift;
        let noise = 1e-12 * shift.length();
        shift.map(|v| if v.abs() <= noise { 0.0 } else { v })
    }

    /// Whether the shift is across the axis behind the decenter, but not across that before it.
    pub(crate) fn shifts_across_axis_behind(&self) -> bool {
        self.shift.z != 0.0 && self.shift_behind().z == 0.0
    }

    /// Removes the shift along the axis behind the decenter, and returns it.
    pub(crate) fn take_shift_along_axis(&mut self) -> f64 {
        let along = self.shift_behind().z;
        self.shift -= self.affine().matrix3 * (along * DVec3::Z);
        along
    }

    /// The decenter in coordinates whose z axis has the opposite direction.
    pub(crate) fn turned_around(&self) -> Self {
        Self {
            shift: DVec3::new(self.shift.x, self.shift.y, -self.shift.z),
            tilt: DVec3::new(-self.tilt.x, -self.tilt.y, self.tilt.z),
        }
    }

    /// The decenter with its lengths multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            shift: factor * self.shift,
            ..*self
        }
    }
}

/// The inverse of a rotation and a translation.
pub(crate) fn inverse(map: &DAffine3) -> DAffine3 {
    let back = map.matrix3.transpose();
    DAffine3 {
        matrix3: back,
        translation: -(back * map.translation),
    }
}

/// The decenters around a surface. The thickness behind it is measured along the axis behind
/// `after`, and that in front of it along the axis in front of `before`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceFrame {
    /// From the axis in front of the surface to the surface.
    pub before: Decenter,
    /// From the surface to the axis behind it.
    pub after: Decenter,
}

impl SurfaceFrame {
    /// The frame of a surface that is decentered alone: the axis goes on as if it were not.
    pub fn returning(before: Decenter) -> Self {
        Self {
            before,
            after: before.inverse(),
        }
    }

    /// The frame in words, with lengths in millimeters.
    pub fn description(&self) -> String {
        let rounded = |v: f64| (v * 1e6).round() / 1e6 + 0.0;
        let one = |name: &str, decenter: &Decenter| {
            let list = |v: DVec3| v.map(rounded).to_array().map(|v| v.to_string()).join(", ");
            let [shift, tilt] = [decenter.shift, decenter.tilt].map(list);
            format!("{name}: decenter {shift} mm, tilt {tilt} degrees")
        };
        if self.after == self.before.inverse() {
            return one("decentered alone", &self.before);
        }
        let all = [("in front", &self.before), ("behind", &self.after)];
        let stated = all.into_iter().filter(|(_, decenter)| !decenter.is_none());
        let texts: Vec<String> = stated.map(|(name, decenter)| one(name, decenter)).collect();
        texts.join("; ")
    }

    /// The frame as a field of a surface; none if it changes nothing.
    pub(crate) fn boxed(self) -> Option<Box<Self>> {
        (self != Self::default()).then(|| Box::new(self))
    }

    /// The frame with its lengths multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            before: self.before.scaled(factor),
            after: self.after.scaled(factor),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_a_rotation_make_that_rotation() {
        for tilt in [
            DVec3::new(10.0, -20.0, 30.0),
            DVec3::new(-170.0, 80.0, 5.0),
            DVec3::new(45.0, 0.0, 0.0),
            DVec3::new(20.0, 90.0, 30.0),
            DVec3::new(0.0, -90.0, 135.0),
        ] {
            let one = Decenter {
                shift: DVec3::new(1.0, 2.0, 3.0),
                tilt,
            };
            let again = Decenter::from_affine(&one.affine());
            let off = again.affine().matrix3 - one.affine().matrix3;
            assert!(
                off.to_cols_array().iter().all(|v| v.abs() < 1e-15),
                "{tilt}"
            );
            let back = one.then(&one.inverse());
            assert!(back.shift.length() < 1e-14 && back.tilt.length() < 1e-12);
        }
    }

    /// Fields of a right-handed turn: y goes to z about x, z to x about y, and x to y about z.
    #[test]
    fn quarter_turns_are_exact_and_right_handed() {
        let turned = |tilt: DVec3, v: DVec3| {
            let decenter = Decenter {
                tilt,
                ..Decenter::NONE
            };
            decenter.affine().transform_vector3(v)
        };
        assert_eq!(turned(DVec3::new(90.0, 0.0, 0.0), DVec3::Y), DVec3::Z);
        assert_eq!(turned(DVec3::new(0.0, 90.0, 0.0), DVec3::Z), DVec3::X);
        assert_eq!(turned(DVec3::new(0.0, 0.0, -270.0), DVec3::X), DVec3::Y);
    }

    #[test]
    fn turning_z_around_is_a_reflection_on_both_sides() {
        let one = Decenter {
            shift: DVec3::new(1.0, -2.0, 3.0),
            tilt: DVec3::new(10.0, 25.0, -40.0),
        };
        let flip = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let wanted = flip * one.affine() * flip;
        let found = one.turned_around().affine();
        let off = (found.matrix3 - wanted.matrix3).to_cols_array();
        assert!(off.iter().all(|v| v.abs() < 1e-16), "{off:?}");
        assert_eq!(found.translation, wanted.translation);
    }
}
