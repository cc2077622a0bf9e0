//! The outline of the exit pupil from one film point, and the guess that it makes for the next.

use glam::DVec2;

use crate::lens::pupil::polygon::Support;
use crate::math::lanes::LANES;

/// The number of directions in which an outline is searched: over half a turn if the other half is
/// its mirror image.
pub(super) const DIRECTIONS: usize = 2 * LANES;

/// A direction in the rear vertex plane.
#[derive(Clone, Copy)]
pub(super) struct Direction {
    pub angle: f64,
    pub unit: DVec2,
}

impl Direction {
    pub(super) fn at(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self {
            angle,
            unit: DVec2::new(cos, sin),
        }
    }
}

/// The outline of the exit pupil from one film point: its reach in the directions asked for, and a
/// guess for the outline from a neighboring film point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PupilOutline {
    pub support: Support,
    pub guess: OutlineGuess,
}

/// A point inside the pupil, the distance of the rim from it in each direction, and the slope of the
/// fill at the rim, per millimeter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutlineGuess {
    pub(super) center: DVec2,
    pub(super) distances: [f64; DIRECTIONS],
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

    pub(crate) fn center(&self) -> DVec2 {
        self.center
    }

    /// The steepest slope of the fill at the rim, per millimeter.
    pub(crate) fn slope(&self) -> f64 {
        self.slopes.into_iter().fold(0.0, f64::max)
    }

    /// The same guess with its center rotated about the axis and scaled, by a complex factor.
    pub(crate) fn turned(&self, factor: DVec2) -> Self {
        Self {
            center: factor.rotate(self.center),
            ..*self
        }
    }
}
