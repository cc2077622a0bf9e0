//! The last part of crossing a surface, which is the same for all shapes: refraction and losses.

use crate::lens::lanes::bundle::{BLOCKED, Bundle, MISSED, REFLECTED};
use crate::lens::trace::element::Element;
use crate::lens::trace::refraction::Refraction;

/// One surface as a bundle crosses it.
pub(super) struct LaneStep<'a> {
    pub element: &'a Element,
    /// The reciprocal of the square of the semi-diameter, per square millimeter.
    pub per_clear: f64,
    /// Four times the number of the surface: the code of a loss without its kind.
    pub number: u64,
    /// What is added to z so that positions relative to the last vertex are relative to this one,
    /// in millimeters.
    pub shift: f64,
    pub refraction: Refraction,
    /// +1 toward the film and −1 toward the scene.
    pub sign: f64,
}

/// The kind of a surface at which the index does not change.
pub(super) const SAME_INDEX: u8 = 0;
/// The kind of a surface at which the index changes slightly; see
/// [`refract`](crate::lens::trace::refraction::refract).
pub(super) const SLIGHT_STEP: u8 = 1;
/// The kind of a surface at which the index changes.
pub(super) const LARGE_STEP: u8 = 2;

/// The kind of a surface, by its change of the index.
#[inline(always)]
pub(super) fn kind_of(refraction: Refraction) -> u8 {
    match refraction.step {
        0.0 => SAME_INDEX,
        _ if refraction.is_slight() => SLIGHT_STEP,
        _ => LARGE_STEP,
    }
}

/// Where the ray of one lane hits a surface. The other fields are meaningless if it misses.
pub(super) struct LaneHit {
    pub is_hit: bool,
    /// The point relative to the vertex, in millimeters.
    pub point: [f64; 3],
    /// A vector along the normal toward the film, of any length.
    pub gradient: [f64; 3],
    /// The square of its length.
    pub square: f64,
    /// The cosine of the angle of incidence times its length.
    pub along: f64,
}

impl LaneStep<'_> {
    /// The code for [`Bundle::loss`] of a ray that was not lost before this surface.
    #[inline(always)]
    pub(super) fn outcome(&self, hits: bool, clear: bool, refracts: bool) -> f64 {
        let of = |kind: u64| (self.number | kind) as f64;
        let code = if refracts { 0.0 } else { of(REFLECTED) };
        let code = if clear { code } else { of(BLOCKED) };
        if hits { code } else { of(MISSED) }
    }

    /// Moves the ray of a lane to its hit and refracts it, or notes why it is lost.
    ///
    /// With a gradient G of the surface, of length L, the direction behind it is
    /// d' = µ d ± (1 − µ²) G / (√k + µ L cos), where k = (1 − µ²) L² + (µ L cos)². It is that of
    /// [`refract`](crate::lens::trace::refraction::refract) without the unit normal, which would
    /// take a root and three quotients more.
    #[inline(always)]
    pub(super) fn cross<const STOPS: bool>(&self, b: &mut Bundle, i: usize, hit: LaneHit) {
        let (mu, index_step, clear) =
            (self.refraction.mu, self.refraction.step, self.element.clear);
        let ([x, y, z], [gx, gy, gz]) = (hit.point, hit.gradient);
        let r2 = x * x + y * y;
        let before = mu * hit.along;
        let k = index_step * hit.square + before * before;
        let turn = match kind_of(self.refraction) {
            SAME_INDEX => 0.0,
            _ => self.sign * index_step / (k.sqrt() + before),
        };
        if !STOPS {
            b.note_fill(i, r2 * self.per_clear, self.number);
        }
        let code = self.outcome(
            hit.is_hit,
            !STOPS | (r2 <= clear),
            (k >= 0.0) | (index_step == 0.0),
        );
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
        b.dx[i] = mu * b.dx[i] + turn * gx;
        b.dy[i] = mu * b.dy[i] + turn * gy;
        b.dz[i] = mu * b.dz[i] + turn * gz;
        (b.x[i], b.y[i], b.z[i]) = (x, y, z);
    }
}
