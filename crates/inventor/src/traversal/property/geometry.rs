//! Properties of geometry and drawing: coordinates, normals, hints, styles, fonts and profiles.

use std::sync::Arc;

use crate::grammar::{
    class, complexity, coordinate3, coordinate4, draw_style, font, font_style, normal,
    normal_binding, polygon_offset, profile, profile_coordinate2, profile_coordinate3, shape_hints,
    vertex_property,
};
use crate::iv::{CREASE_ANGLE, NodeRef};
use crate::traversal::state::{
    Binding, Complexity, Coordinates, Diffuse, DrawStyle, FontElement, Language,
    ProfileCoordinates, ProfileElement, State, TextureCoordinates, VertexOrdering,
};

/// Applies a `Normal`.
pub(super) fn normal<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting(normal::VECTOR) {
        state.normals = v;
    }
}

/// Applies a `NormalBinding`.
pub(super) fn normal_binding<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(value) = node.acting(normal_binding::VALUE) {
        state.normal_binding = Binding::from_value(value, Binding::PerVertexIndexed);
    }
}

/// Applies a `Coordinate3`.
pub(super) fn coordinate3<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(p) = node.acting(coordinate3::POINT) {
        state.coordinates = Coordinates::Three(p);
    }
}

/// Applies a `Coordinate4`.
pub(super) fn coordinate4<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(p) = node.acting(coordinate4::POINT) {
        state.coordinates = Coordinates::Four(p);
    }
}

/// Applies a `VertexProperty`, which is a node of the scene or in a shape's field. Empty fields
/// change nothing.
pub fn vertex_property<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let points = node.acting(vertex_property::VERTEX);
    if let Some(p) = points.filter(|p| !p.is_empty()) {
        state.coordinates = Coordinates::Three(p);
    }
    let normals = node.acting(vertex_property::NORMAL);
    if let Some(v) = normals.filter(|v| !v.is_empty()) {
        state.normals = v;
        if let Some(value) = node.acting(vertex_property::NORMAL_BINDING) {
            state.normal_binding = Binding::from_value(value, Binding::PerVertexIndexed);
        }
    }
    let colors = node.acting(vertex_property::ORDERED_RGBA);
    if let Some(c) = colors.filter(|c| !c.is_empty()) {
        state.material.diffuse = Diffuse::Packed(c);
        if let Some(value) = node.acting(vertex_property::MATERIAL_BINDING) {
            state.material_binding = Binding::from_value(value, Binding::Overall);
        }
    }
    let three = node.acting(vertex_property::TEX_COORD3);
    let two = node.acting(vertex_property::TEX_COORD);
    if let Some(t) = three.filter(|t| !t.is_empty()) {
        state.texture_coordinates = TextureCoordinates::Three(t);
    } else if let Some(t) = two.filter(|t| !t.is_empty()) {
        state.texture_coordinates = TextureCoordinates::Two(t);
    }
}

/// Applies a `ShapeHints`.
pub(super) fn shape_hints<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting(shape_hints::VERTEX_ORDERING) {
        state.hints.ordering = match v {
            shape_hints::VERTEX_ORDERING_CLOCKWISE => VertexOrdering::Clockwise,
            shape_hints::VERTEX_ORDERING_COUNTERCLOCKWISE => VertexOrdering::Counterclockwise,
            _ => VertexOrdering::Unknown,
        };
    }
    if let Some(v) = node.acting(shape_hints::SHAPE_TYPE) {
        state.hints.solid = v == shape_hints::SHAPE_TYPE_SOLID;
    }
    if let Some(v) = node.acting(shape_hints::FACE_TYPE) {
        state.hints.convex = v == shape_hints::FACE_TYPE_CONVEX;
    }
    if let Some(v) = node.acting(shape_hints::CREASE_ANGLE) {
        // The default of VRML 1.0 is not Inventor's.
        let is_default = node.class_id() == Some(class::SHAPE_HINTS)
            && node.entry(shape_hints::CREASE_ANGLE.index).is_none();
        let is_vrml1 = state.language == Language::Vrml1;
        state.hints.crease_angle = if is_default && is_vrml1 {
            CREASE_ANGLE
        } else {
            v
        };
    }
}

/// Applies a `Complexity`.
pub(super) fn complexity<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let old = state.complexity;
    let quality = node.acting(complexity::TEXTURE_QUALITY);
    state.complexity = Complexity {
        value: node.acting(complexity::VALUE).unwrap_or(old.value),
        kind: node.acting(complexity::TYPE).or(old.kind),
        texture_quality: quality.unwrap_or(old.texture_quality),
    };
}

/// Applies a `DrawStyle`.
pub(super) fn draw_style<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting(draw_style::STYLE) {
        state.drawing.style = match v {
            draw_style::STYLE_LINES => DrawStyle::Lines,
            draw_style::STYLE_POINTS => DrawStyle::Points,
            draw_style::STYLE_INVISIBLE => DrawStyle::Invisible,
            _ => DrawStyle::Filled,
        };
    }
    if let Some(v) = node.acting(draw_style::LINE_WIDTH) {
        state.drawing.line_width = v;
    }
    if let Some(v) = node.acting(draw_style::POINT_SIZE) {
        state.drawing.point_size = v;
    }
    if let Some(v) = node.acting(draw_style::LINE_PATTERN) {
        state.drawing.line_pattern = v;
    }
    if let Some(v) = node.acting(draw_style::LINE_PATTERN_SCALE_FACTOR) {
        // OpenGL clamps the factor to this range.
        state.drawing.line_pattern_scale = v.clamp(1, 256) as u16;
    }
}

/// Applies a `PolygonOffset`. OpenGL moves faces in depth by the factor times their slope plus
/// units of the depth buffer's resolution. Only the sign is kept; it decides which of two shapes in
/// the same plane is visible.
pub(super) fn polygon_offset<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let factor = node.acting_or_default(polygon_offset::FACTOR);
    let units = node.acting_or_default(polygon_offset::UNITS);
    let farther = if factor == 0.0 { units } else { factor };
    let on = node.acting_or_default(polygon_offset::ON);
    state.drawing.offset = match farther {
        _ if !on => 0,
        f if f > 0.0 => 1,
        f if f < 0.0 => -1,
        _ => 0,
    };
    state.drawing.offset_styles = node.acting_or_default(polygon_offset::STYLES);
}

/// Applies a `Font`.
pub(super) fn font<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let old = state.font;
    state.font = FontElement {
        name: node.acting(font::NAME).unwrap_or(old.name),
        size: node.acting(font::SIZE).unwrap_or(old.size),
        is_style: false,
        ..old
    };
}

/// Applies a `FontStyle`.
pub(super) fn font_style<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let family = node.acting_or_default(font_style::FAMILY);
    state.font = FontElement {
        name: match family {
            font_style::FAMILY_SANS => "Helvetica",
            font_style::FAMILY_TYPEWRITER => "Courier",
            _ => "Times",
        },
        size: node.acting_or_default(font_style::SIZE),
        is_style: true,
        family,
        style: node.acting_or_default(font_style::STYLE),
    };
}

/// Adds a profile, or begins a new list of profiles.
pub(super) fn profile<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let entry = ProfileElement {
        node,
        coordinates: state.profile_coordinates,
    };
    let profiles = Arc::make_mut(&mut state.profiles);
    if node.acting_or_default(profile::LINKAGE) == profile::LINKAGE_START_FIRST {
        profiles.clear();
    }
    profiles.push(entry);
}

/// Applies a `ProfileCoordinate2`.
pub(super) fn profile_coordinate2<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(points) = node.acting(profile_coordinate2::POINT) {
        state.profile_coordinates = ProfileCoordinates::Two(points);
    }
}

/// Applies a `ProfileCoordinate3`.
pub(super) fn profile_coordinate3<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(points) = node.acting(profile_coordinate3::POINT) {
        state.profile_coordinates = ProfileCoordinates::Three(points);
    }
}
