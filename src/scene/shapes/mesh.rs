//! `QuadMesh`: rows of quadrilaterals.

use glam::Vec3;

use super::BoxCoordinates;
use super::vertices::{Normals, Place, Vertices, is_per_vertex, without_index};
use crate::graph::read::Fields;
use crate::graph::state::{Binding, State};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::scene::builder::Corner;
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
    for i in 0..rows * columns {
        if let Some(p) = state.coordinates.get(start + i) {
            out.bound(p);
        }
    }
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
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let face = r * (columns - 1) + c;
            let corner = |r2: usize, c2: usize| -> Option<Corner> {
                let index = r2 * columns + c2;
                let mut corner = vertices.corner(Place {
                    coordinate: start + index,
                    position: index,
                    count: index,
                    face,
                    part: r,
                })?;
                if let Some(normal) = flat(r, c) {
                    corner.normal = normal;
                }
                Some(corner)
            };
            let (Some(a), Some(b), Some(d), Some(e)) = (
                corner(r, c),
                corner(r + 1, c),
                corner(r, c + 1),
                corner(r + 1, c + 1),
            ) else {
                continue;
            };
            out.triangle([a, b, e]);
            out.triangle([a, e, d]);
        }
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
