//! What every lane does at one surface.

use super::bundle::{BLOCKED, MISSED, REFLECTED};
use crate::lens::trace::element::Element;
use crate::lens::trace::refraction::Bend;

/// What every lane does at one surface.
pub(super) struct Step<'a> {
    pub element: &'a Element,
    pub number: u64,
    /// Along z, from the last vertex to this one.
    pub shift: f64,
    pub bend: Bend,
    pub sign: f64,
}

impl Step<'_> {
    /// What becomes of a ray that was on its way: see [`Bundle::loss`].
    #[inline(always)]
    pub fn outcome(&self, met: bool, clear: bool, bends: bool) -> f64 {
        let of = |kind: u64| (self.number | kind) as f64;
        let code = if bends { 0.0 } else { of(REFLECTED) };
        let code = if clear { code } else { of(BLOCKED) };
        if met { code } else { of(MISSED) }
    }
}

/// The medium goes on; the index changes slightly; it changes. See [`refract`].
pub(super) const NO_BEND: u8 = 0;
pub(super) const SLIGHT_BEND: u8 = 1;
pub(super) const BEND: u8 = 2;

pub(super) fn kind_of(bend: Bend) -> u8 {
    match bend.step {
        0.0 => NO_BEND,
        _ if bend.is_slight() => SLIGHT_BEND,
        _ => BEND,
    }
}
