//! Inventor and VRML files to a [`Document`] and back.

pub mod document;

pub use crate::grammar::value::{self, NodeId, Value};
pub use document::{ClassRef, Connection, Document, FieldEntry, Node, NodeRef};
