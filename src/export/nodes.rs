//! Builds a document node by node, for the formats that are graphs of Inventor's or VRML's nodes.

use glam::{DAffine3, DQuat, DVec3};
use ivcam_base::diag::Span;
use ivcam_inventor::grammar::value::{Image as ImageValue, NodeId, Rotation, Value};
use ivcam_inventor::grammar::{Class, by_name};
use ivcam_inventor::iv::{Connection, Document, FieldEntry, Node};
use ivcam_render::scene::model::{Image, Model, SceneNode};

use super::names::Names;
use super::trs::split;

/// Nodes without a name and a matrix get no group of their own if they have fewer children.
const UNGROUPED: usize = 64;

/// Whether a node of a model needs a group of its own around its shapes and children. `moves` says
/// whether it has a matrix.
pub(super) fn needs_group(node: &SceneNode, moves: bool, members: usize) -> bool {
    members > 0 && (node.place.name.is_some() || moves || members >= UNGROUPED)
}

/// Returns the nodes of a model's root. `make` gets a node of the model with what was made of its
/// children.
pub(super) fn tree_of(
    model: &Model,
    mut make: impl FnMut(&SceneNode, Vec<NodeId>) -> Vec<NodeId>,
) -> Vec<NodeId> {
    let mut items: Vec<Vec<NodeId>> = vec![Vec::new(); model.nodes.len()];
    // Children follow their parents in the model, so the last node comes first.
    for (i, node) in model.nodes.iter().enumerate().rev() {
        let children = node
            .children
            .iter()
            .map(|&child| std::mem::take(&mut items[child]));
        let children = children.flatten().collect();
        items[i] = make(node, children);
    }
    items.into_iter().next().unwrap_or_default()
}

/// A document that grows by one node at a time.
pub(super) struct NodeBuilder {
    /// The document so far, without roots. Names are those that are wanted.
    document: Document,
    /// The dialects whose classes the nodes have.
    dialects: u8,
}

impl NodeBuilder {
    /// Creates an empty document with the words after `#` of its first line and the dialects of its
    /// classes.
    pub(super) fn new(format: &str, dialects: u8) -> Self {
        let mut document = Document::default();
        document.format = format.to_owned();
        Self { document, dialects }
    }

    /// Adds a node with some fields. Fields with their defaults are left out.
    pub(super) fn node(&mut self, class: &str, fields: Vec<(&str, Value)>) -> NodeId {
        self.group(class, fields, Vec::new())
    }

    /// Adds a node with some fields and children. Fields with their defaults are left out.
    pub(super) fn group(
        &mut self,
        class: &str,
        fields: Vec<(&str, Value)>,
        children: Vec<NodeId>,
    ) -> NodeId {
        let class = by_name(class, self.dialects).expect("a class of the dialects");
        let entries = fields.into_iter().map(|field| entry(class, field));
        let stated = entries.filter(|(_, is_default)| !is_default);
        let fields = stated.map(|(entry, _)| entry).collect();
        self.document.add(Node::synthetic(class, fields, children))
    }

    /// Adds a node with one field, which is written even if it has its default.
    pub(super) fn stated(&mut self, class: &str, field: (&str, Value)) -> NodeId {
        let class = by_name(class, self.dialects).expect("a class of the dialects");
        let fields = vec![entry(class, field).0];
        self.document
            .add(Node::synthetic(class, fields, Vec::new()))
    }

    /// Adds a node whose field is connected to a field of another node.
    pub(super) fn connected(
        &mut self,
        class: &str,
        field: &str,
        from: NodeId,
        output: &str,
    ) -> NodeId {
        let class = by_name(class, self.dialects).expect("a class of the dialects");
        let (_, decl) = class.field(field).expect("a field of the class");
        let (mut entry, _) = entry(class, (field, Value::default_of(decl)));
        entry.connection = Some(Box::new(Connection {
            from,
            output: output.into(),
        }));
        self.document
            .add(Node::synthetic(class, vec![entry], Vec::new()))
    }

    /// Gives a node a name, which gets a number behind it if a node before it in the file has it.
    pub(super) fn name(&mut self, id: NodeId, wanted: &str) {
        self.document.nodes[id.0 as usize].name = Some(wanted.into());
    }

    /// Names a node that is used again, unless it has a name.
    pub(super) fn share(&mut self, id: NodeId, wanted: &str) -> NodeId {
        if self.document.nodes[id.0 as usize].name.is_none() {
            self.name(id, wanted);
        }
        id
    }

    /// Returns the document with its roots and with names that are different from each other: of
    /// equal ones the first in the file is as it was wanted.
    pub(super) fn finish(self, roots: Vec<NodeId>) -> Document {
        let mut document = self.document;
        let mut names = Names::apart_from(&RESERVED);
        let mut is_named = vec![false; document.nodes.len()];
        // Files may nest deeper than recursion allows.
        let mut open: Vec<NodeId> = roots.iter().rev().copied().collect();
        while let Some(id) = open.pop() {
            if std::mem::replace(&mut is_named[id.0 as usize], true) {
                continue;
            }
            let node = &mut document.nodes[id.0 as usize];
            node.name = node.name.take().map(|name| names.identifier(&name).into());
            let held = node.fields.iter().flat_map(|field| match &field.value {
                Value::Node(Some(id)) => std::slice::from_ref(id),
                Value::Nodes(list) => list,
                _ => &[],
            });
            let inner: Vec<NodeId> = held.chain(&node.children).copied().collect();
            open.extend(inner.into_iter().rev());
        }
        document.roots = roots;
        document
    }
}

/// The words that VRML97 keeps to itself (A.3), of which most are Inventor's too.
const RESERVED: [&str; 14] = [
    "DEF",
    "EXTERNPROTO",
    "FALSE",
    "IS",
    "NULL",
    "PROTO",
    "ROUTE",
    "TO",
    "TRUE",
    "USE",
    "eventIn",
    "eventOut",
    "exposedField",
    "field",
];

/// Returns the entry of a field, and whether its value is the default.
fn entry(class: &'static Class, (name, value): (&str, Value)) -> (FieldEntry, bool) {
    let (index, decl) = class.field(name).expect("a field of the class");
    let is_default = value == Value::default_of(decl);
    (
        FieldEntry::new(index as u16, value, Span::default()),
        is_default,
    )
}

/// Returns the fields of a `Transform`, whose matrix is T · R · O · S · O⁻¹ with the scale
/// orientation O. A matrix that shears is T · U · S · V, so that O is V⁻¹ and R is U · V. `scale`
/// is the name of the field with the scale.
pub(super) fn transform_fields(
    matrix: &DAffine3,
    scale: &'static str,
) -> Vec<(&'static str, Value)> {
    let parts = split(matrix);
    let inner = parts.inner.unwrap_or(DQuat::IDENTITY);
    vec![
        ("translation", vec3(parts.outer.translation)),
        ("rotation", rotation(parts.outer.rotation * inner)),
        (scale, vec3(parts.outer.scale)),
        ("scaleOrientation", rotation(inner.inverse())),
    ]
}

/// Returns a picture as the value of a field, whose rows run from the bottom.
pub(super) fn pixels(image: &Image) -> ImageValue {
    let kept: &[usize] = match image.components {
        1 => &[0],
        2 => &[0, 3],
        3 => &[0, 1, 2],
        _ => &[0, 1, 2, 3],
    };
    let rows = image.pixels.chunks(image.width.max(1) as usize).rev();
    let bytes = rows
        .flatten()
        .flat_map(|pixel| kept.iter().map(|&i| pixel[i]));
    ImageValue {
        width: image.width,
        height: image.height,
        depth: 1,
        components: kept.len() as u8,
        bytes: bytes.collect(),
    }
}

/// Returns the indices of primitives, with -1 after each.
pub(super) fn indices<const N: usize>(list: &[[u32; N]]) -> Value {
    let one = |corners: &[u32; N]| corners.map(|c| i32::try_from(c).unwrap_or(i32::MAX));
    Value::Ints(
        list.iter()
            .flat_map(|c| one(c).into_iter().chain([-1]))
            .collect(),
    )
}

/// Returns a vector as the value of a field.
pub(super) fn vec3(v: DVec3) -> Value {
    Value::Vec3(v.as_vec3())
}

/// Returns a rotation, about the z axis if it turns by nothing.
pub(super) fn rotation(turn: DQuat) -> Value {
    let (axis, angle) = turn.to_axis_angle();
    Value::Rotation(match angle.abs() < 1e-9 {
        true => Rotation::IDENTITY,
        false => Rotation {
            axis: axis.as_vec3(),
            angle: angle as f32,
        },
    })
}
