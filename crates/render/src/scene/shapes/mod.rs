//! The drawing of shapes, with one function for each class.
//!
//! A class that draws is added in three places:
//!
//! 1. `grammar/shapes.nodes` gets an entry that is marked `rendered`. Reading, writing, defaults
//!    and the manual follow from it, and the build makes `class::NAME` and a handle for each field.
//! 2. `draw_class` below, or `vrml97::draw` for a class of VRML97, or `x3d::draw` for one of X3D,
//!    gets a line with its constant.
//! 3. The file of its kind gets the function. It reads fields through handles, which have the
//!    defaults (`node.get(cone::HEIGHT)`), reads values of earlier nodes from the [`State`], and
//!    draws into the [`Canvas`]. Mathematics that needs no node belongs to a file of the same name
//!    in [`crate::geometry`].
//!
//! The test at the end fails if a `rendered` class has no line in the table. A scene in
//! `tests/golden/shapes/` shows what the class draws.

mod faces;
mod lines;
mod markers;
mod nurbs;
mod quad_mesh;
mod screen_aligned;
mod solids;
mod strips;
mod text;
mod vrml97;
mod x3d;

use glam::DMat4;
use ivcam_inventor::grammar::{self, Class, class, complexity, face_set};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::property::vertex_property;
use ivcam_inventor::traversal::state::{DrawStyle, State};

use crate::geometry::Corner;
use crate::scene::canvas::{BoundsCanvas, Canvas};

/// Draws a shape node with its state.
pub(super) fn draw<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let Some(class) = node.known_class() else {
        return;
    };
    if state.drawing.style == DrawStyle::Invisible && !out.ignores_draw_style() {
        out.census().ignore(class.name, "DrawStyle INVISIBLE");
        return;
    }
    // A vertex property in a field of the shape acts only on this shape.
    let mut inner;
    let state = if class.is_vrml97() {
        inner = state.clone();
        vrml97::prepare(class.id, &mut inner, node);
        &inner
    } else if class.id == class::IMAGE {
        inner = state.clone();
        screen_aligned::prepare_image(&mut inner, node);
        &inner
    } else if let Some(property) = node.get_node(face_set::VERTEX_PROPERTY) {
        inner = state.clone();
        vertex_property(&mut inner, property);
        &inner
    } else {
        state
    };
    out.begin(node, state);
    let bad = out.census().bad_corners;
    let drawn = draw_whole(class, node, state, out);
    if drawn {
        out.census().draw(class.name);
    } else {
        let why = "this version does not draw it";
        out.census().ignore(class.name, why);
    }
    // A scale of 0 in all directions hides a mesh of glTF 2.0, which is read as X3D.
    let is_hidden = node.document.is_x3d() && out.placement().is_point();
    if out.census().bad_corners > bad || out.placement().is_collapsed() && !is_hidden {
        out.report_bad_parts(node);
    }
    out.report_mistakes(node);
}

/// Draws a shape or its bounding box. Returns `false` if its class is not drawn.
fn draw_whole<'a>(
    class: &'static Class,
    node: NodeRef<'a>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) -> bool {
    if state.complexity.kind == Some(complexity::TYPE_BOUNDING_BOX)
        && !out.ignores_draw_style()
        && draw_box(node, state, out)
    {
        return true;
    }
    if class.is_vrml97() {
        vrml97::draw(class.id, node, state, out)
    } else {
        draw_class(class, node, state, out)
    }
}

/// Draws the bounding box of a shape, for `Complexity` with `BOUNDING_BOX`. Returns `false` if the
/// shape has no box.
fn draw_box<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) -> bool {
    let mut bounds = BoundsCanvas::new(out.picture().clone());
    draw(node, state, &mut bounds);
    let Some((min, max)) = bounds.object_bounds else {
        return false;
    };
    let center = DMat4::from_translation(0.5 * (min + max));
    let half = (0.5 * (max - min)).as_vec3();
    out.with_matrix(center, |out| solids::block(half, false, out));
    true
}

/// Draws a shape of Inventor by its class or the nearest base class. Returns `false` if none is
/// drawn.
fn draw_class<'a>(
    class: &'static Class,
    node: NodeRef<'a>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) -> bool {
    let mut class = class;
    loop {
        match class.id {
            class::CUBE => solids::cube(node, state, out),
            class::SPHERE => solids::sphere(node, out),
            class::LENS_SURFACE => solids::lens_surface(node, out),
            class::CYLINDER => solids::cylinder(node, state, out),
            class::CONE => solids::cone(node, state, out),
            class::FACE_SET => faces::face_set(node, state, out),
            class::INDEXED_FACE_SET => faces::indexed_face_set(node, state, out),
            class::TRIANGLE_STRIP_SET => strips::triangle_strip_set(node, state, out),
            class::INDEXED_TRIANGLE_STRIP_SET => {
                strips::indexed_triangle_strip_set(node, state, out)
            }
            class::QUAD_MESH => quad_mesh::quad_mesh(node, state, out),
            class::LINE_SET => lines::line_set(node, state, out),
            class::INDEXED_LINE_SET => lines::indexed_line_set(node, state, out),
            class::IMAGE => screen_aligned::image(node, state, out),
            class::INDEXED_MARKER_SET => lines::indexed_marker_set(node, state, out),
            class::MARKER_SET => lines::marker_set(node, state, out),
            class::POINT_SET => lines::point_set(node, state, out),
            class::INDEXED_POINT_SET => lines::indexed_point_set(node, state, out),
            class::TEXT2 => text::text2(node, state, out),
            class::TEXT2_SET => text::text2_set(node, state, out),
            class::TEXT3 => text::text3(node, state, out),
            class::ASCII_TEXT => text::ascii_text(node, state, out),
            class::NURBS_SURFACE => nurbs::nurbs_surface(node, state, out),
            class::INDEXED_NURBS_SURFACE => nurbs::indexed_nurbs_surface(node, state, out),
            class::NURBS_CURVE => nurbs::nurbs_curve(node, state, out),
            class::INDEXED_NURBS_CURVE => nurbs::indexed_nurbs_curve(node, state, out),
            class::SHAPE => return false,
            _ => {
                let above = grammar::by_name(class.family, class.dialects)
                    .or_else(|| grammar::any(class.family));
                match above {
                    Some(parent) if parent.id != class.id => {
                        class = parent;
                        continue;
                    }
                    _ => return false,
                }
            }
        }
        return true;
    }
}

/// Draws a flat quadrilateral as two triangles or as an outline.
fn quad(corners: [Corner; 4], out: &mut dyn Canvas) {
    if out.wants().outlines {
        out.outline(&corners);
        return;
    }
    let [a, b, c, d] = corners;
    out.triangle([a, b, c]);
    out.triangle([a, c, d]);
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::CompileOptions;
    use crate::scene::canvas::PictureView;
    use ivcam_inventor::grammar::{CLASSES, Treatment};
    use ivcam_inventor::iv::{ClassRef, Document, Node};
    use ivcam_inventor::snapshot::Snapshot;
    use ivcam_inventor::traversal::role::Role;
    use ivcam_inventor::traversal::state::Language;

    /// A document with one node of every class, with default values.
    fn one_of_each() -> Document {
        let mut document = Document::default();
        for class in CLASSES {
            document.add(Node {
                class: ClassRef::Known(class.id),
                name: None,
                fields: Vec::new(),
                children: Vec::new(),
                span: ivcam_base::diag::Span::default(),
                source: 0,
            });
        }
        document
    }

    /// Whether a ray through the middle of a cube's front hits an edge of its back.
    fn hits_the_back_edge(hints: &str) -> bool {
        let text = format!(
            "#Inventor V2.1 ascii\n{hints} DrawStyle {{ style LINES lineWidth 3 }} Cube {{ }}"
        );
        let files = std::sync::Arc::new(ivcam_inventor::iv::NoFiles);
        let limits = ivcam_inventor::iv::Limits::default();
        let document = Document::read("a.iv", text.into_bytes(), files, &limits).expect("reads");
        let options = CompileOptions {
            origin: glam::DVec3::new(0.0, 0.0, 5.0),
            ..CompileOptions::default()
        };
        let snapshot = Snapshot::at(&document, 0.0);
        let scene = crate::scene::RenderScene::compile(&snapshot, &options).expect("compiles");
        let ray = crate::bvh::Ray::new(Vec3::ZERO, Vec3::new(1.0, 0.1, -6.0));
        scene.hit(&ray).is_some()
    }

    #[test]
    fn a_closed_shape_drawn_in_lines_hides_the_edges_of_back_faces() {
        assert!(hits_the_back_edge(""));
        assert!(!hits_the_back_edge(
            "ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID }"
        ));
    }

    #[test]
    fn every_rendered_class_of_the_catalogue_is_drawn() {
        let document = one_of_each();
        let options = CompileOptions::default();
        for (class, node) in CLASSES.iter().zip(0..) {
            if class.treatment != Treatment::Rendered {
                continue;
            }
            let node = document.node(ivcam_inventor::iv::NodeId(node));
            let role = class.role;
            assert!(
                matches!(role, Role::Shape | Role::AppearanceAndGeometry),
                "{}: {role:?}",
                class.name
            );
            let mut out = BoundsCanvas::new(PictureView::of(&options));
            draw(node, &State::new(Language::Inventor), &mut out);
            let ignored = &out.census.ignored;
            assert!(
                role != Role::Shape || class.name == "Shape" || ignored.is_empty(),
                "{ignored:?}"
            );
        }
    }
}
