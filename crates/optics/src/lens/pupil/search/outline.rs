//! The outline of the exit pupil from one film point, and the guess that it makes for the next.

use glam::DVec2;
use ivcam_base::math::lanes::LANES;

use crate::lens::pupil::support::Support;
use crate::lens::pupil::symmetry::unit;

/// The number of directions in which an outline is searched. They cover half a turn if the other
/// half is its mirror image.
pub(super) const DIRECTIONS: usize = 2 * LANES;

/// A direction in the rear vertex plane.
#[derive(Clone, Copy)]
pub(super) struct Direction {
    /// The angle from +x, in radians.
    pub angle: f64,
    /// The unit vector.
    pub unit: DVec2,
}

impl Direction {
    /// The direction at an angle from +x, in radians.
    pub(super) fn at(angle: f64) -> Self {
        let unit = unit(angle);
        Self { angle, unit }
    }
}

/// The outline of the exit pupil from one film point, and a guess for the outline from a
/// neighboring film point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PupilOutline {
    pub support: Support,
    pub guess: OutlineGuess,
}

/// What a search for an outline starts from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutlineGuess {
    /// A point inside the pupil, in millimeters.
    pub(super) center: DVec2,
    /// The distance of the rim from the center in each direction, in millimeters.
    pub(super) distances: [f64; DIRECTIONS],
    /// The slope of the fill at the rim in each direction, per millimeter.
    pub(super) slopes: [f64; DIRECTIONS],
}

impl OutlineGuess {
    /// The guess for a film point halfway between two.
    pub(crate) fn between(a: &PupilOutline, b: &PupilOutline) -> Self {
        let (a, b) = (&a.guess, &b.guess);
        Self {
            center: a.center.midpoint(b.center),
            distances: std::array::from_fn(|i| 0.5 * (a.distances[i] + b.distances[i])),
            slopes: std::array::from_fn(|i| 0.5 * (a.slopes[i] + b.slopes[i])),
        }
    }

    /// The guess for the film point that follows the last two of a row. The center is extrapolated
    /// linearly, 2b − a.
    pub(crate) fn following(last: [Option<Self>; 2]) -> Option<Self> {
        match last {
            [Some(a), Some(b)] => Some(Self {
                center: 2.0 * b.center - a.center,
                ..b
            }),
            [_, b] => b,
        }
    }

    /// A point inside the pupil, in millimeters.
    pub(crate) fn center(&self) -> DVec2 {
        self.center
    }

    /// The steepest slope of the fill at the rim, per millimeter.
    pub(crate) fn slope(&self) -> f64 {
        self.slopes.into_iter().fold(0.0, f64::max)
    }

    /// The guess with its center rotated about the axis and scaled, by a complex factor.
    pub(crate) fn turned(&self, factor: DVec2) -> Self {
        Self {
            center: factor.rotate(self.center),
            ..*self
        }
    }
}
