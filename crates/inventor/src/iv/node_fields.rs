//! Reads the fields of a node through the catalogue's typed handles.
//!
//! A handle such as `cone::HEIGHT` identifies a field and its type. It may be used on a node of any
//! class that has a field of the same name and type. One function can therefore handle a family
//! (`rotation::ROTATION` reads a `Rotor`) and both dialects of a class (`cone::HEIGHT` reads a
//! VRML97 `Cone`).

use super::document::{ClassRef, NodeRef};
use crate::grammar::value::{Get, NodeId, NodeRefValue, Value};
use crate::grammar::{self, Class, Field, default_value};

impl<'a> NodeRef<'a> {
    /// Returns the value that the file states, or the catalogue's default for the node's class. If
    /// the class has no such field, it returns the default of the handle's class.
    ///
    /// The ignore flag `~` does not count here; see [`Self::acting`].
    pub fn get<T: Get + ?Sized>(self, field: Field<T>) -> T::Out<'a> {
        self.find(field).unwrap_or_else(|| field.default())
    }

    /// Returns the value as [`Self::get`] does, or `None` if the node's class has no such field.
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

    /// Returns the value that acts on the traversal state, or the catalogue's default if the field
    /// is ignored.
    pub(crate) fn acting_or_default<T: Get + ?Sized>(self, field: Field<T>) -> T::Out<'a> {
        self.acting(field).unwrap_or_else(|| field.default())
    }

    /// Returns whether the file states the field of a node of the handle's class or one below it.
    pub fn states<T: ?Sized>(self, field: Field<T>) -> bool {
        self.index_of(field)
            .and_then(|index| self.stated(index))
            .is_some()
    }

    /// Returns the node that an `SFNode` field holds.
    pub fn get_node(self, field: Field<NodeRefValue>) -> Option<NodeRef<'a>> {
        self.find(field)?.map(|id| self.document.node(id))
    }

    /// Returns the nodes of an `MFNode` field, or the one node of an `SFNode` field.
    pub fn get_nodes<T: ?Sized>(self, field: Field<T>) -> &'a [NodeId] {
        self.nodes_named(field.decl().name)
    }

    /// Returns the node's class if the catalogue has it, or else the first known class in the
    /// file's `isA` declaration.
    pub fn known_class(self) -> Option<&'static Class> {
        match self.data().class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(i) => self.document.extensions[i as usize]
                .is_a
                .iter()
                .find_map(|name| grammar::any(name)),
        }
    }

    /// Returns the nodes of a field by name. It is for field names that are data themselves, such
    /// as the parts of a node kit.
    pub fn nodes_named(self, name: &str) -> &'a [NodeId] {
        match self.value(name) {
            Some(Value::Nodes(list)) => list,
            Some(Value::Node(Some(id))) => std::slice::from_ref(id),
            _ => &[],
        }
    }

    /// Returns the value that the file states for a field.
    fn stated(self, index: u16) -> Option<&'a Value> {
        let entry = self.data().fields.iter().find(|f| f.index == index)?;
        Some(&entry.value)
    }

    /// Returns the index of the handle's field in the node's own class.
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
