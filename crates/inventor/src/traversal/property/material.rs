//! Materials, and how they are distributed over a shape.

use glam::Vec3;

use crate::grammar::value::Value;
use crate::grammar::{
    Field, base_color, class, light_model, locate_highlight, material, material_binding,
    packed_color,
};
use crate::iv::NodeRef;
use crate::traversal::state::{Binding, Diffuse, Highlight, Language, List, State};

/// Applies a `Material`; empty fields change nothing. In VRML 1.0 one of emissive colors alone is
/// not lit.
pub(super) fn material<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.material_node = Some(node);
    let language = state.language;
    let colors = |field: Field<[Vec3]>| node.acting(field).filter(|c| !c.is_empty());
    let numbers = |field: Field<[f32]>| node.acting(field).filter(|c| !c.is_empty());
    let m = &mut state.material;
    if let Some(c) = colors(material::AMBIENT_COLOR) {
        m.ambient = c[0];
    }
    if let Some(c) = colors(material::DIFFUSE_COLOR) {
        if let Diffuse::Packed(_) = m.diffuse {
            m.transparency = List::One(0.0); // the packed colors contained it
        }
        m.diffuse = Diffuse::Colors(List::Many(c));
    }
    if let Some(c) = colors(material::SPECULAR_COLOR) {
        m.specular = c[0];
    }
    if let Some(c) = colors(material::EMISSIVE_COLOR) {
        m.emissive = c[0];
    }
    let computed = node
        .computed_colors()
        .filter(|_| language == Language::Vrml1);
    m.is_unlit = computed.is_some();
    if let Some(colors) = computed {
        m.diffuse = Diffuse::Colors(List::Many(colors));
    }
    if let Some(c) = numbers(material::SHININESS) {
        m.shininess = c[0];
    }
    if let Some(c) = numbers(material::TRANSPARENCY) {
        m.transparency = List::Many(c);
    }
    // Files declare this extension field, so that other programs can read them.
    let refraction = match node.value("refractionIndex") {
        Some(Value::Float(n)) => Some(*n),
        Some(Value::Floats(list)) => list.first().copied(),
        _ => None,
    };
    m.refraction = refraction
        .filter(|n| n.is_finite() && *n > 0.0)
        .unwrap_or(1.0);
}

/// Applies a `BaseColor`; an empty one changes nothing.
pub(super) fn base_color<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(c) = node.acting(base_color::RGB).and_then(List::of) {
        state.material.diffuse = Diffuse::Colors(c);
        state.material_node = Some(node);
    }
}

/// Applies a `PackedColor`; an empty one changes nothing.
pub(super) fn packed_color<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let colors = node.acting(packed_color::ORDERED_RGBA);
    if let Some(c) = colors.filter(|c| !c.is_empty()) {
        state.material.diffuse = Diffuse::Packed(c);
        state.material_node = Some(node);
    }
}

/// Applies a `MaterialBinding`.
pub(super) fn material_binding<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(value) = node.acting(material_binding::VALUE) {
        state.material_binding = Binding::from_value(value, Binding::Overall);
    }
}

/// Applies a `LightModel`.
pub(super) fn light_model<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(model) = node.acting(light_model::MODEL) {
        state.base_color = model == light_model::MODEL_BASE_COLOR;
    }
}

/// Returns the highlight of a `LocateHighlight` whose mode is `ON`. Other modes depend on a cursor.
pub(in crate::traversal) fn highlight(node: NodeRef<'_>) -> Option<Highlight> {
    let is_highlight = node.known_class()?.descends_from(class::LOCATE_HIGHLIGHT);
    let is_on = is_highlight && node.get(locate_highlight::MODE) == locate_highlight::MODE_ON;
    is_on.then(|| Highlight {
        color: node.get(locate_highlight::COLOR),
        diffuse_too: node.get(locate_highlight::STYLE) == locate_highlight::STYLE_EMISSIVE_DIFFUSE,
    })
}
