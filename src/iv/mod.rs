//! Inventor and VRML files to a [`Document`] and back.
//!
//! The header decides the format. A file with mistakes is read as far as it goes, and what was
//! wrong is in [`Document::sink`]; only a wrong header, a limit or I/O ends reading.

mod ascii;
mod assemble;
mod binary;
pub mod document;
mod field;
mod header;
mod inline;
mod limits;
pub mod proto;
mod same;
mod upgrade;
mod writer;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use crate::diag::{Diagnostic, Result, Source};
pub use crate::grammar::value::{self, NodeId, Value};
use assemble::Assembler;
pub use document::{ClassRef, Connection, Document, FieldEntry, Node, NodeRef, Route};
pub use header::Header;
pub use inline::{Folder, Loader, Nowhere};
pub use writer::Format;

pub use limits::Limits;

impl Document {
    /// Reads a file and the files it names, which must be below its folder.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(path, &[], &Limits::default())
    }

    /// Reads a file and the files it names, below its folder or in one of the search paths.
    pub fn open_with(path: impl AsRef<Path>, search: &[&Path], limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(&name, &e))?;
        let loader = Folder::of(path, search, limits.bytes);
        Self::read(&name, bytes, Arc::new(loader), limits)
    }

    /// Reads bytes under a name for messages.
    pub fn read(
        name: &str,
        bytes: Vec<u8>,
        loader: Arc<dyn Loader>,
        limits: &Limits,
    ) -> Result<Self> {
        Self::read_as(name, bytes, loader, limits, None)
    }

    /// Reads Inventor syntax that may lack its first line, as `-camread` and `-e` files may.
    pub fn read_headerless(name: &str, bytes: Vec<u8>) -> Result<Self> {
        let header = Some(Header::ascii_2_1());
        Self::read_as(name, bytes, Arc::new(Nowhere), &Limits::default(), header)
    }

    /// Reads another file, which may lack its first line, into this document's arena. Returns its
    /// roots, which are not made the document's.
    pub fn read_more(&mut self, name: &str, bytes: Vec<u8>) -> Result<Vec<NodeId>> {
        let header = Some(Header::ascii_2_1());
        let roots = read_into(self, name, bytes, &Limits::default(), header)?.roots;
        assemble::cut_cycles(self);
        Ok(roots)
    }

    fn read_as(
        name: &str,
        bytes: Vec<u8>,
        loader: Arc<dyn Loader>,
        limits: &Limits,
        otherwise: Option<Header>,
    ) -> Result<Self> {
        let mut document = Self {
            loader: Some(loader),
            ..Self::default()
        };
        document.roots = read_into(&mut document, name, bytes, limits, otherwise)?.roots;
        inline::include(&mut document, limits)?;
        proto::resolve_routes(&mut document);
        assemble::cut_cycles(&mut document);
        Ok(document)
    }
}

/// What a file adds to a document.
struct FileRead {
    roots: Vec<NodeId>,
    /// The classes that it declares, by name, in [`Document::extensions`].
    declared: HashMap<Box<str>, u32>,
}

/// Reads one file into a document, which may hold others already.
fn read_into(
    document: &mut Document,
    name: &str,
    bytes: Vec<u8>,
    limits: &Limits,
    otherwise: Option<Header>,
) -> Result<FileRead> {
    let bytes = header::unpack(bytes, name, limits)?;
    let header = match (Header::parse(&bytes, name), otherwise) {
        (Ok(header), _) => header,
        (Err(_), Some(header)) => header,
        (Err(error), None) => return Err(error),
    };
    if document.sources.is_empty() {
        document.format = header.words.clone();
    }
    let mut source = Source::new(name, bytes);
    if header.binary {
        source = source.into_binary();
    }
    let source = Arc::new(source);
    let before = document.sink.set_source(Some(source.clone()));
    let first_node = document.nodes.len();
    document.sources.push(source.clone());
    let mut assembler = Assembler::new(document, header, limits);
    let roots = if source.binary {
        binary::read(&mut assembler, &source.bytes)
    } else {
        ascii::read(&mut assembler, &source.bytes)
    };
    let old = std::mem::take(&mut assembler.old);
    let header = assembler.header.clone();
    let declared = std::mem::take(&mut assembler.declared);
    let roots = roots?;
    upgrade::upgrade(document, &header, first_node, old);
    document.sink.set_source(before);
    Ok(FileRead { roots, declared })
}
