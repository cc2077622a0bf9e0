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
    /// An index into [`Document::extensions`]: a `fields [ ]` or `PROTO` of the file's own.
    Extension(u32),
}

/// A field's value that comes from elsewhere: `translation = USE Engine . outVector`.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    pub from: NodeId,
    /// The output of an engine, or the field of a node.
    pub output: Box<str>,
}

/// A field that the file states.
#[derive(Clone, Debug)]
pub struct FieldEntry {
    /// Index into the class's fields (the catalogue's or the extension's).
    pub index: u16,
    pub value: Value,
    /// Written with `~`: as if the field were not there.
    pub ignored: bool,
    pub connection: Option<Box<Connection>>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Node {
    pub class: ClassRef,
    pub name: Option<Arc<str>>,
    pub fields: Vec<FieldEntry>,
    pub children: Vec<NodeId>,
    pub span: Span,
    /// Index into [`Document::sources`].
    pub source: u16,
}

impl Node {
    /// A node without a name that no file has.
    pub fn made(class: &Class, fields: Vec<FieldEntry>, children: Vec<NodeId>) -> Self {
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

/// A file, with the files that it names read in.
#[derive(Clone, Debug, Default)]
pub struct Document {
    pub nodes: Vec<Node>,
    pub roots: Vec<NodeId>,
    pub extensions: Vec<Extension>,
    pub sources: Vec<Arc<Source>>,
    /// The header's words, such as `Inventor V2.1 ascii`.
    pub format: String,
    /// `DEF` names; a name defined twice means its latest node.
    pub names: IndexMap<Arc<str>, NodeId>,
    /// Events that go from node to node; where a proto's instance has them, between the nodes of
    /// its body.
    pub routes: Vec<Route>,
    /// Routes as the file states them.
    pub stated_routes: Vec<Route>,
    /// The classes that `PROTO`s and `EXTERNPROTO`s define.
    pub protos: Protos,
    /// Extensions by name, those of protos and scripts left out.
    pub(super) extension_names: HashMap<Box<str>, Vec<u32>>,
    /// The roots of the file that a `File`, `WWWInline` or `Inline` names, once it is read.
    pub included: HashMap<NodeId, Vec<NodeId>>,
    /// What stands for a node: the first node of its proto's body.
    pub stands_for: HashMap<NodeId, NodeId>,
    /// Opens the files that nodes name.
    pub loader: Option<Arc<dyn Loader>>,
    /// What reading had to say.
    pub sink: Sink,
}

impl Document {
    /// A node, or what stands for it: an instance of a proto is its body's first node.
    pub fn node(&self, id: NodeId) -> NodeRef<'_> {
        let mut id = id;
        while let Some(&other) = self.stands_for.get(&id) {
            id = other;
        }
        NodeRef { document: self, id }
    }

    /// Whether a node is part of a proto's body, and not of the scene.
    pub fn is_template(&self, id: NodeId) -> bool {
        self.protos.is_template(id)
    }

    /// A file that a node names (a texture, a font), looked for beside the file the node is in.
    pub fn load_beside(&self, node: NodeId, reference: &str) -> Result<(String, Vec<u8>)> {
        let source = &self.sources[usize::from(self.nodes[node.0 as usize].source)];
        match &self.loader {
            Some(loader) => loader.load(&source.name, reference),
            None => Err(Diagnostic::error(format!(
                "`{reference}` cannot be opened: the document has no loader"
            ))),
        }
    }

    pub fn roots(&self) -> impl Iterator<Item = NodeRef<'_>> {
        self.roots.iter().map(|&id| self.node(id))
    }

    pub fn add(&mut self, node: Node) -> NodeId {
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
    pub fn data(self) -> &'a Node {
        &self.document.nodes[self.id.0 as usize]
    }

    /// The catalogue's class, if the node is of one.
    pub fn class(self) -> Option<&'static Class> {
        match self.data().class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(_) => None,
        }
    }

    pub fn class_id(self) -> Option<ClassId> {
        self.class().map(|c| c.id)
    }

    pub fn class_name(self) -> &'a str {
        match self.data().class {
            ClassRef::Known(id) => id.get().name,
            ClassRef::Extension(i) => &self.document.extensions[i as usize].name,
        }
    }

    /// Its children; those of a node that names a file are what is in the file.
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

    /// The field as the file states it, unless it is silent or says to ignore it.
    pub fn entry(self, index: u16) -> Option<&'a FieldEntry> {
        self.data()
            .fields
            .iter()
            .find(|f| f.index == index && !f.ignored)
    }

    /// A field by name, as written or by default, whatever the class: for tools and families.
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
                // What the file is silent about is as in the class that it says this is.
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
