//! Reads the fields of a node through the catalogue's typed handles.
//!
//! A handle such as `cone::HEIGHT` names a field and its type. It may be used on a node of any
//! class: a class that has a field of the same name and type gives that field, so one function
//! serves a family (`rotation::ROTATION` reads a `Rotor`) and both dialects of a name
//! (`cone::HEIGHT` reads a VRML97 `Cone`).

use super::document::{ClassRef, NodeRef};
use crate::grammar::value::{Get, NodeId, NodeRefValue, Value};
use crate::grammar::{self, Class, Field, default_value};

impl<'a> NodeRef<'a> {
    /// Returns the field's value as written, or the default that the catalogue states for the
    /// node's class. A class without such a field gives the default of the handle's own class.
    ///
    /// A field written with `~` keeps its value here; see [`Self::acting`].
    pub fn get<T: Get + ?Sized>(self, field: Field<T>) -> T::Out<'a> {
        self.find(field).unwrap_or_else(|| field.default())
    }

    /// Returns the same as [`Self::get`], but `None` if the node's class has no such field.
    pub fn find<T: Get + ?Sized>(self, field: Field<T>) -> Option<T::Out<'a>> {
        let value = if self.class_id() == Some(field.class) {
            self.stated(field.index)
                .unwrap_or_else(|| default_value(field.class, field.index))
        } else {
            self.value(field.decl().name)?
        };
        T::from_value(value)
    }

    /// Returns the value that acts on the traversal state: `None` if the file marks the field with
    /// `~` (Inventor's ignore flag), or if the node's class has no such field.
    pub fn acting<T: Get + ?Sized>(self, field: Field<T>) -> Option<T::Out<'a>> {
        let index = self.index_of(field)?;
        let mut fields = self.data().fields.iter();
        let ignored = fields.any(|f| f.index == index && f.ignored);
        if ignored { None } else { self.find(field) }
    }

    /// Returns the value that acts on the traversal state, with the catalogue's default in the
    /// place of a field that is ignored.
    pub(crate) fn acting_or_default<T: Get + ?Sized>(self, field: Field<T>) -> T::Out<'a> {
        self.acting(field).unwrap_or_else(|| field.default())
    }

    /// Returns the node that an `SFNode` field holds.
    pub fn get_node(self, field: Field<NodeRefValue>) -> Option<NodeRef<'a>> {
        self.find(field)?.map(|id| self.document.node(id))
    }

    /// Returns the nodes that a field holds: all of an `MFNode` field, the one of an `SFNode`
    /// field.
    pub fn get_nodes<T: ?Sized>(self, field: Field<T>) -> &'a [NodeId] {
        self.nodes_named(field.decl().name)
    }

    /// Returns the class to treat the node as: its own, or the nearest known one that the file says
    /// it is (`isA`).
    pub(crate) fn known_class(self) -> Option<&'static Class> {
        match self.data().class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(i) => self.document.extensions[i as usize]
                .is_a
                .iter()
                .find_map(|name| grammar::any(name)),
        }
    }

    /// Returns the nodes of a field by name, for names that are data themselves: the parts of a
    /// kit.
    pub fn nodes_named(self, name: &str) -> &'a [NodeId] {
        match self.value(name) {
            Some(Value::Nodes(list)) => list,
            Some(Value::Node(Some(id))) => std::slice::from_ref(id),
            _ => &[],
        }
    }

    fn stated(self, index: u16) -> Option<&'a Value> {
        let entry = self.data().fields.iter().find(|f| f.index == index)?;
        Some(&entry.value)
    }

    /// The field's place in the node's own class.
    fn index_of<T: ?Sized>(self, field: Field<T>) -> Option<u16> {
        let name = field.decl().name;
        let index = match self.data().class {
            ClassRef::Known(id) if id == field.class => return Some(field.index),
            ClassRef::Known(id) => id.get().field(name)?.0,
            ClassRef::Extension(i) => self.document.extensions[i as usize]
                .fields
                .iter()
                .position(|(n, _)| **n == *name)?,
        };
        Some(index as u16)
    }
}
