//! A scene file as it was read: an arena of nodes with spans.
//!
//! `DEF` and `USE` are edges to the same node, not copies. Fields are kept as written; what a
//! file does not state comes from the catalogue when it is asked for.

use std::collections::HashMap;
use std::sync::Arc;

use indexmap::IndexMap;

use super::declarations::{Extension, Protos, Route};
use super::loader::Loader;
use crate::diag::{Diagnostic, Result, Sink, Source, Span};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{Class, ClassId, default_value};

/// The class of a node: one of the catalogue's, or one that the file itself declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClassRef {
    Known(ClassId),
    /// A class of the file's own, by its place in [`Document::extensions`].
    Extension(u32),
}

/// Where the value of a connected field comes from: `translation = USE Engine . outVector`.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    pub from: NodeId,
    /// The output of an engine, or the field of a node.
    pub output: Box<str>,
}

/// A field that the file states.
#[derive(Clone, Debug)]
pub struct FieldEntry {
    /// The place of the field among the fields of its class.
    pub index: u16,
    pub value: Value,
    /// Whether the field is written with `~`, which means that it has no effect.
    pub ignored: bool,
    pub connection: Option<Box<Connection>>,
    pub span: Span,
}

/// A node as the file has it.
#[derive(Clone, Debug)]
pub struct Node {
    pub class: ClassRef,
    pub name: Option<Arc<str>>,
    pub fields: Vec<FieldEntry>,
    pub children: Vec<NodeId>,
    pub span: Span,
    /// The file that it is in, by its place in [`Document::sources`].
    pub source: u16,
}

impl Node {
    /// Makes a node that no file has. It has no name.
    pub(crate) fn made(class: &Class, fields: Vec<FieldEntry>, children: Vec<NodeId>) -> Self {
        Self {
            class: ClassRef::Known(class.id),
            name: None,
            fields,
            children,
            span: Span::default(),
            source: 0,
        }
    }
}

/// A file, together with the files that it names.
#[derive(Clone, Debug, Default)]
pub struct Document {
    pub nodes: Vec<Node>,
    pub roots: Vec<NodeId>,
    pub extensions: Vec<Extension>,
    pub sources: Vec<Arc<Source>>,
    /// The header's words, such as `Inventor V2.1 ascii`.
    pub format: String,
    /// The nodes that have names, by name. A name that is defined twice means the later node.
    pub names: IndexMap<Arc<str>, NodeId>,
    /// The routes between nodes. A route of a proto's instance leads to the nodes of its body.
    pub routes: Vec<Route>,
    /// The routes as the file states them.
    pub stated_routes: Vec<Route>,
    /// The classes that `PROTO`s and `EXTERNPROTO`s define.
    pub protos: Protos,
    /// The extensions by name, without those of protos and scripts.
    pub(super) extension_names: HashMap<Box<str>, Vec<u32>>,
    /// For each `File`, `WWWInline` and `Inline` node, the roots of the file that it names.
    pub included: HashMap<NodeId, Vec<NodeId>>,
    /// For each instance of a proto, the node that stands for it: the first of the body's copy.
    pub stands_for: HashMap<NodeId, NodeId>,
    /// Opens the files that nodes name.
    pub loader: Option<Arc<dyn Loader>>,
    /// The messages of reading.
    pub sink: Sink,
}

impl Document {
    /// Returns a node, or the node that stands for it: the first of the body of a proto's instance.
    pub fn node(&self, id: NodeId) -> NodeRef<'_> {
        let mut id = id;
        while let Some(&other) = self.stands_for.get(&id) {
            id = other;
        }
        NodeRef { document: self, id }
    }

    /// Whether a node is part of a proto's body, and not of the scene.
    pub(crate) fn is_template(&self, id: NodeId) -> bool {
        self.protos.is_template(id)
    }

    /// Opens a file that a node names (a texture, a font), beside the file that the node is in.
    ///
    /// # Errors
    /// The loader does not find the file or may not open it, or the document has no loader.
    pub(crate) fn load_beside(&self, node: NodeId, reference: &str) -> Result<(String, Vec<u8>)> {
        let source = &self.sources[usize::from(self.nodes[node.0 as usize].source)];
        match &self.loader {
            Some(loader) => loader.load(&source.name, reference),
            None => Err(Diagnostic::error(format!(
                "`{reference}` cannot be opened: the document has no loader"
            ))),
        }
    }

    /// The nodes that are inside no other.
    pub fn roots(&self) -> impl Iterator<Item = NodeRef<'_>> {
        self.roots.iter().map(|&id| self.node(id))
    }

    /// Adds a node to the arena.
    pub(crate) fn add(&mut self, node: Node) -> NodeId {
        let id = NodeId(u32::try_from(self.nodes.len()).expect("fewer than 2^32 nodes"));
        self.nodes.push(node);
        id
    }
}

/// A node together with its document.
#[derive(Clone, Copy)]
pub struct NodeRef<'a> {
    pub document: &'a Document,
    pub id: NodeId,
}

impl<'a> NodeRef<'a> {
    /// The node itself.
    pub(crate) fn data(self) -> &'a Node {
        &self.document.nodes[self.id.0 as usize]
    }

    /// The catalogue's class, or `None` for a class of the file's own.
    pub fn class(self) -> Option<&'static Class> {
        match self.data().class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(_) => None,
        }
    }

    pub(crate) fn class_id(self) -> Option<ClassId> {
        self.class().map(|c| c.id)
    }

    pub fn class_name(self) -> &'a str {
        match self.data().class {
            ClassRef::Known(id) => id.get().name,
            ClassRef::Extension(i) => &self.document.extensions[i as usize].name,
        }
    }

    /// The children. Those of a node that names a file are the roots of the file.
    pub fn children(self) -> impl DoubleEndedIterator<Item = NodeRef<'a>> + ExactSizeIterator {
        let included = self.document.included.get(&self.id);
        included
            .unwrap_or(&self.data().children)
            .iter()
            .map(move |&id| self.document.node(id))
    }

    pub fn span(self) -> Span {
        self.data().span
    }

    pub fn source(self) -> Option<&'a Arc<Source>> {
        self.document.sources.get(usize::from(self.data().source))
    }

    /// Returns the field as the file states it, unless it does not or marks it with `~`.
    pub(crate) fn entry(self, index: u16) -> Option<&'a FieldEntry> {
        self.data()
            .fields
            .iter()
            .find(|f| f.index == index && !f.ignored)
    }

    /// Returns the value of a field by name, as written or by default, whatever the class.
    pub fn value(self, name: &str) -> Option<&'a Value> {
        let data = self.data();
        match data.class {
            ClassRef::Known(id) => {
                let index = id.get().field(name)?.0 as u16;
                let stated = data
                    .fields
                    .iter()
                    .find(|f| f.index == index)
                    .map(|f| &f.value);
                Some(stated.unwrap_or_else(|| default_value(id, index)))
            }
            ClassRef::Extension(i) => {
                let extension = &self.document.extensions[i as usize];
                let stated = extension.fields.iter().position(|(n, _)| **n == *name);
                let stated = stated.and_then(|index| {
                    let entry = data.fields.iter().find(|f| usize::from(f.index) == index);
                    entry.map(|f| &f.value)
                });
                // A field that the file does not state is as in the class that it says this is.
                stated.or_else(|| {
                    let known = extension.is_a.iter().find_map(|n| crate::grammar::any(n))?;
                    let (index, _) = known.field(name)?;
                    Some(default_value(known.id, index as u16))
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grammar::{class, cone};

    #[test]
    fn a_silent_file_means_the_catalogues_default() {
        let mut document = Document::default();
        let fields = vec![FieldEntry {
            index: cone::HEIGHT.index,
            value: Value::Float(5.0),
            ignored: false,
            connection: None,
            span: Span::default(),
        }];
        let id = document.add(Node {
            class: ClassRef::Known(class::CONE),
            name: None,
            fields,
            children: Vec::new(),
            span: Span::default(),
            source: 0,
        });
        let cone = document.node(id);
        assert_eq!(cone.get(cone::HEIGHT), 5.0);
        assert_eq!(cone.get(cone::BOTTOM_RADIUS), 1.0);
        assert_eq!(cone.get(cone::PARTS), cone::PARTS_ALL);
    }
}
