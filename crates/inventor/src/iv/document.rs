//! The content of a scene file: an arena of nodes with their locations in the file.
//!
//! A `USE` refers to the node of its `DEF`; it is not a copy. A node stores only the fields that
//! the file states. The other fields have the catalogue's defaults, which are looked up on access.

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::Arc;

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use ivcam_base::files::LARGE_FILE;

use super::data_uri;
use super::declarations::{Extension, Protos, Route};
use super::loader::Loader;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{Class, ClassId, default_value};

/// The class of a node: a class of the catalogue, or one that the file declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClassRef {
    /// A class of the node catalogue.
    Known(ClassId),
    /// A class that the file declares, as its index in `Document::extensions`.
    Extension(u32),
}

/// The source of a connected field's value: `translation = USE Engine . outVector`.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// The engine or node that supplies the value.
    pub from: NodeId,
    /// The name of the engine's output, or of the node's field.
    pub output: Box<str>,
}

/// A field that the file states.
#[derive(Clone, Debug)]
pub struct FieldEntry {
    /// The index of the field among the fields of its class.
    pub index: u16,
    /// The value that the file states. A connected field without one has the default.
    pub value: Value,
    /// Whether the field is written with `~`, Inventor's ignore flag: it then has no effect.
    pub ignored: bool,
    /// The source of the value, if the field is connected.
    pub connection: Option<Box<Connection>>,
    /// The range of the file with the field's name and value.
    pub span: Span,
}

impl FieldEntry {
    /// Makes the entry of a field with a value, which is not connected.
    pub fn new(index: u16, value: Value, span: Span) -> Self {
        Self {
            index,
            value,
            ignored: false,
            connection: None,
            span,
        }
    }
}

/// A node with the fields and children that the file states.
#[derive(Clone, Debug)]
pub struct Node {
    /// The node's class.
    pub class: ClassRef,
    /// The name after `DEF`.
    pub name: Option<Arc<str>>,
    /// The fields that the file states, in the file's order.
    pub fields: Vec<FieldEntry>,
    /// The children that are written between the braces, and not in a field.
    pub children: Vec<NodeId>,
    /// The range of the file that the node is in.
    pub span: Span,
    /// The file that the node is in, as its index in [`Document::sources`].
    pub source: u16,
}

impl Node {
    /// Creates a node without a name and without a location in a file.
    pub fn synthetic(class: &Class, fields: Vec<FieldEntry>, children: Vec<NodeId>) -> Self {
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

/// The size in bytes from which the content of a file is released. Below it messages quote the text
/// as it was read, whatever becomes of the file.
const LARGE_TEXT: usize = LARGE_FILE;

/// The content of a scene file and of the files that it includes.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// All nodes. A [`NodeId`] is an index into this list.
    pub nodes: Vec<Node>,
    /// The top-level nodes of the main file, in the file's order.
    pub roots: Vec<NodeId>,
    /// The classes that the files declare.
    pub extensions: Vec<Extension>,
    /// The files that were read. The first is the main file.
    pub sources: Vec<Arc<Source>>,
    /// The format that the header states, such as `Inventor V2.1 ascii`.
    pub format: String,
    /// Whether the main file is packed with gzip.
    pub is_gzipped: bool,
    /// The named nodes of the main file, by name. If a name is defined twice, the later node has
    /// it.
    pub names: IndexMap<Arc<str>, NodeId>,
    /// The routes between nodes. A route to a proto's instance leads to the nodes of its body.
    pub routes: Vec<Route>,
    /// The routes as the file states them, before protos are expanded.
    pub stated_routes: Vec<Route>,
    /// The classes that `PROTO`s and `EXTERNPROTO`s define.
    pub protos: Protos,
    /// The indices of the extensions by name, without those of protos and scripts.
    pub(super) extension_names: HashMap<Box<str>, Vec<u32>>,
    /// The roots of the included file, for each `File`, `WWWInline` and `Inline` node.
    pub included: HashMap<NodeId, Vec<NodeId>>,
    /// The node that represents each instance of a proto: the first node of the body's copy.
    pub expansions: HashMap<NodeId, NodeId>,
    /// What a file states about itself, as names and contents: the `META` statements of X3D, and
    /// the asset of glTF.
    pub meta: Vec<(String, String)>,
    /// The files, by their index in `sources`, whose textures multiply the color of a material.
    pub(crate) multiplying: BTreeSet<u16>,
    /// The nodes of which a field was set after the document was read.
    pub(crate) edited: BTreeSet<NodeId>,
    /// Opens the files that nodes refer to.
    pub(crate) loader: Option<Arc<dyn Loader>>,
    /// The diagnostics that reading reported.
    pub sink: Sink,
}

impl Document {
    /// Returns a node. For an instance of a proto it returns the first node of the body's copy.
    pub fn node(&self, id: NodeId) -> NodeRef<'_> {
        let mut id = id;
        while let Some(&other) = self.expansions.get(&id) {
            id = other;
        }
        NodeRef { document: self, id }
    }

    /// Returns the ids of all nodes that the document has now.
    pub fn ids(&self) -> impl Iterator<Item = NodeId> + use<> {
        (0..self.nodes.len() as u32).map(NodeId)
    }

    /// Returns whether a node is part of a proto's definition and not of the scene.
    pub fn is_template(&self, id: NodeId) -> bool {
        self.protos.is_template(id)
    }

    /// Reads a file that a node refers to, such as a texture or a font. A relative path starts at
    /// the folder of the file that the node is in. Returns the file's name and bytes. A URI with
    /// the scheme `data` contains the bytes.
    ///
    /// # Errors
    /// Returns an error if the loader does not find the file or may not open it, or if the document
    /// has no loader.
    pub fn load_beside(&self, node: NodeId, reference: &str) -> Result<(String, Vec<u8>)> {
        if data_uri::is_data(reference) {
            return data_uri::decoded(reference);
        }
        let source = &self.sources[usize::from(self.nodes[node.0 as usize].source)];
        match &self.loader {
            Some(loader) => loader.load(&source.name, reference),
            None => Err(Diagnostic::error(format!(
                "`{reference}` cannot be opened: the document has no loader"
            ))),
        }
    }

    /// Returns the files that the scene names, as far as they were opened: included scenes and,
    /// once they were asked for, textures.
    pub fn opened_files(&self) -> Vec<PathBuf> {
        let loader = self.loader.as_ref();
        loader.map_or_else(Vec::new, |loader| loader.opened_files())
    }

    /// Frees the content of large files, which is read again if a message quotes a line of it. Text
    /// takes about twice the memory of its nodes.
    pub fn release_text(&mut self) {
        for source in &mut self.sources {
            if source.bytes.len() >= LARGE_TEXT
                && let Some(released) = source.released()
            {
                *source = Arc::new(released);
            }
        }
    }

    /// Frees everything except the list of the files that were opened.
    pub fn free_nodes(&mut self) {
        *self = Self {
            loader: self.loader.take(),
            ..Self::default()
        };
    }

    /// Returns the top-level nodes of the main file.
    pub fn roots(&self) -> impl Iterator<Item = NodeRef<'_>> {
        self.roots.iter().map(|&id| self.node(id))
    }

    /// Adds a node to the arena and returns its index.
    pub fn add(&mut self, node: Node) -> NodeId {
        let id = NodeId(u32::try_from(self.nodes.len()).expect("fewer than 2^32 nodes"));
        self.nodes.push(node);
        id
    }
}

/// A reference to a node of a document.
#[derive(Clone, Copy)]
pub struct NodeRef<'a> {
    /// The document that contains the node.
    pub document: &'a Document,
    /// The node's index.
    pub id: NodeId,
}

impl<'a> NodeRef<'a> {
    /// Returns the node's entry in the arena.
    pub fn data(self) -> &'a Node {
        &self.document.nodes[self.id.0 as usize]
    }

    /// Returns whether this is the same node. The identifier alone is not enough, because the nodes
    /// that kits make belong to a document of their own.
    pub fn is(self, other: NodeRef<'_>) -> bool {
        self.id == other.id && std::ptr::eq(self.document, other.document)
    }

    /// Returns the catalogue's class, or `None` for a class that the file declares.
    pub fn class(self) -> Option<&'static Class> {
        match self.data().class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(_) => None,
        }
    }

    /// Returns the identifier of the catalogue's class, or `None` as [`NodeRef::class`] does.
    pub fn class_id(self) -> Option<ClassId> {
        self.class().map(|c| c.id)
    }

    /// Returns the name of the node's class.
    pub fn class_name(self) -> &'a str {
        match self.data().class {
            ClassRef::Known(id) => id.get().name,
            ClassRef::Extension(i) => &self.document.extensions[i as usize].name,
        }
    }

    /// Returns the children. For a node that includes a file they are the roots of that file.
    pub fn children(self) -> impl DoubleEndedIterator<Item = NodeRef<'a>> + ExactSizeIterator {
        let included = self.document.included.get(&self.id);
        included
            .unwrap_or(&self.data().children)
            .iter()
            .map(move |&id| self.document.node(id))
    }

    /// Returns the range of the file that the node is in.
    pub fn span(self) -> Span {
        self.data().span
    }

    /// Returns the file that the node is in. A document without files has none.
    pub fn source(self) -> Option<&'a Arc<Source>> {
        self.document.sources.get(usize::from(self.data().source))
    }

    /// Returns the entry of a field that the file states and does not mark with `~`.
    pub(crate) fn entry(self, index: u16) -> Option<&'a FieldEntry> {
        self.data()
            .fields
            .iter()
            .find(|f| f.index == index && !f.ignored)
    }

    /// Returns the value of a field by name: the stated value or the default. The ignore flag `~`
    /// does not count. Returns `None` if the class has no field of this name, or if the file
    /// declares the class and neither the node nor a known base class has a value.
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
                let stated = extension.fields.place(name);
                let stated = stated.and_then(|index| {
                    let entry = data.fields.iter().find(|f| usize::from(f.index) == index);
                    entry.map(|f| &f.value)
                });
                // A field that the file does not state has the default of the class in `isA`.
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
    fn a_field_that_the_file_does_not_state_has_the_catalogues_default() {
        let mut document = Document::default();
        let fields = vec![FieldEntry::new(
            cone::HEIGHT.index,
            Value::Float(5.0),
            Span::default(),
        )];
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
