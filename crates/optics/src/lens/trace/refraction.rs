//! Refraction at a surface.

use glam::DVec3;

use crate::lens::trace::intersect::SurfaceHit;

/// The change of the refractive index along a ray that crosses a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refraction {
    /// µ, the index before the surface over the index behind it.
    pub mu: f64,
    /// 1 − µ². It is computed from the difference of the indices, so that a difference of 2^-40
    /// keeps its digits.
    pub step: f64,
}

impl Refraction {
    /// The change from one index to another, in the order of travel.
    pub(crate) fn new(before: f64, behind: f64) -> Self {
        let step = (behind - before) * (behind + before) / (behind * behind);
        Self {
            mu: before / behind,
            step,
        }
    }

    /// Whether the indices are so nearly equal that the difference of the cosines would lose
    /// digits. At the limit, 0.01, it loses two.
    pub(crate) fn is_slight(self) -> bool {
        self.step.abs() < 0.01
    }
}

/// The direction behind a surface; none at total reflection.
///
/// The direction is d' = µ d ± (√k − µ cos) N. Where the indices are nearly equal, the difference
/// of the roots is computed as 1 − µ² over their sum: a step of the index of 2^-40 deflects a ray
/// by 4e-13, and the result has four digits. Elsewhere the plain difference has no greater error
/// than its roots, and saves one division in four.
pub(crate) fn refract(
    d: DVec3,
    hit: &SurfaceHit,
    refraction: Refraction,
    sign: f64,
) -> Option<DVec3> {
    if refraction.step == 0.0 {
        return Some(d);
    }
    let k = 1.0 - refraction.mu * refraction.mu * (1.0 - hit.cos * hit.cos);
    if !(k >= 0.0) {
        return None;
    }
    let turn = if refraction.is_slight() {
        sign * refraction.step / (k.sqrt() + refraction.mu * hit.cos)
    } else {
        sign * (k.sqrt() - refraction.mu * hit.cos)
    };
    Some(refraction.mu * d + turn * hit.normal)
}
