//! Face sets: polygons by index or by count, concave ones included.

use glam::Vec3;

use super::BoxCoordinates;
use super::vertices::{
    Normals, Place, Vertices, faces_are_parts, indices, is_per_vertex, without_index,
};
use crate::graph::read::Fields;
use crate::graph::state::{Binding, Coordinates, State};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::scene::builder::Corner;
use crate::scene::normals::{Faces, face_normal, merge_equal};
use crate::scene::tessellate::tessellate;

/// Corners of one face: range of positions, and where each points.
struct Face {
    start: usize,
    coordinates: Vec<usize>,
}

/// The index fields of an indexed shape.
pub struct Indices<'a> {
    pub coord: &'a [i32],
    pub normal: Option<&'a [i32]>,
    pub material: Option<&'a [i32]>,
    pub texture: Option<&'a [i32]>,
}

pub fn indexed_face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let indices = Indices {
        coord: node.read::<[i32]>("coordIndex").unwrap_or(&[]),
        normal: indices(node, "normalIndex"),
        material: indices(node, "materialIndex"),
        texture: indices(node, "textureCoordIndex"),
    };
    indexed_faces(&indices, state, out);
}

/// Faces by index, of Inventor's shape and of VRML 97's.
pub fn indexed_faces<'a>(indices: &Indices<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let index = indices.coord;
    if index.len() < 3 {
        return;
    }
    let per_vertex_is_indexed = |binding: Binding| match binding {
        // VRML 1.0's PER_VERTEX goes by coordIndex.
        Binding::PerVertex if state.vrml1 => Binding::PerVertexIndexed,
        other => faces_are_parts(other),
    };
    let faces = split(index, state.coordinates, out);
    let normal_binding = per_vertex_is_indexed(state.normal_binding);
    let mut vertices = Vertices {
        state,
        coordinates: state.coordinates,
        normals: Normals::None,
        normal_binding,
        normal_index: indices.normal,
        material_binding: per_vertex_is_indexed(state.material_binding),
        material_index: indices.material,
        texture_index: indices.texture,
        coord_index: Some(index),
        boxed: None,
    };
    if out.wants_coordinates() {
        let used = faces.iter().flat_map(|f| &f.coordinates);
        vertices.boxed = Some(BoxCoordinates::of(
            used.filter_map(|&c| state.coordinates.get(c)),
        ));
    }
    if out.wants_normals() {
        vertices.normals = normals(&faces, index.len(), state, normal_binding, false);
    }
    draw(&faces, &vertices, state.hints.convex, out);
}

pub fn face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let counts = node.read::<[i32]>("numVertices").unwrap_or(&[-1]);
    let start = usize::try_from(node.read::<i32>("startIndex").unwrap_or(0)).unwrap_or(0);
    let faces: Vec<Face> = runs(counts, start, state.coordinates.len())
        .into_iter()
        .filter(|(_, n)| *n >= 3)
        .map(|(first, n)| Face {
            start: first - start,
            coordinates: (first..first + n).collect(),
        })
        .collect();
    let normal_binding = without_index(faces_are_parts(state.normal_binding));
    let mut vertices = Vertices {
        state,
        coordinates: state.coordinates,
        normals: Normals::None,
        normal_binding,
        normal_index: None,
        material_binding: without_index(faces_are_parts(state.material_binding)),
        material_index: None,
        texture_index: None,
        coord_index: None,
        boxed: None,
    };
    if out.wants_coordinates() {
        let used = faces.iter().flat_map(|f| &f.coordinates);
        vertices.boxed = Some(BoxCoordinates::of(
            used.filter_map(|&c| state.coordinates.get(c)),
        ));
    }
    if out.wants_normals() {
        let positions = faces.last().map_or(0, |f| f.start + f.coordinates.len());
        vertices.normals = normals(&faces, positions, state, normal_binding, true);
    }
    draw(&faces, &vertices, state.hints.convex, out);
}

/// First coordinate and number of each run; −1 takes all that are left. Runs past the end are
/// cut off.
pub fn runs(counts: &[i32], start: usize, available: usize) -> Vec<(usize, usize)> {
    let mut at = start;
    let mut out = Vec::new();
    for &count in counts {
        let left = available.saturating_sub(at);
        let n = usize::try_from(count).unwrap_or(left);
        if n > left {
            break;
        }
        out.push((at, n));
        at += n;
    }
    out
}

/// Faces of a `coordIndex`: at −1 one ends. A face with fewer than three corners or a coordinate
/// that does not exist is left out; Coin gives up on the rest of the shape there.
fn split(index: &[i32], coordinates: Coordinates<'_>, out: &mut Builder<'_>) -> Vec<Face> {
    let mut faces = Vec::new();
    let mut start = 0;
    while start < index.len() {
        let end = index[start..]
            .iter()
            .position(|&i| i < 0)
            .map_or(index.len(), |n| start + n);
        let corners: Vec<usize> = index[start..end].iter().map(|&i| i as usize).collect();
        let bad = corners.iter().filter(|&&c| c >= coordinates.len()).count();
        out.census_mut().bad_corners += bad as u64;
        for &c in &corners {
            if let Some(p) = coordinates.get(c) {
                out.bound(p);
            }
        }
        if corners.len() >= 3 {
            faces.push(Face {
                start,
                coordinates: if bad == 0 { corners } else { Vec::new() },
            });
        }
        start = end + 1;
    }
    faces
}

fn normals<'a>(
    faces: &[Face],
    positions: usize,
    state: &State<'a>,
    binding: Binding,
    by_position: bool,
) -> Normals<'a> {
    if !state.normals.is_empty() {
        return Normals::Given(state.normals);
    }
    if binding == Binding::Overall && !by_position {
        return Normals::None;
    }
    let points = |face: &Face| -> Vec<Vec3> {
        face.coordinates
            .iter()
            .filter_map(|&c| state.coordinates.get(c))
            .collect()
    };
    let mut all = Faces {
        normals: faces
            .iter()
            .map(|f| face_normal(&points(f), state.hints.counterclockwise()))
            .collect(),
        ..Faces::default()
    };
    let mut made = vec![Vec3::ZERO; positions];
    if binding == Binding::Overall {
        let mean: Vec3 = all.normals.iter().sum();
        made.fill(crate::scene::normals::unit(mean));
        return Normals::Made(made);
    }
    let smooth = is_per_vertex(binding) && state.hints.crease_angle > 0.0;
    if smooth {
        let mut asked: Vec<(u32, u32)> = Vec::new();
        for (f, face) in faces.iter().enumerate() {
            asked.extend(face.coordinates.iter().map(|&c| (c as u32, f as u32)));
        }
        if by_position {
            let points = asked
                .iter()
                .map(|a| state.coordinates.get(a.0 as usize).unwrap_or_default());
            let merged = merge_equal(points);
            for (a, m) in asked.iter_mut().zip(merged) {
                a.0 = m;
            }
        }
        all.corners = asked.clone();
        let smoothed = all.smooth(&asked, state.hints.crease_angle);
        let mut k = 0;
        for face in faces {
            for i in 0..face.coordinates.len() {
                made[face.start + i] = smoothed[k];
                k += 1;
            }
        }
    } else {
        for (f, face) in faces.iter().enumerate() {
            let n = face.coordinates.len();
            made[face.start..face.start + n].fill(all.normals[f]);
        }
    }
    Normals::Made(made)
}

fn draw(faces: &[Face], vertices: &Vertices<'_, '_>, convex: bool, out: &mut Builder<'_>) {
    let mut count = 0;
    let mut corners: Vec<Corner> = Vec::new();
    for (number, face) in faces.iter().enumerate() {
        corners.clear();
        for (i, &coordinate) in face.coordinates.iter().enumerate() {
            corners.extend(vertices.corner(Place {
                coordinate,
                position: face.start + i,
                count: count + i,
                face: number,
                part: number,
            }));
        }
        count += face.coordinates.len();
        polygon(&corners, convex, out);
    }
}

/// Cuts a polygon as Coin does: a triangle is one, a quadrilateral goes along its first diagonal
/// (along the other where only that lies inside), a convex one is a fan, others are tessellated.
pub fn polygon(corners: &[Corner], convex: bool, out: &mut Builder<'_>) {
    if out.outlines() {
        out.outline(corners);
        return;
    }
    match corners {
        [] | [_] | [_, _] => {}
        [a, b, c] => out.triangle([*a, *b, *c]),
        [a, b, c, d] => {
            if !convex && is_cut_outside(corners) {
                out.triangle([*b, *c, *d]);
                out.triangle([*b, *d, *a]);
            } else {
                out.triangle([*a, *b, *c]);
                out.triangle([*a, *c, *d]);
            }
        }
        _ if convex => {
            for pair in corners[1..].windows(2) {
                out.triangle([corners[0], pair[0], pair[1]]);
            }
        }
        _ => {
            let points: Vec<Vec3> = corners.iter().map(|c| c.position).collect();
            for [a, b, c] in tessellate(&points) {
                out.triangle([corners[a], corners[b], corners[c]]);
            }
        }
    }
}

/// Whether the first diagonal of a quadrilateral leaves it: its two triangles face apart.
fn is_cut_outside(q: &[Corner]) -> bool {
    let p = |i: usize| q[i].position.as_dvec3();
    let first = (p(1) - p(0)).cross(p(2) - p(0));
    let second = (p(2) - p(0)).cross(p(3) - p(0));
    first.dot(second) < 0.0
}
