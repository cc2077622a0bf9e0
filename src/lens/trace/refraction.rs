//! How a surface bends a ray that crosses it.

use glam::DVec3;

use crate::lens::trace::meet::Hit;

/// How a surface bends a ray that crosses it one way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend {
    /// Index before over index behind.
    pub mu: f64,
    /// 1 − µ², from the difference of the indices: a step of 2^-40 keeps its digits.
    pub step: f64,
}

impl Bend {
    pub(crate) fn new(before: f64, behind: f64) -> Self {
        let step = (behind - before) * (behind + before) / (behind * behind);
        Self {
            mu: before / behind,
            step,
        }
    }

    /// Indices so nearly equal that the difference of cosines would lose digits that matter.
    pub(crate) fn is_slight(self) -> bool {
        self.step.abs() < 0.01
    }
}

/// The direction behind a surface; none at total reflection.
///
/// d' = µ d ± (√k − µ cos) N. Where the indices are nearly equal the difference of the roots is
/// taken as 1 − µ² over their sum: a step of the index of 2^-40 bends by 4e-13, and that comes
/// out with four digits. Elsewhere the plain difference errs no more than its roots do, and
/// saves one division in four.
pub(crate) fn refract(d: DVec3, hit: &Hit, bend: Bend, sign: f64) -> Option<DVec3> {
    if bend.step == 0.0 {
        return Some(d);
    }
    let k = 1.0 - bend.mu * bend.mu * (1.0 - hit.cos * hit.cos);
    if !(k >= 0.0) {
        return None;
    }
    let turn = if bend.is_slight() {
        sign * bend.step / (k.sqrt() + bend.mu * hit.cos)
    } else {
        sign * (k.sqrt() - bend.mu * hit.cos)
    };
    Some(bend.mu * d + turn * hit.normal)
}
