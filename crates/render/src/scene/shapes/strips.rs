//! Draws triangle strip sets, by index and by count.

use glam::Vec3;
use ivcam_inventor::grammar::{indexed_triangle_strip_set, triangle_strip_set};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{Binding, State};

use crate::geometry::BoxCoordinates;
use crate::geometry::normals::{Faces, face_normal, merge_equal, unit};
use crate::scene::canvas::{
    Broken, Canvas, NormalPer, Normals, Runs, ShapeSize, Vertices, check_lists, count, indices,
    is_per_vertex,
};

/// Draws an `IndexedTriangleStripSet`.
pub(super) fn indexed_triangle_strip_set<'a>(
    node: NodeRef<'a>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) {
    let index = node.get(indexed_triangle_strip_set::COORD_INDEX);
    let strips = Runs::by_index(index, state.coordinates, Broken::Kept, out);
    let mut vertices = Vertices {
        normal_binding: state.normal_binding,
        normal_index: indices(node, indexed_triangle_strip_set::NORMAL_INDEX),
        material_binding: state.material_binding,
        material_index: indices(node, indexed_triangle_strip_set::MATERIAL_INDEX),
        texture_index: indices(node, indexed_triangle_strip_set::TEXTURE_COORD_INDEX),
        coord_index: Some(index),
        ..Vertices::unindexed(state)
    };
    finish(&strips, &mut vertices, false, out);
}

/// Draws a `TriangleStripSet`.
pub(super) fn triangle_strip_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let counts = node.get(triangle_strip_set::NUM_VERTICES);
    let start = count(node, triangle_strip_set::START_INDEX);
    let strips = Runs::by_count(counts, start, state.coordinates.len(), out);
    let mut vertices = Vertices::unindexed(state);
    finish(&strips, &mut vertices, true, out);
}

/// Completes the lists and draws the strips. `by_position` is set for shapes without an index.
fn finish<'a>(
    strips: &Runs<'_>,
    vertices: &mut Vertices<'a, '_>,
    by_position: bool,
    out: &mut dyn Canvas,
) {
    let size = ShapeSize {
        faces: strips.triangles(),
        ..strips.size()
    };
    check_lists(vertices, size, out);
    if out.wants().coordinates {
        let used = strips.all().filter_map(|c| vertices.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    if out.wants().normals {
        vertices.normals = normals(strips, vertices, by_position);
    }
    out.triangles(strips, vertices, strips.triangles(), &mut |list| {
        let mut face = 0;
        for (part, strip) in strips.runs.iter().enumerate() {
            // The corners of every second triangle are swapped, so that all face the same side.
            for i in 0..strip.len() - 2 {
                let at = strip.start() + i;
                let (a, b) = if i % 2 == 0 {
                    (at, at + 1)
                } else {
                    (at + 1, at)
                };
                list.add([a, b, at + 2], face, part);
                face += 1;
            }
        }
    });
}

/// Returns the normals of the strips, which are generated if the state has none.
fn normals<'a>(strips: &Runs<'_>, vertices: &Vertices<'a, '_>, by_position: bool) -> Normals<'a> {
    let state = vertices.state;
    let binding = vertices.normal_binding;
    if !state.normals.is_empty() {
        return Normals::Given(state.normals);
    }
    if binding == Binding::Overall && !by_position {
        return Normals::None;
    }
    let point = |c: usize| state.coordinates.get(c).unwrap_or_default();
    let mut all = Faces::default();
    for strip in &strips.runs {
        for i in 0..strip.len() - 2 {
            let ccw = state.hints.counterclockwise() == (i % 2 == 0);
            let corner = |k: usize| point(strips.coordinate(strip.start() + i + k));
            all.normals.push(face_normal(&[0, 1, 2].map(corner), ccw));
        }
    }
    let mut made = vec![Vec3::ZERO; strips.positions()];
    // A corner belongs to the triangle that it completes. The first three belong to the first
    // triangle.
    let mut owners: Vec<(usize, u32, u32)> = Vec::new();
    let mut face = 0u32;
    for (part, strip) in strips.runs.iter().enumerate() {
        for (i, position) in strip.positions().enumerate() {
            owners.push((position, face + i.saturating_sub(2) as u32, part as u32));
        }
        face += strip.len() as u32 - 2;
    }
    match binding {
        Binding::Overall => {
            let mean = unit(all.normals.iter().sum());
            return Normals::Generated(vec![mean], NormalPer::Shape);
        }
        Binding::PerPart | Binding::PerPartIndexed => {
            let mut means = vec![Vec3::ZERO; strips.runs.len()];
            let mut seen = None;
            for &(_, face, part) in &owners {
                if seen != Some(face) {
                    means[part as usize] += all.normals[face as usize];
                    seen = Some(face);
                }
            }
            means.iter_mut().for_each(|mean| *mean = unit(*mean));
            return Normals::Generated(means, NormalPer::Part);
        }
        _ if is_per_vertex(binding) && state.hints.crease_angle > 0.0 => {
            let ids: Vec<u32> = if by_position {
                merge_equal(strips.all().map(point))
            } else {
                strips.all().map(|c| c as u32).collect()
            };
            let mut k = 0;
            let mut face = 0u32;
            for strip in &strips.runs {
                for i in 0..strip.len() - 2 {
                    for j in 0..3 {
                        all.corners.push((ids[k + i + j], face));
                    }
                    face += 1;
                }
                k += strip.len();
            }
            let around = all.around(state.hints.crease_angle);
            for (&(position, face, _), &id) in owners.iter().zip(&ids) {
                made[position] = around.normal(id, face);
            }
        }
        Binding::PerFace | Binding::PerFaceIndexed => {
            return Normals::Generated(all.normals, NormalPer::Face);
        }
        _ => {
            for &(position, face, _) in &owners {
                made[position] = all.normals[face as usize];
            }
        }
    }
    Normals::Generated(made, NormalPer::Position)
}
