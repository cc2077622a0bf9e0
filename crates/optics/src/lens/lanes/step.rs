//! The last part of crossing a surface, which is the same for all shapes: refraction and losses.

use crate::lens::lanes::bundle::{BLOCKED, Bundle, MISSED, REFLECTED};
use crate::lens::trace::element::Element;
use crate::lens::trace::refraction::Refraction;

/// One surface as a bundle crosses it.
pub(super) struct LaneStep<'a> {
    pub element: &'a Element,
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
    /// The unit normal toward the film.
    pub normal: [f64; 3],
    /// The cosine of the angle of incidence.
    pub cos: f64,
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
    #[inline(always)]
    pub(super) fn cross<const STOPS: bool>(&self, b: &mut Bundle, i: usize, hit: LaneHit) {
        let (mu, index_step, clear, sign) = (
            self.refraction.mu,
            self.refraction.step,
            self.element.clear,
            self.sign,
        );
        let ([x, y, z], [nx, ny, nz], cos) = (hit.point, hit.normal, hit.cos);
        let r2 = x * x + y * y;
        let k = 1.0 - mu * mu * (1.0 - cos * cos);
        let turn = match kind_of(self.refraction) {
            SAME_INDEX => 0.0,
            SLIGHT_STEP => sign * index_step / (k.sqrt() + mu * cos),
            _ => sign * (k.sqrt() - mu * cos),
        };
        if !STOPS {
            b.note_fill(i, r2 / clear, self.number);
        }
        let code = self.outcome(
            hit.is_hit,
            !STOPS | (r2 <= clear),
            (k >= 0.0) | (index_step == 0.0),
        );
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
        b.dx[i] = mu * b.dx[i] + turn * nx;
        b.dy[i] = mu * b.dy[i] + turn * ny;
        b.dz[i] = mu * b.dz[i] + turn * nz;
        (b.x[i], b.y[i], b.z[i]) = (x, y, z);
    }
}
