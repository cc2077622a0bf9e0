//! Fields by name, so that one function serves a family: a `Rotor` is read as a `Rotation`.

use crate::grammar::value::{Get, Value};
use crate::grammar::{self, Class};
use crate::iv::document::ClassRef;
use crate::iv::{NodeId, NodeRef};

/// Reading a node whatever its exact class.
pub trait Fields<'a>: Copy {
    /// The field as written, or its default; `None` where the class has no such field.
    fn read<T: Get + ?Sized>(self, name: &str) -> Option<T::Out<'a>>;

    /// The same, but `None` where the field is written with `~`.
    fn acting<T: Get + ?Sized>(self, name: &str) -> Option<T::Out<'a>>;

    /// The node in an `SFNode` field.
    fn node_in(self, name: &str) -> Option<NodeRef<'a>>;

    /// The class to treat the node as: its own, or the nearest known one it says it is.
    fn known_class(self) -> Option<&'static Class>;
}

impl<'a> Fields<'a> for NodeRef<'a> {
    fn read<T: Get + ?Sized>(self, name: &str) -> Option<T::Out<'a>> {
        T::from_value(self.value(name)?)
    }

    fn acting<T: Get + ?Sized>(self, name: &str) -> Option<T::Out<'a>> {
        let index = field_index(self, name)?;
        let ignored = self
            .data()
            .fields
            .iter()
            .any(|f| f.index == index && f.ignored);
        if ignored { None } else { self.read::<T>(name) }
    }

    fn node_in(self, name: &str) -> Option<NodeRef<'a>> {
        match self.value(name)? {
            Value::Node(Some(id)) => Some(self.document.node(*id)),
            _ => None,
        }
    }

    fn known_class(self) -> Option<&'static Class> {
        match self.data().class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(i) => self.document.extensions[i as usize]
                .is_a
                .iter()
                .find_map(|name| grammar::any(name)),
        }
    }
}

fn field_index(node: NodeRef<'_>, name: &str) -> Option<u16> {
    match node.data().class {
        ClassRef::Known(id) => id.get().field(name).map(|(i, _)| i as u16),
        ClassRef::Extension(i) => node.document.extensions[i as usize]
            .fields
            .iter()
            .position(|(n, _)| **n == *name)
            .map(|i| i as u16),
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
