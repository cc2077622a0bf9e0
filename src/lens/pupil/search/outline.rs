//! What a film point sees, and where to begin a search from a neighboring point.

use glam::DVec2;

use crate::lens::pupil::polygon::Support;
use crate::math::lanes::LANES;

/// Directions in which an outline is sought: over half a turn where the other half mirrors it.
pub(super) const DIRECTIONS: usize = 2 * LANES;

/// A direction, and its angle.
#[derive(Clone, Copy)]
pub(super) struct Way {
    pub angle: f64,
    pub way: DVec2,
}

impl Way {
    pub fn at(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self {
            angle,
            way: DVec2::new(cos, sin),
        }
    }
}

/// What a film point sees: how far the light reaches in each of the directions asked for, and
/// where to begin from a neighboring point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub support: Support,
    pub hint: Hint,
}

/// A point inside the light, how far from it the rim is in every direction asked for, and how
/// steeply the fill rises there, a millimeter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hint {
    pub(super) center: DVec2,
    pub(super) distances: [f64; DIRECTIONS],
    pub(super) slopes: [f64; DIRECTIONS],
}

impl Hint {
    /// In the middle between two.
    pub fn between(a: &Seen, b: &Seen) -> Self {
        Self {
            center: a.hint.center.midpoint(b.hint.center),
            distances: std::array::from_fn(|i| 0.5 * (a.hint.distances[i] + b.hint.distances[i])),
            slopes: std::array::from_fn(|i| 0.5 * (a.hint.slopes[i] + b.hint.slopes[i])),
        }
    }

    pub fn center(&self) -> DVec2 {
        self.center
    }

    /// How steeply the fill rises where it does so most, a millimeter.
    pub fn slope(&self) -> f64 {
        self.slopes.into_iter().fold(0.0, f64::max)
    }

    /// The same with its middle turned about the axis, and as many times as far from it.
    pub fn turned(&self, along: DVec2) -> Self {
        Self {
            center: along.rotate(self.center),
            ..*self
        }
    }

    /// As far beyond the second as that is from the first.
    pub fn beyond(a: &Self, b: &Self) -> Self {
        Self {
            center: 2.0 * b.center - a.center,
            ..*b
        }
    }
}

/// Where to begin behind two in a row.
pub fn next(last: [Option<Hint>; 2]) -> Option<Hint> {
    match last {
        [Some(a), Some(b)] => Some(Hint::beyond(&a, &b)),
        [_, b] => b,
    }
}
