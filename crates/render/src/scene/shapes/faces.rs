//! Draws face sets, by index and by count, including concave faces.

use glam::Vec3;
use ivcam_inventor::grammar::{face_set, indexed_face_set};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{Binding, Language, State};
use rayon::prelude::*;

use crate::geometry::normals::{Faces, face_normal, merge_equal, unit};
use crate::geometry::{BoxCoordinates, Corner, cut_polygon};
use crate::scene::canvas::{
    Broken, Canvas, NormalPer, Normals, Runs, VertexPlace, Vertices, check_lists, count,
    faces_are_parts, indices, is_per_vertex, without_index,
};

/// The index fields of an indexed shape.
pub(super) struct Indices<'a> {
    /// The field `coordIndex`.
    pub coord: &'a [i32],
    /// The field `normalIndex`, if it is used.
    pub normal: Option<&'a [i32]>,
    /// The field `materialIndex` or `colorIndex`, if it is used.
    pub material: Option<&'a [i32]>,
    /// The field `textureCoordIndex` or `texCoordIndex`, if it is used.
    pub texture: Option<&'a [i32]>,
}

/// The least number of faces whose normals a thread computes.
const FACES_AT_ONCE: usize = 1 << 12;

/// Draws an `IndexedFaceSet` of Inventor.
pub(super) fn indexed_face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let indices = Indices {
        coord: node.get(indexed_face_set::COORD_INDEX),
        normal: indices(node, indexed_face_set::NORMAL_INDEX),
        material: indices(node, indexed_face_set::MATERIAL_INDEX),
        texture: indices(node, indexed_face_set::TEXTURE_COORD_INDEX),
    };
    indexed_faces(&indices, state, out);
}

/// Draws the faces of an index, for the shapes of Inventor and VRML 97.
pub(super) fn indexed_faces<'a>(indices: &Indices<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let index = indices.coord;
    if index.len() < 3 {
        return;
    }
    let per_vertex_is_indexed = |binding: Binding| match binding {
        // In VRML 1.0 `PER_VERTEX` uses `coordIndex`.
        Binding::PerVertex if state.language == Language::Vrml1 => Binding::PerVertexIndexed,
        other => faces_are_parts(other),
    };
    // A face with a coordinate that does not exist is left out.
    let faces = Runs::by_index(index, state.coordinates, Broken::Empty, out);
    let normal_binding = per_vertex_is_indexed(state.normal_binding);
    let mut vertices = Vertices {
        normal_binding,
        normal_index: indices.normal,
        material_binding: per_vertex_is_indexed(state.material_binding),
        material_index: indices.material,
        texture_index: indices.texture,
        coord_index: Some(index),
        ..Vertices::unindexed(state)
    };
    if out.wants().coordinates {
        let used = faces.all().filter_map(|c| state.coordinates.get(c));
        let boxed = BoxCoordinates::of(used);
        vertices.boxed = Some(match state.language {
            Language::Vrml97 => boxed.with_first_of_equal_sides(),
            _ => boxed,
        });
    }
    if out.wants().normals {
        vertices.normals = normals(&faces, state, normal_binding, false);
    }
    draw(&faces, &vertices, state.hints.convex, out);
}

/// Draws a `FaceSet`.
pub(super) fn face_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let counts = node.get(face_set::NUM_VERTICES);
    let start = count(node, face_set::START_INDEX);
    let faces = Runs::by_count(counts, start, state.coordinates.len(), out);
    let normal_binding = without_index(faces_are_parts(state.normal_binding));
    let mut vertices = Vertices {
        normal_binding,
        material_binding: without_index(faces_are_parts(state.material_binding)),
        ..Vertices::unindexed(state)
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

/// Returns the normals of the faces, which are generated if the state has none. `by_position` is
/// set for shapes without an index.
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
    let (coordinates, counterclockwise) = (state.coordinates, state.hints.counterclockwise());
    let normal = |points: &mut Vec<Vec3>, face| {
        points.clear();
        points.extend(faces.coordinates(face).filter_map(|c| coordinates.get(c)));
        face_normal(points, counterclockwise)
    };
    let runs = faces.runs.par_iter().with_min_len(FACES_AT_ONCE);
    let normals = runs.map_init(Vec::new, normal);
    let mut all = Faces {
        normals: normals.collect(),
        ..Faces::default()
    };
    if binding == Binding::Overall {
        let mean: Vec3 = all.normals.iter().sum();
        return Normals::Generated(vec![unit(mean)], NormalPer::Shape);
    }
    if !is_per_vertex(binding) || state.hints.crease_angle <= 0.0 {
        return Normals::Generated(all.normals, NormalPer::Face);
    }
    all.corners = corners(faces, state, by_position);
    let around = all.around(state.hints.crease_angle);
    let mut made = vec![Vec3::ZERO; faces.positions()];
    let mut corners = all.corners.iter();
    for position in faces.runs.iter().flat_map(|face| face.positions()) {
        if let Some(&(vertex, face)) = corners.next() {
            made[position] = around.normal(vertex, face);
        }
    }
    Normals::Generated(made, NormalPer::Position)
}

/// Returns the vertex and the face of each corner. Without an index equal points are the same
/// vertex.
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

/// Draws the faces, as triangles or as outlines.
fn draw<'a>(faces: &Runs<'_>, vertices: &Vertices<'a, '_>, convex: bool, out: &mut dyn Canvas) {
    check_lists(vertices, faces.size(), out);
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

/// Draws the outlines of the faces.
fn outlines(faces: &Runs<'_>, vertices: &Vertices<'_, '_>, out: &mut dyn Canvas) {
    let mut count = 0;
    let mut corners: Vec<Corner> = Vec::new();
    for (number, face) in faces.runs.iter().enumerate() {
        corners.clear();
        for (i, position) in face.positions().enumerate() {
            corners.extend(vertices.corner(VertexPlace {
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
