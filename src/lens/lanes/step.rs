//! What every lane does at one surface.

use crate::lens::lanes::bundle::{BLOCKED, Bundle, MISSED, REFLECTED};
use crate::lens::trace::element::Element;
use crate::lens::trace::refraction::Bend;

/// One surface on the way of a bundle.
pub(super) struct Step<'a> {
    pub element: &'a Element,
    pub number: u64,
    /// From the last vertex to this one, along z.
    pub shift: f64,
    pub bend: Bend,
    pub sign: f64,
}

/// The index does not change.
pub(super) const NO_BEND: u8 = 0;
/// The index changes slightly; see [`refract`](crate::lens::trace::refraction::refract).
pub(super) const SLIGHT_BEND: u8 = 1;
/// The index changes.
pub(super) const BEND: u8 = 2;

#[inline(always)]
pub(super) fn kind_of(bend: Bend) -> u8 {
    match bend.step {
        0.0 => NO_BEND,
        _ if bend.is_slight() => SLIGHT_BEND,
        _ => BEND,
    }
}

/// Where a ray meets a surface, the unit normal there, and the cosine of incidence.
pub(super) struct LaneHit {
    pub met: bool,
    pub point: [f64; 3],
    pub normal: [f64; 3],
    pub cos: f64,
}

impl Step<'_> {
    /// The code of what becomes of a ray that was on its way: see [`Bundle::loss`].
    #[inline(always)]
    pub(super) fn outcome(&self, met: bool, clear: bool, bends: bool) -> f64 {
        let of = |kind: u64| (self.number | kind) as f64;
        let code = if bends { 0.0 } else { of(REFLECTED) };
        let code = if clear { code } else { of(BLOCKED) };
        if met { code } else { of(MISSED) }
    }

    /// Puts a lane's ray to its hit and refracts it, or notes why it is lost.
    #[inline(always)]
    pub(super) fn cross<const STOPS: bool>(&self, b: &mut Bundle, i: usize, hit: LaneHit) {
        let (mu, bend, clear, sign) = (self.bend.mu, self.bend.step, self.element.clear, self.sign);
        let ([x, y, z], [nx, ny, nz], cos) = (hit.point, hit.normal, hit.cos);
        let r2 = x * x + y * y;
        let k = 1.0 - mu * mu * (1.0 - cos * cos);
        let turn = match kind_of(self.bend) {
            NO_BEND => 0.0,
            SLIGHT_BEND => sign * bend / (k.sqrt() + mu * cos),
            _ => sign * (k.sqrt() - mu * cos),
        };
        if !STOPS {
            b.note_fill(i, r2 / clear, self.number);
        }
        let code = self.outcome(hit.met, !STOPS | (r2 <= clear), (k >= 0.0) | (bend == 0.0));
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
        b.dx[i] = mu * b.dx[i] + turn * nx;
        b.dy[i] = mu * b.dy[i] + turn * ny;
        b.dz[i] = mu * b.dz[i] + turn * nz;
        (b.x[i], b.y[i], b.z[i]) = (x, y, z);
    }
}
