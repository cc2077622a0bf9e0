//! Converts nodes of Inventor V1.0, Inventor V2.0 and VRML 1.0 to V2.1, directly after reading, and
//! states what depends on the version of X3D.
//!
//! A field that V2.1 does not have is read with its old type and replaced by the newer fields.

use std::collections::HashMap;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec3};
use ivcam_base::diag::Span;

use super::header::Header;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    ClassId, Dialect, FieldType, class, environment, light_model, material, packed_color,
    shape_hints, texture_coordinate_plane, texture2_transform, vrml97_spot_light as spot97,
};
use crate::iv::document::{ClassRef, Document, FieldEntry, Node};

/// A field that a class had in an older version.
#[derive(Debug)]
pub(super) struct OldField {
    /// The name of the field.
    pub name: &'static str,
    /// The type of its values.
    pub kind: FieldType,
    /// The names of its enumeration values.
    pub names: &'static [(&'static str, i64)],
    /// Sets the fields of the node that replace it.
    into: fn(&mut Document, NodeId, &Value),
}

/// Makes an entry of [`OLD_FIELDS`].
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

/// Ignores a field that has no replacement, or that [`upgrade_texture_planes`] handles.
fn discard(_: &mut Document, _: NodeId, _: &Value) {}

/// The fields that V2.1 does not have, with the classes that had them.
static OLD_FIELDS: [(ClassId, OldField); 13] = [
    (
        class::SHAPE_HINTS,
        old("hints", FieldType::SFBitMask, HINTS, upgrade_hints),
    ),
    (
        class::PACKED_COLOR,
        old("rgba", FieldType::MFUInt32, &[], reorder_packed_colors),
    ),
    (
        class::ENVIRONMENT,
        old("fogDensity", FieldType::SFFloat, &[], upgrade_fog_density),
    ),
    (
        class::ENVIRONMENT,
        old("fogComputed", FieldType::SFEnum, FOG_COMPUTED, discard),
    ),
    (
        class::LIGHT_MODEL,
        old("nearColor", FieldType::SFColor, &[], discard),
    ),
    (
        class::LIGHT_MODEL,
        old("farColor", FieldType::SFColor, &[], discard),
    ),
    (
        class::TEXTURE2,
        old("minFilter", FieldType::SFEnum, FILTERS, discard),
    ),
    (
        class::TEXTURE2,
        old("magFilter", FieldType::SFEnum, FILTERS, discard),
    ),
    (
        class::TEXTURE2,
        old("component", FieldType::SFEnum, COMPONENTS, discard),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("coord", FieldType::SFEnum, COORDS, discard),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("normal", FieldType::SFVec3f, &[], discard),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("distanceFromOrigin", FieldType::SFFloat, &[], discard),
    ),
    (
        class::TEXTURE_COORDINATE_PLANE,
        old("repeatInterval", FieldType::SFFloat, &[], discard),
    ),
];

const HINTS: &[(&str, i64)] = &[("NONE", 0), ("SOLID", 1), ("ORDERED", 2), ("CONVEX", 4)];
const FOG_COMPUTED: &[(&str, i64)] = &[("PER_VERTEX", 0), ("PER_PIXEL", 1)];
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

/// The number of V1.0's light model `DEPTH`, which V2.1 does not have.
const DEPTH: i32 = i32::MIN;

/// Returns today's name of a class that V1.0 named otherwise. A `LayerGroup` restores the state
/// after its children.
pub(super) fn renamed_class(name: &str) -> Option<&'static str> {
    match name {
        "IndexedTriangleMesh" => Some("IndexedTriangleStripSet"),
        "LayerGroup" => Some("Separator"),
        _ => None,
    }
}

/// Finds a field of an older version by name.
pub(super) fn old_field(class: ClassId, name: &str) -> Option<&'static OldField> {
    OLD_FIELDS
        .iter()
        .find(|(c, f)| *c == class && f.name == name)
        .map(|(_, f)| f)
}

/// Returns a function that maps the old names of an enumeration's values to the current values.
pub(super) fn old_names(class: ClassId, index: u16) -> fn(&str) -> Option<i64> {
    match (class, class.get().fields[usize::from(index)].name) {
        (class::ENVIRONMENT, "fogType") => |name| match name {
            "LINEAR" => Some(1),
            "EXPONENTIAL_SQUARED" => Some(2),
            "EXPONENTIAL" => Some(3),
            _ => None,
        },
        (class::PICK_STYLE, "style") => |name| (name == "PICKABLE").then_some(0),
        // `replace_depth_cueing` replaces the node.
        (class::LIGHT_MODEL, "model") => |name| (name == "DEPTH").then_some(DEPTH.into()),
        _ => |_| None,
    }
}

/// Upgrades the nodes of one file, which begin at index `first`.
pub(super) fn upgrade(
    document: &mut Document,
    header: &Header,
    first: usize,
    old: Vec<(NodeId, &'static OldField, Value)>,
) {
    for (node, field, value) in &old {
        (field.into)(document, *node, value);
    }
    upgrade_texture_planes(document, &old);
    for i in first..document.nodes.len() {
        if document.nodes[i].class == ClassRef::Known(class::MATERIAL)
            && header.dialect == Dialect::IV1
        {
            remove_dull_highlight(document, i);
        }
    }
    replace_depth_cueing(document, first, &old);
    if header.is_x3d() {
        state_spot_angles(document, first, header.version);
    }
}

/// States the angles of the `SpotLight`s of X3D that a file does not state, because they depend on
/// its version: X3D 3.3 exchanged those of VRML97.
fn state_spot_angles(document: &mut Document, first: usize, version: (u8, u8)) {
    let spot = ClassRef::Known(class::VRML97_SPOT_LIGHT);
    let [beam, end] = match version >= (3, 3) {
        true => [FRAC_PI_4, FRAC_PI_2],
        false => [FRAC_PI_2, FRAC_PI_4],
    };
    let angles = [
        (spot97::BEAM_WIDTH.index, beam),
        (spot97::CUT_OFF_ANGLE.index, end),
    ];
    for node in first..document.nodes.len() {
        for (index, angle) in angles {
            let Node { class, fields, .. } = &document.nodes[node];
            if *class == spot && fields.iter().all(|field| field.index != index) {
                set_field(document, node, index, Value::Float(angle));
            }
        }
    }
}

/// Sets a field of a node and replaces an earlier value.
fn set_field(document: &mut Document, node: usize, index: u16, value: Value) {
    let entry = FieldEntry::new(index, value, Span::default());
    let fields = &mut document.nodes[node].fields;
    fields.retain(|f| f.index != index);
    fields.push(entry);
}

/// Removes the highlight of a material whose shininess is 0. IRIS GL drew none, so V1.0 did not
/// either.
fn remove_dull_highlight(document: &mut Document, node: usize) {
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
        set_field(
            document,
            node,
            material::SPECULAR_COLOR.index,
            Value::Vec3s(vec![Vec3::ZERO]),
        );
        document.nodes[node].fields.retain(|f| f.index != shininess);
    }
}

/// Replaces each `LightModel` with the model `DEPTH` by an `Environment` with haze of its
/// `farColor`, as SGI's upgrader does. The haze is complete at the far plane.
fn replace_depth_cueing(
    document: &mut Document,
    first: usize,
    old: &[(NodeId, &'static OldField, Value)],
) {
    let far_color = old.iter().filter(|(_, field, _)| field.name == "farColor");
    let colors: HashMap<NodeId, &Value> = far_color.map(|(id, _, color)| (*id, color)).collect();
    let (kind, model) = (
        ClassRef::Known(class::LIGHT_MODEL),
        light_model::MODEL.index,
    );
    for i in first..document.nodes.len() {
        let node = &mut document.nodes[i];
        let is_depth = |f: &FieldEntry| f.index == model && f.value == Value::Int(DEPTH);
        if node.class != kind || !node.fields.iter().any(is_depth) {
            continue;
        }
        node.class = ClassRef::Known(class::ENVIRONMENT);
        node.fields.clear();
        let haze = Value::Int(environment::FOG_TYPE_HAZE);
        set_field(document, i, environment::FOG_TYPE.index, haze);
        let color = colors.get(&NodeId(i as u32)).copied().cloned();
        let color = color.unwrap_or(Value::Vec3(Vec3::ZERO));
        set_field(document, i, environment::FOG_COLOR.index, color);
    }
}

/// Replaces the bit mask `hints` of a `ShapeHints` by the three fields of V2.0.
fn upgrade_hints(document: &mut Document, node: NodeId, value: &Value) {
    let &Value::Int(bits) = value else { return };
    let node = node.0 as usize;
    let mut set = |index, n| set_field(document, node, index, Value::Int(n));
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

/// Replaces `rgba` by `orderedRGBA`. The bytes of `rgba` were in the order 0xaabbggrr.
fn reorder_packed_colors(document: &mut Document, node: NodeId, value: &Value) {
    let Value::UInts(colors) = value else { return };
    let ordered = colors.iter().map(|c| c.swap_bytes()).collect();
    set_field(
        document,
        node.0 as usize,
        packed_color::ORDERED_RGBA.index,
        Value::UInts(ordered),
    );
}

/// Replaces the fog density of an `Environment` by the visibility, as SGI's upgrader does: 2 over
/// the density for `EXPONENTIAL`, which is `SMOKE` today, and 4 over it for the other types.
fn upgrade_fog_density(document: &mut Document, node: NodeId, value: &Value) {
    if let Value::Float(density) = value
        && *density > 0.0
    {
        let fields = &document.nodes[node.0 as usize].fields;
        let fog_type = environment::FOG_TYPE.index;
        let smoke = Value::Int(environment::FOG_TYPE_SMOKE);
        let is_smoke = fields
            .iter()
            .any(|f| f.index == fog_type && f.value == smoke);
        let visibility = Value::Float(if is_smoke { 2.0 } else { 4.0 } / density);
        set_field(
            document,
            node.0 as usize,
            environment::FOG_VISIBILITY.index,
            visibility,
        );
    }
}

/// Replaces the texture planes of V1.0 by directions. Such a plane determined one coordinate as the
/// distance from it, and an earlier node determined the other one. For a coordinate without a node
/// the result is that of SGI's upgrader: both follow the plane x = 0.
fn upgrade_texture_planes(document: &mut Document, old: &[(NodeId, &'static OldField, Value)]) {
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
        // The texture repeats after an interval, so the coordinate grows by 1 in each (SGI's
        // SoV1TextureCoordinatePlane).
        let direction = if interval == 0.0 {
            normal
        } else {
            normal / interval
        };
        if which != 1 {
            s = direction;
        }
        if which != 0 {
            t = direction;
        }
        let (directions, index) = (texture_coordinate_plane::DIRECTION_S, node.0 as usize);
        set_field(document, index, directions.index, Value::Vec3(s));
        let directions = texture_coordinate_plane::DIRECTION_T;
        set_field(document, index, directions.index, Value::Vec3(t));
        if shift != 0.0 && shift.is_finite() {
            let by = Vec2::new(
                if which != 1 { shift } else { 0.0 },
                if which != 0 { shift } else { 0.0 },
            );
            shift_texture(document, node, by);
        }
    }
}

/// Inserts a `Texture2Transform` after a node in every list of children that contains it.
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
    set_field(document, new.0 as usize, index, Value::Vec2(by));
    let lists = document.nodes.iter_mut().map(|n| &mut n.children);
    for list in lists {
        if list.contains(&after) {
            let with_new = |id: NodeId| std::iter::once(id).chain((id == after).then_some(new));
            *list = list.iter().copied().flat_map(with_new).collect();
        }
    }
}
