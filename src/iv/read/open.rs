//! The ways to read a document: from a file, from bytes, with or without a header.

use std::path::Path;
use std::sync::Arc;

use super::file::read_into;
use super::header::Header;
use super::{cycles, expand, inline};
use crate::diag::{Diagnostic, Result};
use crate::grammar::value::NodeId;
use crate::iv::document::Document;
use crate::iv::limits::Limits;
use crate::iv::loader::{Folder, Loader, Nowhere};

impl Document {
    /// Reads a file and the files it names, which must be below its folder.
    ///
    /// # Errors
    /// The file cannot be read, has no header of Inventor or VRML, or passes a limit.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(path, &[], &Limits::default())
    }

    /// Reads a file and the files it names, below its folder or in one of the search paths.
    ///
    /// # Errors
    /// The file cannot be read, has no header of Inventor or VRML, or passes a limit.
    pub fn open_with(path: impl AsRef<Path>, search: &[&Path], limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(&name, &e))?;
        let loader = Folder::of(path, search, limits.bytes);
        Self::read(&name, bytes, Arc::new(loader), limits)
    }

    /// Reads bytes under a name for messages.
    ///
    /// # Errors
    /// The bytes have no header of Inventor or VRML, or pass a limit.
    pub fn read(
        name: &str,
        bytes: Vec<u8>,
        loader: Arc<dyn Loader>,
        limits: &Limits,
    ) -> Result<Self> {
        Self::read_as(name, bytes, loader, limits, None)
    }

    /// Reads Inventor syntax that may lack its first line, as `-camread` and `-e` files may.
    ///
    /// # Errors
    /// The bytes pass a limit.
    pub(crate) fn read_headerless(name: &str, bytes: Vec<u8>) -> Result<Self> {
        let header = Some(Header::ascii_2_1());
        Self::read_as(name, bytes, Arc::new(Nowhere), &Limits::default(), header)
    }

    /// Reads another file, which may lack its first line, into this document's arena. Returns its
    /// roots, which do not become the document's.
    ///
    /// # Errors
    /// The bytes pass a limit.
    pub(crate) fn read_more(&mut self, name: &str, bytes: Vec<u8>) -> Result<Vec<NodeId>> {
        let header = Some(Header::ascii_2_1());
        let roots = read_into(self, name, bytes, &Limits::default(), header)?.roots;
        cycles::cut_cycles(self);
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
        inline::include(&mut document, limits);
        expand::resolve_routes(&mut document);
        cycles::cut_cycles(&mut document);
        Ok(document)
    }
}
