//! Fields by name, so that one function serves a family: a `Rotor` is read as a `Rotation`.

use crate::grammar::value::{Get, Value};
use crate::iv::{NodeId, NodeRef};

/// Reading a node whatever its exact class.
pub trait Fields<'a>: Copy {
    /// The field as written, or its default; `None` where the class has no such field.
    fn read<T: Get + ?Sized>(self, name: &str) -> Option<T::Out<'a>>;

    /// The node in an `SFNode` field.
    fn node_in(self, name: &str) -> Option<NodeRef<'a>>;
}

impl<'a> Fields<'a> for NodeRef<'a> {
    fn read<T: Get + ?Sized>(self, name: &str) -> Option<T::Out<'a>> {
        T::from_value(self.value(name)?)
    }

    fn node_in(self, name: &str) -> Option<NodeRef<'a>> {
        match self.value(name)? {
            Value::Node(Some(id)) => Some(self.document.node(*id)),
            _ => None,
        }
    }
}

/// The nodes of an `MFNode` field, or the one of an `SFNode` field.
pub fn nodes_in<'a>(node: NodeRef<'a>, name: &str) -> &'a [NodeId] {
    match node.value(name) {
        Some(Value::Nodes(list)) => list,
        Some(Value::Node(Some(id))) => std::slice::from_ref(id),
        _ => &[],
    }
}
