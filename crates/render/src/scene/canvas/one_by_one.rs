//! Draws round surfaces as polygons into a canvas that cannot keep them as a whole.

use super::drawing::Canvas;
use crate::geometry::{self, Fineness, QuadricKind};

/// Draws a round surface as polygons, or the outlines of these.
pub(crate) fn draw_facets(
    out: &mut impl Canvas,
    kind: QuadricKind,
    fineness: Fineness,
    material: u32,
) {
    let outlines = out.wants().outlines;
    for polygon in geometry::facets(kind, fineness, material) {
        if outlines {
            out.outline(&polygon);
            continue;
        }
        for pair in polygon[1..].windows(2) {
            out.triangle([polygon[0], pair[0], pair[1]]);
        }
    }
}
