//! Draws a `QuadMesh`, which has rows of quadrilaterals.

use std::borrow::Cow;

use glam::Vec3;
use ivcam_inventor::grammar::quad_mesh;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{Binding, Coordinates, State};

use crate::geometry::BoxCoordinates;
use crate::geometry::normals::{grid_face_normals, grid_vertex_normals, unit};
use crate::scene::canvas::{
    Canvas, NormalPer, Normals, Runs, ShapeSize, Vertices, check_lists, count, is_per_vertex,
};

/// Draws a `QuadMesh`.
pub(super) fn quad_mesh<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let rows = count(node, quad_mesh::VERTICES_PER_COLUMN);
    let columns = count(node, quad_mesh::VERTICES_PER_ROW);
    let start = count(node, quad_mesh::START_INDEX);
    let enough = rows
        .checked_mul(columns)
        .is_some_and(|n| n <= state.coordinates.len().saturating_sub(start));
    if !enough || rows < 1 || columns < 1 {
        out.census().bad_corners += 1;
        return;
    }
    out.bound_all((start..start + rows * columns).filter_map(|c| state.coordinates.get(c)));
    if rows < 2 || columns < 2 {
        return;
    }
    let mut vertices = Vertices::unindexed(state);
    let size = ShapeSize {
        corners: rows * columns,
        faces: (rows - 1) * (columns - 1),
        parts: rows - 1,
    };
    check_lists(&vertices, size, out);
    if out.wants().coordinates {
        let used = (start..start + rows * columns).filter_map(|c| state.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    if out.wants().normals {
        vertices.normals = normals(state, vertices.normal_binding, start, rows, columns);
    }
    let whole = Runs::whole(start, rows * columns);
    let triangles = 2 * (rows - 1) * (columns - 1);
    out.triangles(&whole, &vertices, triangles, &mut move |list| {
        for r in 0..rows - 1 {
            for c in 0..columns - 1 {
                let (first, face) = (r * columns + c, r * (columns - 1) + c);
                let below = first + columns;
                list.add([first, below, below + 1], face, r);
                list.add([first, below + 1, first + 1], face, r);
            }
        }
    });
}

/// Returns the normals of the mesh, which are generated if the state has none.
fn normals<'a>(
    state: &State<'a>,
    binding: Binding,
    start: usize,
    rows: usize,
    columns: usize,
) -> Normals<'a> {
    if !state.normals.is_empty() {
        return Normals::Given(state.normals);
    }
    let faces = face_normals(state, start, rows, columns);
    match binding {
        _ if is_per_vertex(binding) => Normals::Generated(
            grid_vertex_normals(&faces, rows, columns),
            NormalPer::Position,
        ),
        Binding::PerFace => Normals::Generated(faces, NormalPer::Face),
        Binding::PerPart => {
            let of_rows = faces.chunks(columns - 1).map(|row| unit(row.iter().sum()));
            Normals::Generated(of_rows.collect(), NormalPer::Part)
        }
        _ => Normals::None,
    }
}

/// Returns the normals of the quadrilaterals.
fn face_normals(state: &State<'_>, start: usize, rows: usize, columns: usize) -> Vec<Vec3> {
    let used = start..start + rows * columns;
    let points: Cow<'_, [Vec3]> = match state.coordinates {
        Coordinates::Three(all) => all[used].into(),
        all => used.map(|c| all.get(c).unwrap_or_default()).collect(),
    };
    grid_face_normals(&points, columns, state.hints.counterclockwise())
}
