//! Draws the geometry nodes of VRML 97.
//!
//! Their coordinates, colors and normals are nodes in fields of the shape. These are copied to the
//! state, so that the functions for Inventor's shapes can draw them.

use std::sync::Arc;

use ivcam_inventor::grammar::{
    ClassId, Field, box_node, class, color, color_rgba, coordinate, elevation_grid, extrusion,
    multi_texture_coordinate, texture_coordinate, trimmed_surface, vrml97_cone, vrml97_cylinder,
    vrml97_indexed_face_set as faces97, vrml97_indexed_line_set, vrml97_normal,
    vrml97_nurbs_surface,
};
use ivcam_inventor::iv::{NodeRef, linear_of_display};
use ivcam_inventor::traversal::state::{
    Binding, Coordinates, Diffuse, Language, List, ShapeHints, State, TextureCoordinates,
    VertexOrdering,
};

use super::faces::{Indices, indexed_faces};
use super::{lines, nurbs, solids, text, x3d};
use crate::geometry::{self, ElevationGrid, Extrusion};
use crate::scene::canvas::{Canvas, MaterialsBy, Sides, indices};

/// Sets the state from the fields of a shape.
///
/// The handles of a face set also read the fields with the same names of other classes. If a class
/// has no such field the handle returns the default.
pub(super) fn prepare<'a>(class: ClassId, state: &mut State<'a>, node: NodeRef<'a>) {
    let counterclockwise = node.get(faces97::CCW);
    state.language = Language::Vrml97;
    state.hints = ShapeHints {
        ordering: if counterclockwise {
            VertexOrdering::Counterclockwise
        } else {
            VertexOrdering::Clockwise
        },
        solid: node.get(faces97::SOLID),
        convex: node.get(faces97::CONVEX),
        crease_angle: node.get(faces97::CREASE_ANGLE),
    };
    let points = node.get_node(faces97::COORD);
    state.coordinates = Coordinates::Three(points.map_or(&[], |c| c.get(coordinate::POINT)));
    let by = |per_vertex: bool, indexed: bool| match (per_vertex, indexed) {
        (true, _) => Binding::PerVertexIndexed,
        (false, true) => Binding::PerFaceIndexed,
        (false, false) => Binding::PerFace,
    };
    let normals = node.get_node(faces97::NORMAL);
    state.normals = normals.map_or(&[], |n| n.get(vrml97_normal::VECTOR));
    let indexed = indices(node, faces97::NORMAL_INDEX).is_some();
    state.normal_binding = by(node.get(faces97::NORMAL_PER_VERTEX), indexed);
    state.material_binding = Binding::Overall;
    let colors = node.get_node(faces97::COLOR).and_then(colors);
    let is_line = matches!(
        class,
        class::VRML97_INDEXED_LINE_SET
            | class::VRML97_POINT_SET
            | class::VRML97_NURBS_CURVE
            | class::X3D_LINE_SET
    );
    if is_line {
        state.material.physical = None;
    }
    if let Some(colors) = colors {
        state.material.diffuse = colors;
        let indexed = indices(node, faces97::COLOR_INDEX).is_some();
        state.material_binding = match class {
            class::VRML97_POINT_SET => Binding::PerVertex,
            _ => by(node.get(faces97::COLOR_PER_VERTEX), indexed),
        };
    } else if is_line && !state.base_color {
        // Lines are not lit and have the emissive color (6.24).
        let emissive = state.material.emissive;
        let own = match state.material.is_linear {
            true => emissive.map(linear_of_display),
            false => emissive,
        };
        state.material.diffuse = Diffuse::Colors(List::One(own));
    }
    if is_line {
        state.base_color = true;
        state.texture = None;
        state.further_textures = Arc::default();
    }
    let coordinates = node
        .get_node(faces97::TEX_COORD)
        .map(|t| first_coordinates(t).get(texture_coordinate::POINT))
        .filter(|t| !t.is_empty());
    state.texture_coordinates = match coordinates {
        Some(list) => TextureCoordinates::Two(list),
        None => TextureCoordinates::Default,
    };
    state.texture_indexed = true;
    x3d::prepare(class, state, node);
}

/// Returns the colors of a `Color` or `ColorRGBA`, if it has any.
fn colors(node: NodeRef<'_>) -> Option<Diffuse<'_>> {
    if node.class_id() == Some(class::COLOR_RGBA) {
        let colors = node.get(color_rgba::COLOR);
        return (!colors.is_empty()).then_some(Diffuse::Rgba(colors));
    }
    let colors = node.get(color::COLOR);
    (!colors.is_empty()).then_some(Diffuse::Colors(List::Many(colors)))
}

/// Returns texture coordinates, or the first of a `MultiTextureCoordinate`.
fn first_coordinates(node: NodeRef<'_>) -> NodeRef<'_> {
    let list = node.get_nodes(multi_texture_coordinate::TEX_COORD);
    match list.first() {
        Some(&first) if node.class_id() == Some(class::MULTI_TEXTURE_COORDINATE) => {
            node.document.node(first)
        }
        _ => node,
    }
}

/// Draws a geometry node. Returns `false` if its class is not drawn.
pub(super) fn draw<'a>(
    class: ClassId,
    node: NodeRef<'a>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) -> bool {
    match class {
        class::BOX_NODE => {
            let size = node.get(box_node::SIZE);
            solids::block(0.5 * size.abs(), false, out);
        }
        class::VRML97_SPHERE => solids::sphere(node, out),
        class::VRML97_CONE => solids::cone_of(
            f64::from(solids::size(node, vrml97_cone::BOTTOM_RADIUS)),
            0.5 * f64::from(solids::size(node, vrml97_cone::HEIGHT)),
            [vrml97_cone::SIDE, vrml97_cone::BOTTOM].map(|part| node.get(part)),
            [0; 2],
            out,
        ),
        class::VRML97_CYLINDER => solids::cylinder_of(
            f64::from(solids::size(node, vrml97_cylinder::RADIUS)),
            0.5 * f64::from(solids::size(node, vrml97_cylinder::HEIGHT)),
            [
                vrml97_cylinder::SIDE,
                vrml97_cylinder::TOP,
                vrml97_cylinder::BOTTOM,
            ]
            .map(|part| node.get(part)),
            [0; 3],
            out,
        ),
        class::VRML97_INDEXED_FACE_SET => {
            let indices = Indices {
                coord: node.get(faces97::COORD_INDEX),
                normal: indices(node, faces97::NORMAL_INDEX),
                material: indices(node, faces97::COLOR_INDEX),
                texture: indices(node, faces97::TEX_COORD_INDEX),
            };
            indexed_faces(&indices, state, out);
        }
        class::VRML97_INDEXED_LINE_SET => lines::indexed_lines(
            node.get(vrml97_indexed_line_set::COORD_INDEX),
            [indices(node, vrml97_indexed_line_set::COLOR_INDEX), None],
            state,
            out,
        ),
        class::VRML97_POINT_SET => lines::point_set(node, state, out),
        class::EXTRUSION => extrusion(node, out),
        class::ELEVATION_GRID => elevation_grid(node, state, out),
        class::TEXT => text::text97(node, state, out),
        class::VRML97_NURBS_CURVE => nurbs::curve97(node, state, out),
        class::VRML97_NURBS_SURFACE | class::NURBS_PATCH_SURFACE => {
            nurbs_surface(node, None, state, out);
        }
        class::TRIMMED_SURFACE => {
            if let Some(surface) = node.get_node(trimmed_surface::SURFACE) {
                nurbs_surface(surface, Some(node), state, out);
            }
        }
        _ => return x3d::draw(class, node, state, out),
    }
    true
}

/// Draws a `NurbsSurface`, with the loops of a `TrimmedSurface` if there is one.
fn nurbs_surface<'a>(
    node: NodeRef<'a>,
    trimmed: Option<NodeRef<'a>>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) {
    let solid = node.get(vrml97_nurbs_surface::SOLID);
    let counterclockwise = node.get(vrml97_nurbs_surface::CCW);
    out.set_sides(Sides::of_solid(solid, counterclockwise));
    nurbs::surface97(node, trimmed, state, out);
}

/// Draws an `Extrusion`.
fn extrusion<'a>(node: NodeRef<'a>, out: &mut dyn Canvas) {
    let orientation: Vec<glam::Quat> = node
        .get(extrusion::ORIENTATION)
        .iter()
        .map(|r| r.to_quat())
        .collect();
    let shape = Extrusion {
        cross_section: node.get(extrusion::CROSS_SECTION),
        spine: node.get(extrusion::SPINE),
        scale: node.get(extrusion::SCALE),
        orientation: &orientation,
        begin_cap: node.get(extrusion::BEGIN_CAP),
        end_cap: node.get(extrusion::END_CAP),
        ccw: node.get(extrusion::CCW),
        convex: node.get(extrusion::CONVEX),
        crease_angle: node.get(extrusion::CREASE_ANGLE),
    };
    if !out.has_memory(shape.bytes()) {
        return;
    }
    match geometry::extrusion(&shape) {
        Ok(mesh) => {
            let solid = node.get(extrusion::SOLID);
            out.set_sides(Sides::of_solid(solid, true));
            out.mesh(&mesh, MaterialsBy::Vertex);
        }
        Err(why) => out.report(node, &why),
    }
}

/// Draws an `ElevationGrid`.
fn elevation_grid<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let texcoords = match state.texture_coordinates {
        TextureCoordinates::Two(list) => list,
        _ => &[],
    };
    let has_colors = state.material_binding != Binding::Overall;
    let grid = ElevationGrid {
        x_dimension: node.get(elevation_grid::X_DIMENSION),
        z_dimension: node.get(elevation_grid::Z_DIMENSION),
        x_spacing: node.get(elevation_grid::X_SPACING),
        z_spacing: node.get(elevation_grid::Z_SPACING),
        height: node.get(elevation_grid::HEIGHT),
        ccw: node.get(elevation_grid::CCW),
        crease_angle: node.get(elevation_grid::CREASE_ANGLE),
        color_per_vertex: has_colors.then(|| node.get(elevation_grid::COLOR_PER_VERTEX)),
        normals: state.normals,
        normal_per_vertex: node.get(elevation_grid::NORMAL_PER_VERTEX),
        texcoords,
    };
    if !out.has_memory(grid.bytes()) {
        return;
    }
    match geometry::elevation_grid(&grid) {
        Ok(mesh) => {
            let solid = node.get(elevation_grid::SOLID);
            out.set_sides(Sides::of_solid(solid, true));
            out.mesh(&mesh, MaterialsBy::Vertex);
            if let Some((min, mut max)) = out.inventor_box() {
                // Coin's box is larger by one row and one column.
                let side = |count: Field<i32>, step: Field<f32>| {
                    f64::from(node.get(count)) * f64::from(node.get(step))
                };
                max.x = side(elevation_grid::X_DIMENSION, elevation_grid::X_SPACING);
                max.z = side(elevation_grid::Z_DIMENSION, elevation_grid::Z_SPACING);
                out.set_inventor_box(Some((min, max)));
            }
        }
        Err(why) => out.report(node, &why),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use crate::bvh::Ray;
    use crate::scene::{CompileOptions, RenderScene, Surface};
    use ivcam_inventor::iv::{Document, Limits, NoFiles};
    use ivcam_inventor::snapshot::Snapshot;

    fn document(text: &str) -> Document {
        let text = text.as_bytes().to_vec();
        Document::read("a", text, Arc::new(NoFiles), &Limits::default()).expect("reads")
    }

    fn compiled(text: &str) -> RenderScene {
        let document = document(text);
        let snapshot = Snapshot::at(&document, 0.0);
        RenderScene::compile(&snapshot, &CompileOptions::default()).expect("compiles")
    }

    /// The surface that a ray along −z hits.
    fn ahead(scene: &RenderScene) -> &Surface {
        let hit = scene.hit_any_side(&Ray::new(Vec3::ZERO, Vec3::NEG_Z));
        scene.surface(&hit.expect("something is ahead"))
    }

    #[test]
    fn a_shape_without_a_material_is_white_and_unlit() {
        let text = "#VRML V2.0 utf8\nShape { geometry Box { } } Shape { appearance Appearance { } geometry Box { } }";
        let scene = compiled(text);
        let surface = ahead(&scene);
        assert!(surface.base_color);
        assert_eq!(surface.diffuse[0], Vec3::ONE);
    }

    #[test]
    fn lines_have_the_emissive_color_of_their_material() {
        let text = "#VRML V2.0 utf8\nShape { appearance Appearance { material Material { diffuseColor 0 .2 0 emissiveColor .5 .2 0 } }\n  geometry IndexedLineSet { coord Coordinate { point [0 -1 -1, 0 1 -1] } coordIndex [0 1] } }";
        let scene = compiled(text);
        let off = ahead(&scene).diffuse[0] - Vec3::new(0.5, 0.2, 0.0);
        assert!(off.length() < 1e-6);
    }

    #[test]
    fn a_texture_transform_translates_then_rotates_then_scales() {
        let text = "#VRML V2.0 utf8\nShape { appearance Appearance { material Material { } texture PixelTexture { image 1 1 1 0xff }\n  textureTransform TextureTransform { scale 2 2 center .5 0 translation .25 0 rotation 1.5707963 } } geometry Box { } }";
        // (1, 0) is moved to 1.25, rotated about the center, doubled about 0 and moved back.
        let scene = compiled(text);
        let matrix = ahead(&scene).texture.as_ref().expect("a texture").matrix;
        let seen = matrix.transform_point3(Vec3::X);
        assert!((seen - Vec3::new(-0.5, 3.5, 0.0)).length() < 1e-5, "{seen}");
    }

    #[test]
    fn the_first_transform_and_the_boundary_modes_of_a_texture_of_x3d_are_applied() {
        for (fields, repeats) in [
            ("", true),
            ("repeatS FALSE", false),
            (
                "textureProperties TextureProperties { boundaryModeS \"CLAMP_TO_EDGE\" }",
                false,
            ),
            (
                "repeatS FALSE textureProperties TextureProperties { boundaryModeS \"REPEAT\" }",
                true,
            ),
            (
                "repeatS FALSE textureProperties TextureProperties { }",
                false,
            ),
        ] {
            let scene = compiled(&format!(
                "#X3D V3.3 utf8\nPROFILE Full\nShape {{ appearance Appearance {{
                 texture PixelTexture {{ image 1 1 1 0xff {fields} }}
                 textureTransform MultiTextureTransform {{ textureTransform TextureTransform {{
                 scale 2 2 }} }} }} geometry Box {{ }} }}"
            ));
            let surface = ahead(&scene);
            let texture = surface.texture.as_ref().expect("a texture");
            assert_eq!(texture.matrix.transform_point3(Vec3::X).x, 2.0);
            assert_eq!(texture.repeat.s, repeats, "{fields}");
        }
    }

    /// The camera's own rotation by 0.3 must not matter.
    #[test]
    fn a_billboard_faces_the_eye() {
        let text = "#VRML V2.0 utf8\nViewpoint { position 6 3 0 orientation 0 1 0 .3 }\nBillboard { children Shape { geometry IndexedFaceSet { coord Coordinate { point [-1 -1 0, 1 -1 0, 1 1 0, -1 1 0] } coordIndex [0 1 2 3] } } }";
        let document = document(text);
        let snapshot = Snapshot::at(&document, 0.0);
        let survey = RenderScene::survey(&snapshot, &CompileOptions::default());
        let options = CompileOptions {
            camera: survey.cameras.first().cloned(),
            ..CompileOptions::default()
        };
        let scene = RenderScene::compile(&snapshot, &options).expect("compiles");
        let (_, max) = scene.bounds().expect("something");
        assert!(max.x.abs() < 1e-3, "{max}");
    }

    #[test]
    fn an_ignored_translation_moves_nothing() {
        let text = "#Inventor V2.1 ascii\nTranslation { translation 4 0 0 ~ } Cube { }";
        assert_eq!(compiled(text).bounds().map(|b| b.1.x), Some(1.0));
    }
}
