//! Draws text shapes, which `geometry::text` lays out.

use glam::{DVec3, Vec2, Vec3};
use ivcam_inventor::grammar::{
    ascii_text, font_style, linear_profile, text, text2, text2_set, text3, vrml97_font_style,
};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::State;
use ivcam_inventor::traversal::state::{Binding, ProfileCoordinates};

use super::screen_aligned;
use crate::geometry::text::{
    self as typeset, Face, Family, Fonts, Justify, Layout, MissingCharacters, SolidParts,
    TextOutput, TextStyle, Vrml97Style,
};
use crate::scene::canvas::{Canvas, MaterialsBy, Sides};

/// Returns the style of an Inventor text.
fn style<'f>(node: NodeRef<'_>, state: &State<'_>, fonts: &'f Fonts) -> TextStyle<'f> {
    let font = state.font;
    let face = if font.is_style {
        let family = match font.family {
            font_style::FAMILY_SANS => Family::Sans,
            font_style::FAMILY_TYPEWRITER => Family::Mono,
            _ => Family::Serif,
        };
        let bold = font.style & font_style::STYLE_BOLD != 0;
        let italic = font.style & font_style::STYLE_ITALIC != 0;
        Face::of_family(family, bold, italic, fonts)
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
        spacing: node.get(text3::SPACING),
        justify: justify(node.get(text3::JUSTIFICATION)),
        complexity: state.complexity.value,
    }
}

/// Returns the justification of a field value. All text classes use the same values.
fn justify(value: i32) -> Justify {
    match value {
        text3::JUSTIFICATION_RIGHT => Justify::Right,
        text3::JUSTIFICATION_CENTER => Justify::Center,
        _ => Justify::Left,
    }
}

/// Draws a `Text2`: text at the origin that faces the camera, with the font's size in pixels.
pub(super) fn text2<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let fonts = out.picture().fonts.clone();
    let text = typeset::pixel_text(node.get(text2::STRING), &style(node, state, &fonts));
    out.report_characters(node, &text.missing);
    let at = state.world_from_object.transform_point3(DVec3::ZERO);
    out.set_unlit();
    screen_aligned::pixels(at, &text, out);
    if text.has_ink() {
        out.bound(Vec3::ZERO);
    }
    if !out.wants().bounds {
        return;
    }
    let object_from_world = state.world_from_object.inverse();
    let around = screen_aligned::text_rectangle(at, &text, out);
    let corners = around.iter().flatten();
    let corners = corners.map(|&p| object_from_world.transform_point3(p));
    out.set_inventor_box(corners.fold(None, |all: Option<(DVec3, DVec3)>, p| {
        let (min, max) = all.unwrap_or((p, p));
        Some((min.min(p), max.max(p)))
    }));
}

/// Draws a `Text2Set`: a string at each of several points.
pub(super) fn text2_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let places = node.get(text2_set::POSITION);
    let sides = node.get(text2_set::JUSTIFICATION);
    let fonts = out.picture().fonts.clone();
    let plain = style(node, state, &fonts);
    let mut missing = MissingCharacters::default();
    for (i, line) in node.get(text2_set::STRING).iter().enumerate() {
        let Some(&place) = places.get(i).or(places.last()) else {
            break;
        };
        let side = sides.get(i).or(sides.last()).copied();
        let side = side.unwrap_or(text2_set::JUSTIFICATION_LEFT);
        let style = TextStyle {
            justify: justify(side),
            ..plain
        };
        let text = typeset::pixel_text(&[line], &style);
        missing.add(&text.missing);
        let at = state.world_from_object.transform_point3(place.as_dvec3());
        if text.has_ink() {
            out.bound(place);
        }
        out.set_unlit();
        screen_aligned::pixels(at, &text, out);
    }
    out.report_characters(node, &missing);
}

/// Draws a `Text3`.
pub(super) fn text3<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let parts = node.get(text3::PARTS);
    let parts = SolidParts {
        front: parts & text3::PARTS_FRONT != 0,
        sides: parts & text3::PARTS_SIDES != 0,
        back: parts & text3::PARTS_BACK != 0,
    };
    let profile = profile(state);
    let fonts = out.picture().fonts.clone();
    let style = style(node, state, &fonts);
    let materials = match state.material_binding {
        Binding::PerPart | Binding::PerPartIndexed => MaterialsBy::Part,
        _ => MaterialsBy::Vertex,
    };
    out.set_sides(Sides {
        two_sided: false,
        ..Sides::BOTH
    });
    let (strings, crease_angle) = (node.get(text3::STRING), state.hints.crease_angle);
    let laid = draw_glyphs(out, materials, |output| {
        let profile = profile.as_deref();
        typeset::text3(strings, &style, parts, profile, crease_angle, output)
    });
    report_losses(node, &laid, out);
    if out.inventor_box().is_some() {
        out.set_inventor_box(Some(text3_box(&laid, parts, profile.as_deref())));
    }
}

/// Draws a text glyph by glyph, or in batches, depending on the canvas.
fn draw_glyphs(
    out: &mut dyn Canvas,
    materials: MaterialsBy,
    text: impl FnOnce(TextOutput<'_>) -> Layout,
) -> Layout {
    if out.takes_glyphs() {
        text(TextOutput::Glyphs(&mut |number, mesh, at| {
            out.glyph((number, mesh), at, materials);
        }))
    } else {
        text(TextOutput::Batches(&mut |mesh| out.mesh(mesh, materials)))
    }
}

/// Reports that a text has more characters than are drawn, and characters that are not drawn as
/// written.
fn report_losses(node: NodeRef<'_>, laid: &Layout, out: &mut dyn Canvas) {
    out.report_characters(node, &laid.missing);
    if laid.is_cut {
        let most = typeset::MAX_GLYPHS;
        let what = format!("it has more than {most} characters, and the rest is left out");
        out.report_part(node, &what);
    }
}

/// Returns Inventor's box of a `Text3`. It contains the advances of the lines and not their
/// outlines. It is one unit deep if the text is solid, and is extended by the profile whatever the
/// parts (Coin).
fn text3_box(laid: &Layout, parts: SolidParts, profile: Option<&[Vec2]>) -> (DVec3, DVec3) {
    let points = profile.unwrap_or(&[]);
    let out_by = points.iter().map(|p| p.y).fold(0.0, f32::max);
    let depths = points.iter().map(|p| -p.x);
    let fore = depths.clone().fold(0.0, f32::max);
    let flat = profile.is_none() && parts == SolidParts::FRONT;
    let deep = depths.fold(if flat { 0.0 } else { -1.0 }, f32::min);
    let low = Vec3::new(laid.left - out_by, laid.bottom - out_by, deep);
    let high = Vec3::new(laid.right + out_by, laid.top + out_by, fore);
    (low.as_dvec3(), high.as_dvec3())
}

/// Returns the points of the current profiles, in order, as one polyline.
fn profile(state: &State<'_>) -> Option<Vec<Vec2>> {
    let mut line: Vec<Vec2> = Vec::new();
    for profile in state.profiles.iter() {
        let index = profile.node.get(linear_profile::INDEX);
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

/// Draws an `AsciiText`.
pub(super) fn ascii_text<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let widths = node.get(ascii_text::WIDTH);
    let fonts = out.picture().fonts.clone();
    let style = style(node, state, &fonts);
    let strings = node.get(ascii_text::STRING);
    let laid = draw_glyphs(out, MaterialsBy::Vertex, |output| {
        typeset::ascii_text(strings, &style, widths, output)
    });
    report_losses(node, &laid, out);
    if let Some((mut min, mut max)) = out.inventor_box() {
        // Inventor's box begins at the beginning of the line, and its height is the font's size
        // (Coin).
        (min.x, max.x) = (f64::from(laid.left), f64::from(laid.right));
        (min.y, max.y) = (f64::from(laid.bottom), f64::from(style.size));
        out.set_inventor_box(Some((min, max)));
    }
}

/// Draws a `Text` of VRML 97.
pub(super) fn text97<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let fonts = out.picture().fonts.clone();
    let plain = || Vrml97Style {
        face: Face::DEFAULT.with_fonts(&fonts),
        ..Vrml97Style::DEFAULT
    };
    let style = node
        .get_node(text::FONT_STYLE)
        .map_or_else(plain, |f| style97(f, state, &fonts));
    let lengths = node.get(text::LENGTH);
    let most = node.get(text::MAX_EXTENT);
    let strings = node.get(text::STRING);
    out.set_sides(Sides::of_solid(node.get(text::SOLID), true));
    let laid = draw_glyphs(out, MaterialsBy::Vertex, |output| {
        typeset::vrml97_text(strings, &style, lengths, most, output)
    });
    report_losses(node, &laid, out);
    if out.inventor_box().is_some() {
        let around = typeset::vrml97_bounds(strings, &style, lengths);
        let flat = |p: Vec2| p.extend(0.0).as_dvec3();
        out.set_inventor_box(around.map(|(low, high)| (flat(low), flat(high))));
    }
}

/// Returns the style of a `FontStyle` of VRML 97.
fn style97<'f>(node: NodeRef<'_>, state: &State<'_>, fonts: &'f Fonts) -> Vrml97Style<'f> {
    let families = node.get(vrml97_font_style::FAMILY);
    let style = node.get(vrml97_font_style::STYLE);
    Vrml97Style {
        face: Face::of_vrml97(families, style, fonts),
        size: node.get(vrml97_font_style::SIZE),
        spacing: node.get(vrml97_font_style::SPACING),
        horizontal: node.get(vrml97_font_style::HORIZONTAL),
        left_to_right: node.get(vrml97_font_style::LEFT_TO_RIGHT),
        top_to_bottom: node.get(vrml97_font_style::TOP_TO_BOTTOM),
        complexity: state.complexity.value,
        ..Vrml97Style::DEFAULT
    }
    .justified(node.get(vrml97_font_style::JUSTIFY))
}
