//! Draws the geometry nodes that X3D has and VRML97 does not: sets of triangles, quadrilaterals and
//! lines.
//!
//! Each is drawn as an index of faces or lines with −1 after each, by the functions for VRML97's
//! `IndexedFaceSet` and `IndexedLineSet`. A color or normal for each face is one for each triangle.

use std::f32::consts::PI;

use ivcam_inventor::grammar::{
    ClassId, class, indexed_triangle_set, triangle_fan_set, triangle_set, x3d_line_set,
    x3d_triangle_strip_set,
};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::State;

use super::faces::{Indices, indexed_faces};
use super::lines;
use crate::scene::canvas::Canvas;

/// Sets the crease angle of a shape whose vertices have normals that the file does not state: they
/// are those of all faces around a vertex. Shapes without an index share no vertices.
pub(super) fn prepare<'a>(class: ClassId, state: &mut State<'a>, node: NodeRef<'a>) {
    let is_indexed = matches!(
        class,
        class::INDEXED_TRIANGLE_SET
            | class::X3D_INDEXED_TRIANGLE_STRIP_SET
            | class::INDEXED_TRIANGLE_FAN_SET
            | class::INDEXED_QUAD_SET
            | class::X3D_TRIANGLE_STRIP_SET
            | class::TRIANGLE_FAN_SET
    );
    if is_indexed && node.get(triangle_set::NORMAL_PER_VERTEX) {
        state.hints.crease_angle = PI;
    }
}

/// Draws a geometry node. Returns `false` if its class is not drawn.
pub(super) fn draw<'a>(
    class: ClassId,
    node: NodeRef<'a>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) -> bool {
    let count = state.coordinates.len();
    let index = node.get(indexed_triangle_set::INDEX);
    // A strip has four entries for each of its corners.
    if !out.has_memory(16 * count.max(index.len()) as u64) {
        return true;
    }
    let all = || (0..count as i32).collect::<Vec<i32>>();
    let counted = |counts: &[i32]| runs(counts, count);
    let faces = match class {
        class::TRIANGLE_SET => groups(&all(), 3),
        class::QUAD_SET => groups(&all(), 4),
        class::INDEXED_TRIANGLE_SET => groups(index, 3),
        class::INDEXED_QUAD_SET => groups(index, 4),
        class::X3D_TRIANGLE_STRIP_SET => {
            strips(&counted(node.get(x3d_triangle_strip_set::STRIP_COUNT)))
        }
        class::TRIANGLE_FAN_SET => fans(&counted(node.get(triangle_fan_set::FAN_COUNT))),
        class::X3D_INDEXED_TRIANGLE_STRIP_SET => strips(index),
        class::INDEXED_TRIANGLE_FAN_SET => fans(index),
        class::X3D_LINE_SET => {
            let index = counted(node.get(x3d_line_set::VERTEX_COUNT));
            lines::indexed_lines(&index, [None, None], state, out);
            return true;
        }
        _ => return false,
    };
    let indices = Indices {
        coord: &faces,
        normal: None,
        material: None,
        texture: None,
    };
    indexed_faces(&indices, state, out);
    true
}

/// Returns consecutive faces of so many corners. What remains is left out.
fn groups(index: &[i32], corners: usize) -> Vec<i32> {
    let faces = index.chunks_exact(corners);
    faces
        .flat_map(|face| face.iter().copied().chain([-1]))
        .collect()
}

/// Returns an index of runs of so many consecutive coordinates, as far as there are any.
fn runs(counts: &[i32], coordinates: usize) -> Vec<i32> {
    let (mut out, mut next) = (Vec::new(), 0usize);
    for &count in counts {
        let end = next
            .saturating_add(usize::try_from(count).unwrap_or(0))
            .min(coordinates);
        if end > next {
            out.extend((next..end).map(|n| n as i32).chain([-1]));
        }
        next = end;
    }
    out
}

/// Returns the triangles of strips.
fn strips(index: &[i32]) -> Vec<i32> {
    let mut out = Vec::new();
    for strip in index.split(|&n| n < 0) {
        for (number, corners) in strip.windows(3).enumerate() {
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            out.extend(if number % 2 == 0 {
                [a, b, c, -1]
            } else {
                [b, a, c, -1]
            });
        }
    }
    out
}

/// Returns the triangles of fans.
fn fans(index: &[i32]) -> Vec<i32> {
    let mut out = Vec::new();
    for fan in index.split(|&n| n < 0) {
        let Some((&center, around)) = fan.split_first() else {
            continue;
        };
        out.extend(
            around
                .windows(2)
                .flat_map(|edge| [center, edge[0], edge[1], -1]),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_side_of_their_triangles() {
        assert_eq!(strips(&[0, 1, 2, 3, -1, 4, 5]), [0, 1, 2, -1, 2, 1, 3, -1]);
        assert_eq!(fans(&[7, 1, 2, 3, -1, -1]), [7, 1, 2, -1, 7, 2, 3, -1]);
        assert_eq!(groups(&[0, 1, 2, 3], 3), [0, 1, 2, -1]);
        assert_eq!(runs(&[2, -1, 9], 4), [0, 1, -1, 2, 3, -1]);
    }
}
