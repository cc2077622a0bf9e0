//! NURBS shapes: control points and profiles from the state, cut by `scene::nurbs`.

use glam::{DVec2, DVec3, DVec4, Vec3};

use crate::grammar::value::Choice;
use crate::graph::State;
use crate::graph::read::Fields;
use crate::graph::state::{Coordinates, ProfileCoordinates, TextureCoordinates};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::scene::builder::Corner;
use crate::scene::nurbs::{Curve, Surface, trim_curve};

pub fn nurbs_surface<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let points: Vec<DVec4> = (0..state.coordinates.len())
        .filter_map(|i| control_point(state, i))
        .collect();
    surface(node, state, points, None, out);
}

pub fn indexed_nurbs_surface<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let index = node.read::<[i32]>("coordIndex").unwrap_or(&[]);
    let texture = node
        .read::<[i32]>("textureCoordIndex")
        .filter(|i| i.first().is_some_and(|&f| f >= 0));
    surface(node, state, picked(state, index), texture, out);
}

pub fn nurbs_curve<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let points: Vec<DVec4> = (0..state.coordinates.len())
        .filter_map(|i| control_point(state, i))
        .collect();
    curve(node, state, points, out);
}

pub fn indexed_nurbs_curve<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let index = node.read::<[i32]>("coordIndex").unwrap_or(&[]);
    curve(node, state, picked(state, index), out);
}

fn picked(state: &State<'_>, index: &[i32]) -> Vec<DVec4> {
    index
        .iter()
        .filter_map(|&i| control_point(state, usize::try_from(i).ok()?))
        .collect()
}

fn control_point(state: &State<'_>, index: usize) -> Option<DVec4> {
    match state.coordinates {
        Coordinates::Three(p) => p.get(index).map(|p| p.as_dvec3().extend(1.0)),
        Coordinates::Four(p) => p.get(index).map(|p| p.as_dvec4()),
    }
}

fn size(node: NodeRef<'_>, name: &str) -> usize {
    usize::try_from(node.read::<i32>(name).unwrap_or(0)).unwrap_or(0)
}

fn surface<'a>(
    node: NodeRef<'a>,
    state: &State<'a>,
    points: Vec<DVec4>,
    texture_index: Option<&[i32]>,
    out: &mut Builder<'a>,
) {
    for p in &points {
        out.bound((p.truncate() / if p.w == 0.0 { 1.0 } else { p.w }).as_vec3());
    }
    let knots = |name: &str| node.read::<[f32]>(name).unwrap_or(&[]);
    let made = Surface::new(
        size(node, "numUControlPoints"),
        size(node, "numVControlPoints"),
        knots("uKnotVector"),
        knots("vKnotVector"),
        points,
    )
    .and_then(|s| {
        let trims = trims(state, out, node);
        let texture = texture_surface(node, state, texture_index);
        s.tessellate(state.complexity.value, &trims, texture.as_ref())
    });
    match made {
        Ok(mesh) => {
            out.without_counting(|out| out.mesh(&mesh, false));
        }
        Err(why) => out.complain(node, &why),
    }
}

/// The surface that texture coordinates run over, where the file gives one.
fn texture_surface(node: NodeRef<'_>, state: &State<'_>, index: Option<&[i32]>) -> Option<Surface> {
    let knots = |name: &str| node.read::<[f32]>(name).unwrap_or(&[]);
    let (s, t) = (
        size(node, "numSControlPoints"),
        size(node, "numTControlPoints"),
    );
    if s == 0 || t == 0 {
        return None;
    }
    let TextureCoordinates::Two(list) = state.texture_coordinates else {
        return None;
    };
    let at = |i: usize| {
        list.get(i)
            .map(|c| DVec4::new(f64::from(c.x), f64::from(c.y), 0.0, 1.0))
    };
    let points: Vec<DVec4> = match index {
        Some(index) => index
            .iter()
            .filter_map(|&i| at(usize::try_from(i).ok()?))
            .collect(),
        None => (0..list.len()).filter_map(at).collect(),
    };
    Surface::new(s, t, knots("sKnotVector"), knots("tKnotVector"), points).ok()
}

/// Trimming loops: profiles linked to one another make one loop.
fn trims<'a>(state: &State<'a>, out: &mut Builder<'a>, shape: NodeRef<'a>) -> Vec<Vec<DVec2>> {
    let mut loops: Vec<Vec<DVec2>> = Vec::new();
    for profile in state.profiles.iter() {
        let node = profile.node;
        let point = |i: i32| {
            let i = usize::try_from(i).ok()?;
            match profile.coordinates {
                ProfileCoordinates::Two(p) => p.get(i).map(|p| p.as_dvec2().extend(1.0)),
                ProfileCoordinates::Three(p) => p.get(i).map(|p| p.as_dvec3()),
            }
        };
        let index = node.read::<[i32]>("index").unwrap_or(&[]);
        let points: Vec<DVec3> = index.iter().filter_map(|&i| point(i)).collect();
        let line = match node.read::<[f32]>("knotVector") {
            Some(knots) => match trim_curve(&points, knots, state.complexity.value) {
                Ok(line) => line,
                Err(why) => {
                    out.complain(shape, &format!("its trimming: {why}"));
                    continue;
                }
            },
            None => points.iter().map(|p| p.truncate() / p.z).collect(),
        };
        let adds = node.read::<Choice>("linkage") == Some(2);
        match loops.last_mut() {
            Some(last) if adds => last.extend(line),
            _ => loops.push(line),
        }
    }
    loops
}

fn curve<'a>(node: NodeRef<'a>, state: &State<'a>, points: Vec<DVec4>, out: &mut Builder<'a>) {
    out.set_unlit();
    for p in &points {
        out.bound((p.truncate() / if p.w == 0.0 { 1.0 } else { p.w }).as_vec3());
    }
    let count = size(node, "numControlPoints").min(points.len());
    let knots = node.read::<[f32]>("knotVector").unwrap_or(&[]);
    let made = Curve::new(points[..count].to_vec(), knots)
        .and_then(|c| c.polyline(state.complexity.value));
    match made {
        Ok(line) => {
            let corner = |p: &DVec3| Corner {
                position: p.as_vec3(),
                normal: Vec3::Z,
                material: 0,
                coordinates: glam::Vec2::ZERO,
            };
            for pair in line.windows(2) {
                out.line(
                    [corner(&pair[0]), corner(&pair[1])],
                    state.drawing.line_width,
                );
            }
        }
        Err(why) => out.complain(node, &why),
    }
}
