//! `QuadMesh`: rows of quadrilaterals.

use glam::Vec3;

use super::BoxCoordinates;
use super::vertices::{Normals, Place, Vertices, is_per_vertex, without_index};
use crate::graph::read::Fields;
use crate::graph::state::{Binding, State};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::scene::builder::Placed;
use crate::scene::normals::unit;

pub fn quad_mesh<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let size = |name: &str| usize::try_from(node.read::<i32>(name).unwrap_or(1)).unwrap_or(0);
    let (rows, columns) = (size("verticesPerColumn"), size("verticesPerRow"));
    let start = usize::try_from(node.read::<i32>("startIndex").unwrap_or(0)).unwrap_or(0);
    let enough = rows
        .checked_mul(columns)
        .is_some_and(|n| n <= state.coordinates.len().saturating_sub(start));
    if !enough || rows < 1 || columns < 1 {
        out.census_mut().bad_corners += 1;
        return;
    }
    out.bound_all((start..start + rows * columns).filter_map(|c| state.coordinates.get(c)));
    if rows < 2 || columns < 2 {
        return;
    }
    let normal_binding = without_index(state.normal_binding);
    let mut vertices = Vertices {
        state,
        coordinates: state.coordinates,
        normals: Normals::None,
        normal_binding,
        normal_index: None,
        material_binding: without_index(state.material_binding),
        material_index: None,
        texture_index: None,
        coord_index: None,
        boxed: None,
    };
    if out.wants_coordinates() {
        let used = (start..start + rows * columns).filter_map(|c| state.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    let faces = if out.wants_normals() && state.normals.is_empty() {
        face_normals(state, start, rows, columns)
    } else {
        Vec::new()
    };
    if out.wants_normals() {
        vertices.normals = if !state.normals.is_empty() {
            Normals::Given(state.normals)
        } else if is_per_vertex(normal_binding) {
            Normals::Made(smooth(&faces, rows, columns))
        } else {
            Normals::None
        };
    }
    let flat = |r: usize, c: usize| match normal_binding {
        _ if faces.is_empty() || is_per_vertex(normal_binding) => None,
        Binding::PerFace => Some(faces[r * (columns - 1) + c]),
        Binding::PerPart => {
            let row = &faces[r * (columns - 1)..(r + 1) * (columns - 1)];
            Some(unit(row.iter().sum()))
        }
        _ => None,
    };
    // The corner of a vertex, as the face in row `r` and column `c` has it.
    let corner = |(r, c): (usize, usize), index: usize, out: &Builder<'a>| -> Option<Placed> {
        let mut corner = vertices.corner(Place {
            coordinate: start + index,
            position: index,
            count: index,
            face: r * (columns - 1) + c,
            part: r,
        })?;
        if let Some(normal) = flat(r, c) {
            corner.normal = normal;
        }
        Some(out.place(corner))
    };
    let by_vertex = |b: Binding| is_per_vertex(b) || b == Binding::Overall;
    let shared = by_vertex(normal_binding) && by_vertex(vertices.material_binding);
    let row = |r: usize, out: &Builder<'a>| -> Vec<Option<Placed>> {
        let vertices = r * columns..(r + 1) * columns;
        vertices.map(|i| corner((0, 0), i, out)).collect()
    };
    let mut above = if shared { row(0, out) } else { Vec::new() };
    out.expect(2 * (rows - 1) * (columns - 1));
    for r in 0..rows - 1 {
        let below = if shared { row(r + 1, out) } else { Vec::new() };
        for c in 0..columns - 1 {
            let four = if shared {
                [above[c], below[c], above[c + 1], below[c + 1]]
            } else {
                let first = r * columns + c;
                [first, first + columns, first + 1, first + columns + 1]
                    .map(|index| corner((r, c), index, out))
            };
            if let [Some(a), Some(b), Some(d), Some(e)] = &four {
                out.triangle_of([a, b, e]);
                out.triangle_of([a, e, d]);
            }
        }
        above = below;
    }
}

fn face_normals(state: &State<'_>, start: usize, rows: usize, columns: usize) -> Vec<Vec3> {
    let at = |r: usize, c: usize| {
        state
            .coordinates
            .get(start + r * columns + c)
            .unwrap_or_default()
    };
    let mut out = Vec::with_capacity((rows - 1) * (columns - 1));
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            // Coin's choice: the plane at the first corner, not the mean of the four.
            let normal = unit((at(r + 1, c) - at(r, c)).cross(at(r, c + 1) - at(r, c)));
            out.push(if state.hints.counterclockwise() {
                normal
            } else {
                -normal
            });
        }
    }
    out
}

/// A mesh is smooth everywhere, whatever the crease angle (Coin).
fn smooth(faces: &[Vec3], rows: usize, columns: usize) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(rows * columns);
    for r in 0..rows {
        for c in 0..columns {
            let mut sum = Vec3::ZERO;
            for (dr, dc) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                if r >= dr && c >= dc && r - dr < rows - 1 && c - dc < columns - 1 {
                    sum += faces[(r - dr) * (columns - 1) + c - dc];
                }
            }
            out.push(unit(sum));
        }
    }
    out
}
