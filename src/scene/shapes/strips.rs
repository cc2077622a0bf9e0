//! Triangle strips, by index and by count.

use glam::Vec3;

use super::BoxCoordinates;
use super::faces::runs;
use super::vertices::{Normals, Place, Vertices, indices, is_per_vertex, without_index};
use crate::graph::read::Fields;
use crate::graph::state::{Binding, State};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::scene::builder::Corner;
use crate::scene::normals::{Faces, face_normal, merge_equal, unit};

/// A strip: the position of its first corner, and the coordinates.
struct Strip {
    start: usize,
    coordinates: Vec<usize>,
}

pub fn indexed_triangle_strip_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let index = node.read::<[i32]>("coordIndex").unwrap_or(&[]);
    let mut strips = Vec::new();
    let mut start = 0;
    while start < index.len() {
        let end = index[start..]
            .iter()
            .position(|&i| i < 0)
            .map_or(index.len(), |n| start + n);
        let coordinates: Vec<usize> = index[start..end].iter().map(|&i| i as usize).collect();
        for &c in &coordinates {
            match state.coordinates.get(c) {
                Some(p) => out.bound(p),
                None => out.census_mut().bad_corners += 1,
            }
        }
        if coordinates.len() >= 3 {
            strips.push(Strip { start, coordinates });
        }
        start = end + 1;
    }
    let mut vertices = Vertices {
        state,
        coordinates: state.coordinates,
        normals: Normals::None,
        normal_binding: state.normal_binding,
        normal_index: indices(node, "normalIndex"),
        material_binding: state.material_binding,
        material_index: indices(node, "materialIndex"),
        texture_index: indices(node, "textureCoordIndex"),
        coord_index: Some(index),
        boxed: None,
    };
    finish(&strips, &mut vertices, index.len(), false, out);
}

pub fn triangle_strip_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let counts = node.read::<[i32]>("numVertices").unwrap_or(&[-1]);
    let start = usize::try_from(node.read::<i32>("startIndex").unwrap_or(0)).unwrap_or(0);
    let strips: Vec<Strip> = runs(counts, start, state.coordinates.len())
        .into_iter()
        .filter(|(_, n)| *n >= 3)
        .map(|(first, n)| Strip {
            start: first - start,
            coordinates: (first..first + n).collect(),
        })
        .collect();
    let positions = strips.last().map_or(0, |s| s.start + s.coordinates.len());
    let mut vertices = Vertices {
        state,
        coordinates: state.coordinates,
        normals: Normals::None,
        normal_binding: without_index(state.normal_binding),
        normal_index: None,
        material_binding: without_index(state.material_binding),
        material_index: None,
        texture_index: None,
        coord_index: None,
        boxed: None,
    };
    finish(&strips, &mut vertices, positions, true, out);
}

fn finish<'a>(
    strips: &[Strip],
    vertices: &mut Vertices<'a, '_>,
    positions: usize,
    by_position: bool,
    out: &mut Builder<'a>,
) {
    if out.wants_coordinates() {
        let used = strips.iter().flat_map(|s| &s.coordinates);
        vertices.boxed = Some(BoxCoordinates::of(
            used.filter_map(|&c| vertices.coordinates.get(c)),
        ));
    }
    if out.wants_normals() {
        vertices.normals = normals(strips, vertices, positions, by_position);
    }
    let (mut count, mut face) = (0, 0);
    let mut corners: Vec<Option<Corner>> = Vec::new();
    for (part, strip) in strips.iter().enumerate() {
        corners.clear();
        for (i, &coordinate) in strip.coordinates.iter().enumerate() {
            corners.push(vertices.corner(Place {
                coordinate,
                position: strip.start + i,
                count: count + i,
                face: face + i.saturating_sub(2),
                part,
            }));
        }
        draw(&corners, vertices, out);
        count += strip.coordinates.len();
        face += strip.coordinates.len() - 2;
    }
}

/// Every other triangle is turned over, by keeping one corner back, so that all face alike.
fn draw(corners: &[Option<Corner>], vertices: &Vertices<'_, '_>, out: &mut Builder<'_>) {
    let by_face = |b: Binding| matches!(b, Binding::PerFace | Binding::PerFaceIndexed);
    for i in 2..corners.len() {
        let (Some(a), Some(b), Some(last)) = (corners[i - 2], corners[i - 1], corners[i]) else {
            continue;
        };
        let (mut a, mut b) = if i % 2 == 0 { (a, b) } else { (b, a) };
        if by_face(vertices.material_binding) {
            (a.material, b.material) = (last.material, last.material);
        }
        if by_face(vertices.normal_binding) {
            (a.normal, b.normal) = (last.normal, last.normal);
        }
        out.triangle([a, b, last]);
    }
}

fn normals<'a>(
    strips: &[Strip],
    vertices: &Vertices<'a, '_>,
    positions: usize,
    by_position: bool,
) -> Normals<'a> {
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
    for strip in strips {
        for (i, t) in strip.coordinates.windows(3).enumerate() {
            let even = i % 2 == 0;
            let ccw = state.hints.counterclockwise() == even;
            all.normals
                .push(face_normal(&[point(t[0]), point(t[1]), point(t[2])], ccw));
        }
    }
    let mut made = vec![Vec3::ZERO; positions];
    // A corner belongs to the triangle that it completes; the first three to the first.
    let mut owners: Vec<(usize, u32, u32)> = Vec::new();
    let mut face = 0u32;
    for (part, strip) in strips.iter().enumerate() {
        for i in 0..strip.coordinates.len() {
            owners.push((
                strip.start + i,
                face + i.saturating_sub(2) as u32,
                part as u32,
            ));
        }
        face += strip.coordinates.len() as u32 - 2;
    }
    match binding {
        Binding::Overall => {
            let mean = unit(all.normals.iter().sum());
            made.fill(mean);
        }
        Binding::PerPart | Binding::PerPartIndexed => {
            let mut means = vec![Vec3::ZERO; strips.len()];
            let mut seen = None;
            for &(_, face, part) in &owners {
                if seen != Some(face) {
                    means[part as usize] += all.normals[face as usize];
                    seen = Some(face);
                }
            }
            for &(position, _, part) in &owners {
                made[position] = unit(means[part as usize]);
            }
        }
        _ if is_per_vertex(binding) && state.hints.crease_angle > 0.0 => {
            let coordinates: Vec<usize> =
                strips.iter().flat_map(|s| s.coordinates.clone()).collect();
            let ids: Vec<u32> = if by_position {
                merge_equal(coordinates.iter().map(|&c| point(c)))
            } else {
                coordinates.iter().map(|&c| c as u32).collect()
            };
            let mut k = 0;
            let mut face = 0u32;
            for strip in strips {
                for i in 0..strip.coordinates.len() - 2 {
                    for j in 0..3 {
                        all.corners.push((ids[k + i + j], face));
                    }
                    face += 1;
                }
                k += strip.coordinates.len();
            }
            let asked: Vec<(u32, u32)> =
                owners.iter().zip(&ids).map(|(o, &id)| (id, o.1)).collect();
            let smoothed = all.smooth(&asked, state.hints.crease_angle);
            for (o, n) in owners.iter().zip(smoothed) {
                made[o.0] = n;
            }
        }
        _ => {
            for &(position, face, _) in &owners {
                made[position] = all.normals[face as usize];
            }
        }
    }
    Normals::Made(made)
}
