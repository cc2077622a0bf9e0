//! VRML 97's geometry: coordinates, colors and normals are nodes in the shape's own fields.
//!
//! They are put into the state, so that Inventor's functions draw them.

use glam::{DVec2, Vec2, Vec3};

use super::faces::{Indices, indexed_faces};
use super::{lines, nurbs, solids, text, vertices};
use crate::geometry::{self, ElevationGrid, Extrusion};
use crate::grammar::value::Rotation;
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::traversal::state::{
    Binding, Coordinates, Diffuse, List, ShapeHints, State, TextureCoordinates, VertexOrdering,
};

/// Puts what the shape itself holds into the state.
pub fn prepare<'a>(class: &str, state: &mut State<'a>, node: NodeRef<'a>) {
    let flag = |name: &str, default: bool| node.read::<bool>(name).unwrap_or(default);
    let counterclockwise = flag("ccw", true);
    state.vrml1 = false;
    state.hints = ShapeHints {
        ordering: if counterclockwise {
            VertexOrdering::Counterclockwise
        } else {
            VertexOrdering::Clockwise
        },
        solid: flag("solid", true),
        convex: flag("convex", true),
        crease_angle: node.read::<f32>("creaseAngle").unwrap_or(0.0),
    };
    let points = node
        .node_in("coord")
        .and_then(|c| c.read::<[Vec3]>("point"));
    state.coordinates = Coordinates::Three(points.unwrap_or(&[]));
    let by = |per_vertex: bool, indexed: bool| match (per_vertex, indexed) {
        (true, _) => Binding::PerVertexIndexed,
        (false, true) => Binding::PerFaceIndexed,
        (false, false) => Binding::PerFace,
    };
    state.normals = node
        .node_in("normal")
        .and_then(|n| n.read::<[Vec3]>("vector"))
        .unwrap_or(&[]);
    let indexed = vertices::indices(node, "normalIndex").is_some();
    state.normal_binding = by(flag("normalPerVertex", true), indexed);
    state.material_binding = Binding::Overall;
    let colors = node
        .node_in("color")
        .and_then(|c| c.read::<[Vec3]>("color"))
        .filter(|c| !c.is_empty());
    let is_line = matches!(class, "IndexedLineSet" | "PointSet" | "NurbsCurve");
    if let Some(colors) = colors {
        state.material.diffuse = Diffuse::Colors(List::Many(colors));
        let indexed = vertices::indices(node, "colorIndex").is_some();
        state.material_binding = match class {
            "PointSet" => Binding::PerVertex,
            _ => by(flag("colorPerVertex", true), indexed),
        };
    } else if is_line && !state.base_color {
        // Lines are not lit: they have the emissive color (6.24).
        state.material.diffuse = Diffuse::Colors(List::One(state.material.emissive));
    }
    if is_line {
        state.base_color = true;
        state.texture = None;
    }
    let coordinates = node
        .node_in("texCoord")
        .and_then(|t| t.read::<[Vec2]>("point"))
        .filter(|t| !t.is_empty());
    state.texture_coordinates = match coordinates {
        Some(list) => TextureCoordinates::Two(list),
        None => TextureCoordinates::Default,
    };
    state.texture_indexed = true;
}

/// Draws a geometry node; `false` if its class has no picture here.
pub fn draw<'a>(class: &str, node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) -> bool {
    let as_coin = out.as_coin();
    let number = |name: &str, default: f32| {
        let value = node.read::<f32>(name).filter(|v| v.is_finite());
        let value = f64::from(value.unwrap_or(default));
        if as_coin { value } else { value.abs() }
    };
    let flag = |name: &str| node.read::<bool>(name).unwrap_or(true);
    match class {
        "Box" => {
            let size = node.read::<Vec3>("size").unwrap_or(Vec3::splat(2.0));
            let size = if as_coin { size } else { size.abs() };
            solids::block(0.5 * size, false, out);
        }
        "Sphere" => solids::sphere(node, out),
        "Cone" => solids::cone_of(
            number("bottomRadius", 1.0),
            0.5 * number("height", 2.0),
            [flag("side"), flag("bottom")],
            [0; 2],
            out,
        ),
        "Cylinder" => solids::cylinder_of(
            number("radius", 1.0),
            0.5 * number("height", 2.0),
            [flag("side"), flag("top"), flag("bottom")],
            [0; 3],
            out,
        ),
        "IndexedFaceSet" => {
            let indices = Indices {
                coord: node.read::<[i32]>("coordIndex").unwrap_or(&[]),
                normal: vertices::indices(node, "normalIndex"),
                material: vertices::indices(node, "colorIndex"),
                texture: vertices::indices(node, "texCoordIndex"),
            };
            indexed_faces(&indices, state, out);
        }
        "IndexedLineSet" => lines::indexed_lines(
            node.read::<[i32]>("coordIndex").unwrap_or(&[]),
            [vertices::indices(node, "colorIndex"), None],
            state,
            out,
        ),
        "PointSet" => lines::point_set(node, state, out),
        "Extrusion" => extrusion(node, out),
        "ElevationGrid" => elevation_grid(node, state, out),
        "Text" => text::text97(node, state, out),
        "NurbsCurve" => nurbs::curve97(node, state, out),
        "NurbsSurface" => nurbs_surface(node, &[], state, out),
        "TrimmedSurface" => {
            let trims = nurbs::contours97(node, state);
            if let Some(surface) = node.node_in("surface") {
                nurbs_surface(surface, &trims, state, out);
            }
        }
        _ => return false,
    }
    true
}

fn nurbs_surface<'a>(
    node: NodeRef<'a>,
    trims: &[Vec<DVec2>],
    state: &State<'a>,
    out: &mut Builder<'a>,
) {
    let flag = |name: &str| node.read::<bool>(name).unwrap_or(true);
    out.set_sides(flag("ccw"), !flag("solid"), flag("solid"));
    nurbs::surface97(node, trims, state, out);
}

fn extrusion<'a>(node: NodeRef<'a>, out: &mut Builder<'a>) {
    let flag = |name: &str| node.read::<bool>(name).unwrap_or(true);
    let orientation: Vec<glam::Quat> = node
        .read::<[Rotation]>("orientation")
        .unwrap_or(&[])
        .iter()
        .map(|r| r.to_quat())
        .collect();
    let made = geometry::extrusion(&Extrusion {
        cross_section: node.read::<[Vec2]>("crossSection").unwrap_or(&[]),
        spine: node.read::<[Vec3]>("spine").unwrap_or(&[]),
        scale: node.read::<[Vec2]>("scale").unwrap_or(&[]),
        orientation: &orientation,
        begin_cap: flag("beginCap"),
        end_cap: flag("endCap"),
        ccw: flag("ccw"),
        convex: flag("convex"),
        crease_angle: node.read::<f32>("creaseAngle").unwrap_or(0.0),
    });
    match made {
        Ok(mesh) => {
            out.set_sides(true, !flag("solid"), flag("solid"));
            out.mesh(&mesh, false);
        }
        Err(why) => out.complain(node, &why),
    }
}

fn elevation_grid<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let flag = |name: &str| node.read::<bool>(name).unwrap_or(true);
    let texcoords = match state.texture_coordinates {
        TextureCoordinates::Two(list) => list,
        _ => &[],
    };
    let has_colors = state.material_binding != Binding::Overall;
    let made = geometry::elevation_grid(&ElevationGrid {
        x_dimension: node.read::<i32>("xDimension").unwrap_or(0),
        z_dimension: node.read::<i32>("zDimension").unwrap_or(0),
        x_spacing: node.read::<f32>("xSpacing").unwrap_or(1.0),
        z_spacing: node.read::<f32>("zSpacing").unwrap_or(1.0),
        height: node.read::<[f32]>("height").unwrap_or(&[]),
        ccw: flag("ccw"),
        crease_angle: node.read::<f32>("creaseAngle").unwrap_or(0.0),
        color_per_vertex: has_colors.then(|| flag("colorPerVertex")),
        normals: state.normals,
        normal_per_vertex: flag("normalPerVertex"),
        texcoords,
    });
    match made {
        Ok(mesh) => {
            out.set_sides(true, !flag("solid"), flag("solid"));
            out.mesh(&mesh, false);
            if let Some((min, mut max)) = out.object_bounds {
                // Coin counts a row and a column too many.
                let side = |count: &str, step: &str| {
                    let count = node.read::<i32>(count).unwrap_or(0);
                    f64::from(count) * f64::from(node.read::<f32>(step).unwrap_or(1.0))
                };
                max.x = side("xDimension", "xSpacing");
                max.z = side("zDimension", "zSpacing");
                out.set_inventor_box(Some((min, max)));
            }
        }
        Err(why) => out.complain(node, &why),
    }
}
