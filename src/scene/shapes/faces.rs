//! Face sets: polygons by index or by count, concave ones included.

use glam::Vec3;

use crate::geometry::normals::{Faces, face_normal, merge_equal, unit};
use crate::geometry::{BoxCoordinates, Corner, cut_polygon};
use crate::grammar::{face_set, indexed_face_set};
use crate::iv::NodeRef;
use crate::scene::canvas::{
    Broken, By, Canvas, Normals, Place, Runs, Vertices, count, faces_are_parts, indices,
    is_per_vertex, without_index,
};
use crate::traversal::state::{Binding, Language, State};

/// The index fields of an indexed shape.
pub(super) struct Indices<'a> {
    pub coord: &'a [i32],
    pub normal: Option<&'a [i32]>,
    pub material: Option<&'a [i32]>,
    pub texture: Option<&'a [i32]>,
}

pub(super) fn indexed_face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let indices = Indices {
        coord: node.get(indexed_face_set::COORD_INDEX),
        normal: indices(node, indexed_face_set::NORMAL_INDEX),
        material: indices(node, indexed_face_set::MATERIAL_INDEX),
        texture: indices(node, indexed_face_set::TEXTURE_COORD_INDEX),
    };
    indexed_faces(&indices, state, out);
}

/// Faces by index, of Inventor's shape and of VRML 97's.
pub(super) fn indexed_faces<'a>(indices: &Indices<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let index = indices.coord;
    if index.len() < 3 {
        return;
    }
    let per_vertex_is_indexed = |binding: Binding| match binding {
        // VRML 1.0's PER_VERTEX goes by coordIndex.
        Binding::PerVertex if state.language == Language::Vrml1 => Binding::PerVertexIndexed,
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
    if out.wants().coordinates {
        let used = faces.all().filter_map(|c| state.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    if out.wants().normals {
        vertices.normals = normals(&faces, state, normal_binding, false);
    }
    draw(&faces, &vertices, state.hints.convex, out);
}

pub(super) fn face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let counts = node.get(face_set::NUM_VERTICES);
    let start = count(node, face_set::START_INDEX);
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
    if out.wants().coordinates {
        let used = faces.all().filter_map(|c| state.coordinates.get(c));
        vertices.boxed = Some(BoxCoordinates::of(used));
    }
    if out.wants().normals {
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
    if binding == Binding::Overall {
        let mean: Vec3 = all.normals.iter().sum();
        return Normals::Made(vec![unit(mean)], By::All);
    }
    if !is_per_vertex(binding) || state.hints.crease_angle <= 0.0 {
        return Normals::Made(all.normals, By::Face);
    }
    all.corners = corners(faces, state, by_position);
    let around = all.around(state.hints.crease_angle);
    let mut made = vec![Vec3::ZERO; faces.positions()];
    let mut corners = all.corners.iter();
    for position in faces.runs.iter().flat_map(|face| face.0.clone()) {
        if let Some(&(vertex, face)) = corners.next() {
            made[position] = around.normal(vertex, face);
        }
    }
    Normals::Made(made, By::Position)
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

fn draw<'a>(faces: &Runs<'_>, vertices: &Vertices<'a, '_>, convex: bool, out: &mut dyn Canvas) {
    if out.wants().outlines {
        return outlines(faces, vertices, out);
    }
    out.triangles(faces, vertices, faces.triangles(), &mut |list| {
        for (number, face) in faces.runs.iter().enumerate() {
            let first = face.start();
            let point = |corner: usize| {
                let point = vertices.coordinates.get(faces.coordinate(first + corner));
                point.unwrap_or_default()
            };
            cut_polygon(face.len(), point, convex, |triangle| {
                list.add(triangle.map(|corner| first + corner), number, number);
            });
        }
    });
}

fn outlines(faces: &Runs<'_>, vertices: &Vertices<'_, '_>, out: &mut dyn Canvas) {
    let mut count = 0;
    let mut corners: Vec<Corner> = Vec::new();
    for (number, face) in faces.runs.iter().enumerate() {
        corners.clear();
        for (i, position) in face.0.clone().enumerate() {
            corners.extend(vertices.corner(Place {
                coordinate: faces.coordinate(position),
                position,
                count: count + i,
                face: number,
                part: number,
            }));
        }
        count += face.len();
        out.outline(&corners);
    }
}
