//! Text shapes: what the nodes say, set by `scene::text`.

use glam::{DMat4, DVec3, Vec2};

use crate::grammar::value::{Choice, Text};
use crate::graph::State;
use crate::graph::read::Fields;
use crate::graph::state::{Binding, ProfileCoordinates};
use crate::iv::NodeRef;
use crate::pose::Projection;
use crate::scene::Builder;
use crate::scene::text::{self as typeset, Face, Justify, TextStyle, Vrml97Style};

fn strings<'a>(node: NodeRef<'a>) -> &'a [String] {
    node.read::<[String]>("string").unwrap_or(&[])
}

fn style(node: NodeRef<'_>, state: &State<'_>) -> TextStyle {
    let font = state.font;
    let face = if font.is_style {
        Face::of_font_style(font.family, font.style)
    } else {
        Face::named(font.name)
    };
    TextStyle {
        face,
        size: if font.size.is_finite() {
            font.size
        } else {
            10.0
        },
        spacing: node.read::<f32>("spacing").unwrap_or(1.0),
        justify: Justify::from_value(node.read::<Choice>("justification").unwrap_or(1)),
        complexity: state.complexity.value,
    }
}

/// Letters facing the camera, as many pixels high as the font's size says, at the text's origin.
pub fn text2<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    out.set_unlit();
    let Some(camera) = out.camera().cloned() else {
        out.bound(glam::Vec3::ZERO);
        return;
    };
    let at = state.world_from_object.transform_point3(DVec3::ZERO);
    let toward = at - camera.position;
    let depth = toward.dot(camera.direction());
    let rows = f64::from(out.pixel_rows());
    let pixel = match camera.projection {
        Projection::Perspective { height_angle } => {
            depth * 2.0 * libm::tan(0.5 * height_angle) / rows
        }
        Projection::Orthographic { height } => height / rows,
    };
    if !(pixel > 0.0) {
        return; // behind the camera
    }
    let mesh = typeset::text2(strings(node), &style(node, state));
    let world = DMat4::from_scale_rotation_translation(DVec3::splat(pixel), camera.orientation, at);
    out.with_world(world, |out| out.mesh(&mesh, false));
}

pub fn text3<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let parts = node.read::<Choice>("parts").unwrap_or(1);
    let profile = profile(state);
    let (mesh, _) = typeset::text3(
        strings(node),
        &style(node, state),
        parts,
        profile.as_deref(),
        state.hints.crease_angle,
    );
    let by_part = matches!(
        state.material_binding,
        Binding::PerPart | Binding::PerPartIndexed
    );
    out.set_sides(true, false, false);
    out.mesh(&mesh, by_part);
}

/// The profiles in force, one behind the other, as one polyline.
fn profile(state: &State<'_>) -> Option<Vec<Vec2>> {
    let mut line: Vec<Vec2> = Vec::new();
    for profile in state.profiles.iter() {
        let index = profile.node.read::<[i32]>("index").unwrap_or(&[]);
        for &i in index {
            let i = usize::try_from(i).ok()?;
            let point = match profile.coordinates {
                ProfileCoordinates::Two(p) => p.get(i).copied(),
                ProfileCoordinates::Three(p) => p.get(i).map(|p| p.truncate() / p.z),
            };
            line.extend(point);
        }
    }
    (line.len() > 1).then_some(line)
}

pub fn ascii_text<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let widths = node.read::<[f32]>("width").unwrap_or(&[]);
    let (mesh, _) = typeset::ascii_text(strings(node), &style(node, state), widths);
    out.mesh(&mesh, false);
}

/// VRML 97's `Text`.
pub fn text97<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let style = node
        .node_in("fontStyle")
        .map_or(Vrml97Style::DEFAULT, |f| style97(f, state));
    let lengths = node.read::<[f32]>("length").unwrap_or(&[]);
    let most = node.read::<f32>("maxExtent").unwrap_or(0.0);
    let (mesh, _) = typeset::vrml97_text(strings(node), &style, lengths, most);
    out.set_sides(true, true, false);
    out.mesh(&mesh, false);
}

fn style97(node: NodeRef<'_>, state: &State<'_>) -> Vrml97Style {
    let flag = |name: &str| node.read::<bool>(name).unwrap_or(true);
    let families = node.read::<[String]>("family").unwrap_or(&[]);
    Vrml97Style {
        face: Face::of_vrml97(families, node.read::<Text>("style").unwrap_or("PLAIN")),
        size: node.read::<f32>("size").unwrap_or(1.0),
        spacing: node.read::<f32>("spacing").unwrap_or(1.0),
        horizontal: flag("horizontal"),
        left_to_right: flag("leftToRight"),
        top_to_bottom: flag("topToBottom"),
        complexity: state.complexity.value,
        ..Vrml97Style::DEFAULT
    }
    .justified(node.read::<[String]>("justify").unwrap_or(&[]))
}
