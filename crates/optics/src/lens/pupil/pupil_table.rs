//! What the tables of pupils have in common, so that one kernel aims by either.

use glam::DVec2;

use crate::lens::pupil::patch::PupilPatch;
use crate::lens::pupil::symmetry::WedgeCopy;
use crate::lens::pupil::vignetting::Vignetting;

/// A table of pupils over the film. See [`PupilPatch`] for `L` and `Q`.
pub(super) trait PupilTable<const L: usize, const Q: usize> {
    /// The film coordinates of a film point, its direction from the axis, and the number of its
    /// wedge's copy. The film point is in millimeters from the film's middle.
    fn coordinates<const FUSED: bool>(&self, film: DVec2) -> ([f64; 2], DVec2, f64);

    /// The patch that contains film coordinates; none if no light reaches them.
    fn patch(&self, film: [f64; 2]) -> Option<&PupilPatch<L, Q>>;

    /// The direction of a film point in the first wedge, and the copy that maps it to its own.
    fn unfolded(&self, direction: DVec2, copy: f64) -> (DVec2, WedgeCopy);

    /// The unvignetted fractions over a patch of the table, for each lens; empty if they are not
    /// known.
    fn unvignetted<'a>(
        &'a self,
        patch: &'a PupilPatch<L, Q>,
        vignetting: &'a Vignetting,
    ) -> &'a [[f64; Q]];
}
