//! Draws shapes into a canvas one triangle after the other, when it cannot keep them as a whole.

use super::drawing::{Canvas, MaterialsBy};
use crate::geometry::{self, Corner, Fineness, QuadricKind, TriangleMesh};

/// Draws the triangles of a mesh.
pub(crate) fn draw_mesh(
    out: &mut (impl Canvas + ?Sized),
    mesh: &TriangleMesh,
    materials: MaterialsBy,
) {
    let by_part = materials == MaterialsBy::Part && mesh.colors.is_empty();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let materials = mesh.materials(i, by_part);
        out.triangle([0, 1, 2].map(|k| {
            let v = triangle[k] as usize;
            Corner {
                position: mesh.positions[v],
                normal: mesh.normals[v],
                material: materials[k],
                coordinates: mesh.texcoords[v],
                third: 0.0,
            }
        }));
    }
}

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
