//! Text shapes: what the nodes say, set by `geometry::text`.

use glam::{DVec3, Vec2, Vec3};

use super::screen_aligned;
use crate::geometry::text::{
    self as typeset, Face, Fonts, Justify, Layout, TextStyle, Vrml97Style,
};
use crate::grammar::value::{Choice, Text};
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::traversal::State;
use crate::traversal::state::{Binding, ProfileCoordinates};

fn strings<'a>(node: NodeRef<'a>) -> &'a [String] {
    node.read::<[String]>("string").unwrap_or(&[])
}

fn style<'f>(node: NodeRef<'_>, state: &State<'_>, fonts: &'f Fonts) -> TextStyle<'f> {
    let font = state.font;
    let face = if font.is_style {
        Face::of_font_style(font.family, font.style, fonts)
    } else {
        Face::named_of(font.name, fonts)
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
    let fonts = out.fonts();
    let text = typeset::pixel_text(strings(node), &style(node, state, &fonts));
    let at = state.world_from_object.transform_point3(DVec3::ZERO);
    out.set_unlit();
    screen_aligned::pixels(at, &text, out);
    out.bound(Vec3::ZERO);
    let object_from_world = state.world_from_object.inverse();
    let around = screen_aligned::seen_around(at, &text, out);
    let corners = around.iter().flatten();
    let corners = corners.map(|&p| object_from_world.transform_point3(p));
    out.set_inventor_box(corners.fold(None, |all: Option<(DVec3, DVec3)>, p| {
        let (min, max) = all.unwrap_or((p, p));
        Some((min.min(p), max.max(p)))
    }));
}

/// A `Text2` at each of several points.
pub fn text2_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let places = node.read::<[Vec3]>("position").unwrap_or(&[]);
    let sides = node.read::<[Choice]>("justification").unwrap_or(&[]);
    let fonts = out.fonts();
    let plain = style(node, state, &fonts);
    for (i, line) in strings(node).iter().enumerate() {
        let Some(&place) = places.get(i).or(places.last()) else {
            return;
        };
        let side = sides.get(i).or(sides.last()).copied().unwrap_or(1);
        let style = TextStyle {
            justify: Justify::from_value(side),
            ..plain
        };
        let text = typeset::pixel_text(&[line], &style);
        let at = state.world_from_object.transform_point3(place.as_dvec3());
        out.bound(place);
        out.set_unlit();
        screen_aligned::pixels(at, &text, out);
    }
}

pub fn text3<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let parts = node.read::<Choice>("parts").unwrap_or(1);
    let profile = profile(state);
    let fonts = out.fonts();
    let style = style(node, state, &fonts);
    let (mesh, laid) = typeset::text3(
        strings(node),
        &style,
        parts,
        profile.as_deref(),
        state.hints.crease_angle,
        out.as_coin(),
    );
    let by_part = matches!(
        state.material_binding,
        Binding::PerPart | Binding::PerPartIndexed
    );
    out.set_sides(true, false, false);
    out.mesh(&mesh, by_part);
    if out.object_bounds.is_some() {
        out.set_inventor_box(Some(text3_box(&laid, parts, profile.as_deref())));
    }
}

/// Inventor's box of a `Text3`: the lines' advances, not their ink, one unit deep where it is solid,
/// and a profile all round whatever its parts (Coin).
fn text3_box(laid: &Layout, parts: i32, profile: Option<&[Vec2]>) -> (DVec3, DVec3) {
    let points = profile.unwrap_or(&[]);
    let out_by = points.iter().map(|p| p.y).fold(0.0, f32::max);
    let depths = points.iter().map(|p| -p.x);
    let fore = depths.clone().fold(0.0, f32::max);
    let flat = profile.is_none() && parts == typeset::FRONT;
    let deep = depths.fold(if flat { 0.0 } else { -1.0 }, f32::min);
    let low = Vec3::new(laid.left - out_by, laid.bottom - out_by, deep);
    let high = Vec3::new(laid.right + out_by, laid.top + out_by, fore);
    (low.as_dvec3(), high.as_dvec3())
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
    let fonts = out.fonts();
    let style = style(node, state, &fonts);
    let (mesh, laid) = typeset::ascii_text(strings(node), &style, widths);
    out.mesh(&mesh, false);
    if let Some((mut min, mut max)) = out.object_bounds {
        // Inventor's box begins where the line does and is as high as the font (Coin).
        (min.x, max.x) = (f64::from(laid.left), f64::from(laid.right));
        (min.y, max.y) = (f64::from(laid.bottom), f64::from(style.size));
        out.set_inventor_box(Some((min, max)));
    }
}

/// VRML 97's `Text`.
pub fn text97<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let fonts = out.fonts();
    let style = node
        .node_in("fontStyle")
        .map_or(Vrml97Style::DEFAULT, |f| style97(f, state, &fonts));
    let lengths = node.read::<[f32]>("length").unwrap_or(&[]);
    let most = node.read::<f32>("maxExtent").unwrap_or(0.0);
    let strings = strings(node);
    let mesh = typeset::vrml97_text(strings, &style, lengths, most, out.as_coin());
    out.set_sides(true, true, false);
    out.mesh(&mesh, false);
    if out.object_bounds.is_some() {
        let around = typeset::vrml97_bounds(strings, &style, lengths);
        let flat = |p: Vec2| p.extend(0.0).as_dvec3();
        out.set_inventor_box(around.map(|(low, high)| (flat(low), flat(high))));
    }
}

fn style97<'f>(node: NodeRef<'_>, state: &State<'_>, fonts: &'f Fonts) -> Vrml97Style<'f> {
    let flag = |name: &str| node.read::<bool>(name).unwrap_or(true);
    let families = node.read::<[String]>("family").unwrap_or(&[]);
    let style = node.read::<Text>("style").unwrap_or("PLAIN");
    Vrml97Style {
        face: Face::of_vrml97(families, style, fonts),
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
