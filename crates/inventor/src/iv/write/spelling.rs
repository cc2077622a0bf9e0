//! Names that all formats share: those of classes, fields and enumeration values, and the tokens
//! after `DEF` and `USE`.

use std::collections::{HashMap, HashSet};

use crate::grammar::value::NodeId;
use crate::grammar::{Dialect, FieldType};
use crate::iv::document::{ClassRef, Document};

/// Returns the name to write for a class. In an Inventor file a VRML97 class has the prefix `VRML`,
/// as in Coin, and a class of X3D the prefix `X3D`.
pub(super) fn class_name(document: &Document, class: ClassRef, vrml97: bool) -> String {
    match class {
        ClassRef::Known(id) if id.get().dialects == Dialect::VRML97 && !vrml97 => {
            format!("VRML{}", id.get().name)
        }
        ClassRef::Known(id) if id.get().dialects == Dialect::X3D && !vrml97 => {
            format!("X3D{}", id.get().name)
        }
        ClassRef::Known(id) => id.get().name.into(),
        ClassRef::Extension(i) => {
            let extension = &document.extensions[i as usize];
            let script = !vrml97 && extension.is_a.first().is_some_and(|n| **n == *"Script");
            if script {
                "VRMLScript".into()
            } else {
                extension.name.to_string()
            }
        }
    }
}

/// The name and type of a field, and the names of its enumeration values.
pub(super) type Described<'d> = (&'d str, FieldType, &'static [(&'static str, i64)]);

/// Returns the description of a field of a class.
pub(super) fn described(document: &Document, class: ClassRef, index: u16) -> Described<'_> {
    match class {
        ClassRef::Known(id) => {
            let decl = &id.get().fields[usize::from(index)];
            (decl.name, decl.kind, decl.names)
        }
        ClassRef::Extension(i) => {
            let extension = &document.extensions[i as usize];
            let (name, kind) = &extension.fields[usize::from(index)];
            let of = |is_a: &str| Some(crate::grammar::any(is_a)?.field(name)?.1.names);
            (
                name,
                *kind,
                extension.is_a.iter().find_map(|n| of(n)).unwrap_or(&[]),
            )
        }
    }
}

/// Returns whether a class is an engine or global field whose `type` determines its other fields.
/// Such a type is written first.
pub(super) fn has_type_first(document: &Document, class: ClassRef) -> bool {
    let name = match class {
        ClassRef::Known(id) => id.get().name,
        ClassRef::Extension(i) => &document.extensions[i as usize].name,
    };
    matches!(name, "Gate" | "SelectOne" | "Concatenate" | "GlobalField")
}

/// Returns the order in which to write a node's fields. It is the file's order, except that a type
/// that determines the other fields comes first.
pub(super) fn field_order(document: &Document, id: NodeId) -> Vec<usize> {
    let node = &document.nodes[id.0 as usize];
    let mut order: Vec<usize> = (0..node.fields.len()).collect();
    if has_type_first(document, node.class) {
        order.sort_by_key(|&i| node.fields[i].index != 0);
    }
    order
}

/// The tokens that are written after `DEF` and `USE`.
#[derive(Default)]
pub(super) struct Tokens {
    tokens: HashMap<NodeId, String>,
}

impl Tokens {
    /// Creates the tokens for nodes in the order in which they are visited. A node is written on
    /// its first visit and referred to with `USE` on later visits. It gets a reference number if it
    /// has no name, or if a later node has taken over its name before a `USE`.
    pub(super) fn new(document: &Document, visited: &[NodeId]) -> Self {
        let name = |id: NodeId| document.nodes[id.0 as usize].name.as_deref();
        let mut latest: HashMap<&str, NodeId> = HashMap::new();
        let mut seen = HashSet::new();
        let mut numbered: Vec<NodeId> = Vec::new();
        for &id in visited {
            let used = !seen.insert(id);
            match (name(id), used) {
                (Some(name), false) => {
                    latest.insert(name, id);
                }
                (Some(name), true) if latest.get(name) == Some(&id) => {}
                (_, true) => numbered.push(id),
                (None, false) => {}
            }
        }
        let mut tokens: HashMap<NodeId, String> = HashMap::new();
        for &id in visited {
            if let Some(name) = name(id) {
                tokens.insert(id, name.to_owned());
            }
        }
        let mut done = HashSet::new();
        for (number, id) in numbered.into_iter().enumerate() {
            if done.insert(id) {
                let token = tokens.entry(id).or_default();
                *token = format!("{token}+{number}");
            }
        }
        Self { tokens }
    }

    /// Returns the token of a node, or `None` if it needs none.
    pub(super) fn get(&self, id: NodeId) -> Option<&str> {
        self.tokens.get(&id).map(String::as_str)
    }
}

/// Returns the name of an enumeration's value, or the number if the value has no name.
pub(super) fn enumeration(n: i32, names: &[(&str, i64)]) -> String {
    let name = names
        .iter()
        .find(|(_, v)| *v == i64::from(n))
        .map(|(name, _)| *name);
    name.map_or_else(|| n.to_string(), str::to_owned)
}

/// Returns the names of the bits of a value. Bits without a name follow as one number.
pub(super) fn bit_names(n: i32, names: &[(&str, i64)]) -> Vec<String> {
    if let Some((name, _)) = names.iter().find(|(_, v)| *v == i64::from(n)) {
        return vec![(*name).to_owned()];
    }
    let (mut left, mut out) = (n, Vec::new());
    for (name, v) in names.iter().map(|(name, v)| (name, *v as i32)) {
        if v != 0 && left & v == v {
            left &= !v;
            out.push((*name).to_owned());
        }
    }
    if left != 0 {
        out.push(left.to_string());
    }
    out
}
