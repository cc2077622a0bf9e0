//! Text shapes: what the nodes say, set by `scene::text`.

use glam::{DVec3, Vec2, Vec3};

use super::screen;
use crate::grammar::value::{Choice, Text};
use crate::graph::State;
use crate::graph::read::Fields;
use crate::graph::state::{Binding, ProfileCoordinates};
use crate::iv::NodeRef;
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
    if out.screen().is_none() {
        return text2_box(node, state, out);
    }
    let at = state.world_from_object.transform_point3(DVec3::ZERO);
    let mesh = typeset::text2(strings(node), &style(node, state));
    screen::facing(at, out, |out| out.mesh(&mesh, false));
}

/// A `Text2` at each of several points.
pub fn text2_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    out.set_unlit();
    let places = node.read::<[Vec3]>("position").unwrap_or(&[]);
    let sides = node.read::<[Choice]>("justification").unwrap_or(&[]);
    let plain = style(node, state);
    for (i, line) in strings(node).iter().enumerate() {
        let Some(&place) = places.get(i).or(places.last()) else {
            return;
        };
        out.bound(place);
        let side = sides.get(i).or(sides.last()).copied().unwrap_or(1);
        let style = TextStyle {
            justify: Justify::from_value(side),
            ..plain
        };
        let at = state.world_from_object.transform_point3(place.as_dvec3());
        let mesh = typeset::text2(&[line], &style);
        screen::facing(at, out, |out| out.mesh(&mesh, false));
    }
}

/// Without a camera the box of a `Text2` is what Inventor's default view shows of it: the cube
/// from −1 to 1, and nothing of a text that begins outside.
fn text2_box<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    out.bound(Vec3::ZERO);
    let at = state.world_from_object.transform_point3(DVec3::ZERO);
    if at.abs().max_element() >= 1.0 {
        out.set_inventor_box(None);
        return;
    }
    let pixel = 2.0 / f64::from(out.pixel_rows());
    let mesh = typeset::text2(strings(node), &style(node, state));
    let object_from_world = state.world_from_object.inverse();
    let corners = mesh.positions.iter().map(|p| {
        // The reference's view is a third wider than high.
        let p = at + pixel * DVec3::new(0.75 * f64::from(p.x), f64::from(p.y), 0.0);
        object_from_world.transform_point3(p)
    });
    let around = corners.fold(None, |all: Option<(DVec3, DVec3)>, p| {
        let (min, max) = all.unwrap_or((p, p));
        Some((min.min(p), max.max(p)))
    });
    out.set_inventor_box(around);
}

pub fn text3<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let parts = node.read::<Choice>("parts").unwrap_or(1);
    let profile = profile(state);
    let (mesh, laid) = typeset::text3(
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
    let lines = Vec2::new(laid.left, laid.right);
    widen_text3_box(lines, parts, profile.as_deref(), out);
}

/// Inventor's box of a `Text3` has the lines' advances, not their ink, is one unit deep at least
/// where it is solid, and has a profile all round it whatever its parts (measured in Coin).
fn widen_text3_box(lines: Vec2, parts: i32, profile: Option<&[Vec2]>, out: &mut Builder<'_>) {
    let Some((mut min, mut max)) = out.object_bounds else {
        return;
    };
    let points = profile.unwrap_or(&[]);
    let out_by = points.iter().map(|p| p.y).fold(0.0, f32::max);
    min.x = f64::from(lines.x - out_by);
    max.x = f64::from(lines.y + out_by);
    if parts & typeset::SIDES == 0 {
        min.y -= f64::from(out_by);
        max.y += f64::from(out_by);
    }
    if profile.is_some() || parts & (typeset::SIDES | typeset::BACK) != 0 {
        let deep = points.iter().map(|p| -p.x).fold(-1.0, f32::min);
        let fore = points.iter().map(|p| -p.x).fold(0.0, f32::max);
        min.z = min.z.min(f64::from(deep));
        max.z = max.z.max(f64::from(fore));
    }
    out.set_inventor_box(Some((min, max)));
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
    let style = style(node, state);
    let (mesh, laid) = typeset::ascii_text(strings(node), &style, widths);
    out.mesh(&mesh, false);
    if let Some((mut min, mut max)) = out.object_bounds {
        // Inventor's box begins where the line does and is as high as the font (Coin).
        (min.x, max.x) = (f64::from(laid.left), f64::from(laid.right));
        max.y = f64::from(style.size).max(max.y);
        out.set_inventor_box(Some((min, max)));
    }
}

/// VRML 97's `Text`.
pub fn text97<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let style = node
        .node_in("fontStyle")
        .map_or(Vrml97Style::DEFAULT, |f| style97(f, state));
    let lengths = node.read::<[f32]>("length").unwrap_or(&[]);
    let most = node.read::<f32>("maxExtent").unwrap_or(0.0);
    let (mesh, laid) = typeset::vrml97_text(strings(node), &style, lengths, most);
    out.set_sides(true, true, false);
    out.mesh(&mesh, false);
    if let Some((mut min, mut max)) = out.object_bounds.filter(|_| style.horizontal) {
        // As of an `AsciiText`: the lines' own ends, and as high as the font.
        (min.x, max.x) = (f64::from(laid.left), f64::from(laid.right));
        max.y = max.y.max(f64::from(style.size));
        min.y = f64::from(laid.bottom);
        out.set_inventor_box(Some((min, max)));
    }
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
