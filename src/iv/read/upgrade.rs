//! Turns nodes of Inventor V1.0 and V2.0 and VRML 1.0 into V2.1, before anything else sees them.
//!
//! A field that V2.1 lacks is read by its old type and becomes the fields that replaced it.

use glam::{Vec2, Vec3};

use super::header::Header;
use crate::diag::Span;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    ClassId, Dialect, FieldType, class, environment, material, packed_color, shape_hints,
    texture_coordinate_plane, texture2_transform,
};
use crate::iv::document::{ClassRef, Document, FieldEntry, Node};

/// A field that a class had in an older version.
#[derive(Debug)]
pub(super) struct OldField {
    pub name: &'static str,
    pub kind: FieldType,
    pub names: &'static [(&'static str, i64)],
    into: fn(&mut Document, NodeId, &Value),
}

const fn old(
    name: &'static str,
    kind: FieldType,
    names: &'static [(&'static str, i64)],
    into: fn(&mut Document, NodeId, &Value),
) -> OldField {
    OldField {
        name,
        kind,
        names,
        into,
    }
}

fn forget(_: &mut Document, _: NodeId, _: &Value) {}

static OLD: [(ClassId, OldField); 13] = [
    (
        class::SHAPE_HINTS,
        old("hints", FieldType::SFBitMask, HINTS, hints),
    ),
    (
        class::PACKED_COLOR,
        old("rgba", FieldType::MFUInt32, &[], packed),
    ),
    (
        class::ENVIRONMENT,
        old("fogDensity", FieldType::SFFloat, &[], fog_density),
    ),
    (
        class::ENVIRONMENT,
        old("fogComputed", FieldType::SFEnum, PER, forget),
    ),
    (
        class::LIGHT_MODEL,
        old("nearColor", FieldType::SFColor, &[], forget),
    ),
    (
        class::LIGHT_MODEL,
        old("farColor", FieldType::SFColor, &[], forget),
    ),
    (
        class::TEXTURE2,
        old("minFilter", FieldType::SFEnum, FILTERS, forget),
    ),
    (
        class::TEXTURE2,
        old("magFilter", FieldType::SFEnum, FILTERS, forget),
    ),
    (
        class::TEXTURE2,
        old("component", FieldType::SFEnum, COMPONENTS, forget),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("coord", FieldType::SFEnum, COORDS, forget),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("normal", FieldType::SFVec3f, &[], forget),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("distanceFromOrigin", FieldType::SFFloat, &[], forget),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("repeatInterval", FieldType::SFFloat, &[], forget),
    ),
];

const HINTS: &[(&str, i64)] = &[("NONE", 0), ("SOLID", 1), ("ORDERED", 2), ("CONVEX", 4)];
const PER: &[(&str, i64)] = &[("PER_VERTEX", 0), ("PER_PIXEL", 1)];
const COORDS: &[(&str, i64)] = &[("S", 0), ("T", 1), ("ALL", 2)];
const COMPONENTS: &[(&str, i64)] = &[
    ("INTENSITY", 0),
    ("INTENSITY_ALPHA", 1),
    ("RGB", 2),
    ("RGBA", 3),
];
const FILTERS: &[(&str, i64)] = &[
    ("POINT", 0),
    ("BILINEAR", 1),
    ("MIPMAP_POINT", 2),
    ("MIPMAP_LINEAR", 3),
    ("MIPMAP_BILINEAR", 4),
    ("MIPMAP_TRILINEAR", 5),
];

/// Finds a field of an older version by name.
pub(super) fn old_field(class: ClassId, name: &str) -> Option<&'static OldField> {
    OLD.iter()
        .find(|(c, f)| *c == class && f.name == name)
        .map(|(_, f)| f)
}

/// The names that an enumeration had in older versions, as the values that replaced them.
pub(super) fn old_names(class: ClassId, index: u16) -> fn(&str) -> Option<i64> {
    match (class, class.get().fields[usize::from(index)].name) {
        (class::ENVIRONMENT, "fogType") => |name| match name {
            "LINEAR" => Some(1),
            "EXPONENTIAL_SQUARED" => Some(2),
            "EXPONENTIAL" => Some(3),
            _ => None,
        },
        (class::PICK_STYLE, "style") => |name| (name == "PICKABLE").then_some(0),
        // V2.1 has no depth cueing; what it colored is drawn in its own color.
        (class::LIGHT_MODEL, "model") => |name| (name == "DEPTH").then_some(0),
        _ => |_| None,
    }
}

/// Upgrades the nodes of one file, which are those from `first` on.
pub(super) fn upgrade(
    document: &mut Document,
    header: &Header,
    first: usize,
    old: Vec<(NodeId, &'static OldField, Value)>,
) {
    for (node, field, value) in &old {
        (field.into)(document, *node, value);
    }
    planes(document, &old);
    for i in first..document.nodes.len() {
        if document.nodes[i].class == ClassRef::Known(class::MATERIAL)
            && header.dialect == Dialect::IV1
        {
            shine(document, i);
        }
    }
}

fn state(document: &mut Document, node: usize, index: u16, value: Value) {
    let entry = FieldEntry {
        index,
        value,
        ignored: false,
        connection: None,
        span: Span::default(),
    };
    let fields = &mut document.nodes[node].fields;
    fields.retain(|f| f.index != index);
    fields.push(entry);
}

/// Removes the highlight of a material whose shininess is 0, as IRIS GL and so V1.0 did.
fn shine(document: &mut Document, node: usize) {
    let shininess = material::SHININESS.index;
    let field = document.nodes[node]
        .fields
        .iter()
        .find(|f| f.index == shininess);
    let dull = match field.map(|f| &f.value) {
        None => true,
        Some(Value::Floats(f)) => f.iter().all(|&n| n == 0.0),
        Some(_) => false,
    };
    if dull {
        state(
            document,
            node,
            material::SPECULAR_COLOR.index,
            Value::Vec3s(vec![Vec3::ZERO]),
        );
        document.nodes[node].fields.retain(|f| f.index != shininess);
    }
}

fn hints(document: &mut Document, node: NodeId, value: &Value) {
    let &Value::Int(bits) = value else { return };
    let node = node.0 as usize;
    let mut set = |index, n| state(document, node, index, Value::Int(n));
    if bits & 2 != 0 {
        set(
            shape_hints::VERTEX_ORDERING.index,
            shape_hints::VERTEX_ORDERING_COUNTERCLOCKWISE,
        );
    }
    if bits & 1 != 0 {
        set(shape_hints::SHAPE_TYPE.index, shape_hints::SHAPE_TYPE_SOLID);
    }
    let convex = bits & 4 != 0;
    let face = if convex {
        shape_hints::FACE_TYPE_CONVEX
    } else {
        shape_hints::FACE_TYPE_UNKNOWN_FACE_TYPE
    };
    set(shape_hints::FACE_TYPE.index, face);
}

/// `rgba` had its bytes in the other order: 0xaabbggrr.
fn packed(document: &mut Document, node: NodeId, value: &Value) {
    let Value::UInts(colors) = value else { return };
    let ordered = colors.iter().map(|c| c.swap_bytes()).collect();
    state(
        document,
        node.0 as usize,
        packed_color::ORDERED_RGBA.index,
        Value::UInts(ordered),
    );
}

fn fog_density(document: &mut Document, node: NodeId, value: &Value) {
    if let Value::Float(density) = value
        && *density > 0.0
    {
        let visibility = Value::Float(1.0 / density);
        state(
            document,
            node.0 as usize,
            environment::FOG_VISIBILITY.index,
            visibility,
        );
    }
}

/// Turns texture planes of V1.0 into directions. Such a plane gave one coordinate, by the distance
/// from it, and the other came from an earlier node. A coordinate that no node gives is as in SGI's
/// own upgrader: both follow the plane x = 0.
fn planes(document: &mut Document, old: &[(NodeId, &'static OldField, Value)]) {
    let is_plane = |id: NodeId| {
        let class = document.nodes[id.0 as usize].class;
        class == ClassRef::Known(class::TEXTURE_COORDINATE_PLANE)
    };
    let mut nodes: Vec<NodeId> = old.iter().map(|o| o.0).filter(|id| is_plane(*id)).collect();
    nodes.dedup();
    let (mut s, mut t) = (Vec3::X, Vec3::Y);
    for node in nodes {
        let stated = |name: &str| {
            let of = old.iter().find(|(id, f, _)| *id == node && f.name == name);
            of.map(|(_, _, value)| value)
        };
        let number = |name: &str, default: f32| match stated(name) {
            Some(&Value::Float(v)) => v,
            _ => default,
        };
        let normal = match stated("normal") {
            Some(Value::Vec3(n)) => n.normalize_or(Vec3::X),
            _ => Vec3::X,
        };
        let interval = number("repeatInterval", 1.0);
        let shift = number("distanceFromOrigin", 0.0) / interval;
        let which = match stated("coord") {
            Some(&Value::Int(which)) => which,
            _ => 2,
        };
        // The length of a direction is the interval at which the texture repeats.
        if which != 1 {
            s = normal * interval;
        }
        if which != 0 {
            t = normal * interval;
        }
        let (directions, index) = (texture_coordinate_plane::DIRECTION_S, node.0 as usize);
        state(document, index, directions.index, Value::Vec3(s));
        let directions = texture_coordinate_plane::DIRECTION_T;
        state(document, index, directions.index, Value::Vec3(t));
        if shift != 0.0 && shift.is_finite() {
            let by = Vec2::new(
                if which != 1 { shift } else { 0.0 },
                if which != 0 { shift } else { 0.0 },
            );
            shift_texture(document, node, by);
        }
    }
}

/// Puts a `Texture2Transform` after a node, wherever it is a child.
fn shift_texture(document: &mut Document, after: NodeId, by: Vec2) {
    let before = &document.nodes[after.0 as usize];
    let (span, source) = (before.span, before.source);
    let new = document.add(Node {
        class: ClassRef::Known(class::TEXTURE2_TRANSFORM),
        name: None,
        fields: Vec::new(),
        children: Vec::new(),
        span,
        source,
    });
    let index = texture2_transform::TRANSLATION.index;
    state(document, new.0 as usize, index, Value::Vec2(by));
    let lists = document.nodes.iter_mut().map(|n| &mut n.children);
    for list in lists {
        if list.contains(&after) {
            let with_new = |id: NodeId| std::iter::once(id).chain((id == after).then_some(new));
            *list = list.iter().copied().flat_map(with_new).collect();
        }
    }
}
