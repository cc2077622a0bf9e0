//! Face sets: polygons by index or by count, concave ones included.

use glam::Vec3;

use super::BoxCoordinates;
use super::runs::{Broken, Runs};
use super::vertices::{
    Normals, Place, Vertices, faces_are_parts, indices, is_per_vertex, without_index,
};
use crate::graph::read::Fields;
use crate::graph::state::{Binding, State};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::scene::builder::{Corner, Placed};
use crate::scene::normals::{Faces, face_normal, merge_equal};
use crate::scene::tessellate::tessellate;

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
    // A face with a coordinate that does not exist is left out.
    let faces = Runs::by_index(index, state.coordinates, Broken::Empty, out);
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
        let used = faces.all().filter_map(|c| state.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    if out.wants_normals() {
        vertices.normals = normals(&faces, state, normal_binding, false);
    }
    draw(&faces, &vertices, state.hints.convex, out);
}

pub fn face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let counts = node.read::<[i32]>("numVertices").unwrap_or(&[-1]);
    let start = usize::try_from(node.read::<i32>("startIndex").unwrap_or(0)).unwrap_or(0);
    let faces = Runs::by_count(counts, start, state.coordinates.len());
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
        let used = faces.all().filter_map(|c| state.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    if out.wants_normals() {
        vertices.normals = normals(&faces, state, normal_binding, true);
    }
    draw(&faces, &vertices, state.hints.convex, out);
}

fn normals<'a>(
    faces: &Runs<'_>,
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
    let mut points: Vec<Vec3> = Vec::new();
    let normals = faces.runs.iter().map(|face| {
        points.clear();
        let coordinates = faces.coordinates(face);
        points.extend(coordinates.filter_map(|c| state.coordinates.get(c)));
        face_normal(&points, state.hints.counterclockwise())
    });
    let mut all = Faces {
        normals: normals.collect(),
        ..Faces::default()
    };
    let mut made = vec![Vec3::ZERO; faces.positions()];
    if binding == Binding::Overall {
        let mean: Vec3 = all.normals.iter().sum();
        made.fill(crate::scene::normals::unit(mean));
        return Normals::Made(made);
    }
    let smooth = is_per_vertex(binding) && state.hints.crease_angle > 0.0;
    if smooth {
        all.corners = corners(faces, state, by_position);
        let mut smoothed = all.smooth_corners(state.hints.crease_angle).into_iter();
        for face in &faces.runs {
            made[face.0.clone()].fill_with(|| smoothed.next().unwrap_or_default());
        }
    } else {
        for (normal, face) in all.normals.iter().zip(&faces.runs) {
            made[face.0.clone()].fill(*normal);
        }
    }
    Normals::Made(made)
}

/// Vertex and face of each corner; without an index equal points are one vertex.
fn corners(faces: &Runs<'_>, state: &State<'_>, by_position: bool) -> Vec<(u32, u32)> {
    let numbered = faces.runs.iter().zip(0..);
    let mut corners: Vec<(u32, u32)> = numbered
        .flat_map(|(face, f)| faces.coordinates(face).map(move |c| (c as u32, f)))
        .collect();
    if by_position {
        let point = |c: &(u32, u32)| state.coordinates.get(c.0 as usize).unwrap_or_default();
        let merged = merge_equal(corners.iter().map(point));
        for (corner, vertex) in corners.iter_mut().zip(merged) {
            corner.0 = vertex;
        }
    }
    corners
}

fn draw(faces: &Runs<'_>, vertices: &Vertices<'_, '_>, convex: bool, out: &mut Builder<'_>) {
    let mut count = 0;
    let mut corners: Vec<Placed> = Vec::new();
    out.expect(faces.triangles());
    for (number, face) in faces.runs.iter().enumerate() {
        corners.clear();
        for (i, position) in face.0.clone().enumerate() {
            let corner = vertices.corner(Place {
                coordinate: faces.coordinate(position),
                position,
                count: count + i,
                face: number,
                part: number,
            });
            corners.extend(corner.map(|c| out.place_beside(c, corners.last())));
        }
        count += face.len();
        polygon(&corners, convex, out);
    }
}

/// Cuts a polygon as Coin does: a triangle is one, a quadrilateral goes along its first diagonal
/// (along the other where only that lies inside), a convex one is a fan, others are tessellated.
fn polygon(corners: &[Placed], convex: bool, out: &mut Builder<'_>) {
    if out.outlines() {
        let corners: Vec<Corner> = corners.iter().map(|c| c.corner).collect();
        out.outline(&corners);
        return;
    }
    match corners {
        [] | [_] | [_, _] => {}
        [a, b, c] => out.triangle_of([a, b, c]),
        [a, b, c, d] => {
            if !convex && is_cut_outside(corners) {
                out.triangle_of([b, c, d]);
                out.triangle_of([b, d, a]);
            } else {
                out.triangle_of([a, b, c]);
                out.triangle_of([a, c, d]);
            }
        }
        _ if convex => {
            for pair in corners[1..].windows(2) {
                out.triangle_of([&corners[0], &pair[0], &pair[1]]);
            }
        }
        _ => {
            let points: Vec<Vec3> = corners.iter().map(|c| c.corner.position).collect();
            for [a, b, c] in tessellate(&points) {
                out.triangle_of([&corners[a], &corners[b], &corners[c]]);
            }
        }
    }
}

/// Whether the first diagonal of a quadrilateral leaves it: its two triangles face apart.
fn is_cut_outside(q: &[Placed]) -> bool {
    let p = |i: usize| q[i].corner.position.as_dvec3();
    let first = (p(1) - p(0)).cross(p(2) - p(0));
    let second = (p(2) - p(0)).cross(p(3) - p(0));
    first.dot(second) < 0.0
}
