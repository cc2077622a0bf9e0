//! The functions that read a document: from a file or from bytes, with or without a header.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{FileBytes, open_file, read_stream};

use super::file::read_into;
use super::header::Header;
use super::{cycles, expand, inline};
use crate::grammar::value::NodeId;
use crate::iv::document::Document;
use crate::iv::limits::Limits;
use crate::iv::loader::{FolderLoader, Loader, NoFiles};

/// The name of standard input in messages.
const STANDARD_INPUT: &str = "standard input";

/// Returns all that standard input holds. It can be read only once, so the bytes are kept for a
/// command that opens its scene several times.
fn standard_input(limit: usize) -> Result<Vec<u8>> {
    static KEPT: Mutex<Option<Vec<u8>>> = Mutex::new(None);
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(bytes) = &*kept {
        return Ok(bytes.clone());
    }
    let bytes = read_stream(std::io::stdin(), STANDARD_INPUT, limit)?;
    *kept = Some(bytes.clone());
    Ok(bytes)
}

impl Document {
    /// Reads a file and the files of its project that it includes: see [`FolderLoader::new`].
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, has no Inventor or VRML header, or exceeds a
    /// limit.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(path, &[], &Limits::default())
    }

    /// Reads a file and the files that it includes, which must belong to its project (see
    /// [`FolderLoader::new`]) or be below one of the folders in `search`.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, has no Inventor or VRML header, or exceeds a
    /// limit.
    pub fn open_with(path: impl AsRef<Path>, search: &[&Path], limits: &Limits) -> Result<Self> {
        Self::open_or_stdin(path.as_ref(), search, None, limits)
    }

    /// Reads a file as [`Document::open_with`] does, or standard input if the path is `-`. The
    /// files that a scene on standard input names are looked for in the working directory. If
    /// `contain` is a folder, the files below it are opened instead of those of the project.
    ///
    /// # Errors
    /// Returns the errors of [`Document::open_with`], and one if `contain` or a path in `search` is
    /// not a folder.
    pub fn open_or_stdin(
        path: &Path,
        search: &[&Path],
        contain: Option<&Path>,
        limits: &Limits,
    ) -> Result<Self> {
        let searched = search.iter().map(|folder| {
            let help = "`--search` takes a folder that is searched too for files of the scene";
            (*folder, help)
        });
        let help = "`--contain` takes the folder below which files may be opened";
        let mut folders = searched.chain(contain.map(|folder| (folder, help)));
        if let Some((folder, help)) = folders.find(|(folder, _)| !folder.is_dir()) {
            let message = format!("there is no folder `{}`", folder.display());
            return Err(Diagnostic::not_found(message).with_help(help));
        }
        let (name, place, bytes) = if path.as_os_str() == "-" {
            let bytes = standard_input(limits.bytes)?;
            (
                STANDARD_INPUT.to_owned(),
                Path::new("."),
                FileBytes::Read(bytes),
            )
        } else {
            let bytes = open_file(path, limits.bytes)?;
            (path.display().to_string(), path, bytes)
        };
        let loader = FolderLoader::within(place, search, contain, limits.bytes);
        Self::read_as(&name, bytes, Arc::new(loader), limits, None)
    }

    /// Reads a document from bytes. `name` is the file name for messages and for `loader`.
    ///
    /// # Errors
    /// Returns an error if the bytes have no Inventor or VRML header or exceed a limit.
    pub fn read(
        name: &str,
        bytes: Vec<u8>,
        loader: Arc<dyn Loader>,
        limits: &Limits,
    ) -> Result<Self> {
        Self::read_as(name, FileBytes::Read(bytes), loader, limits, None)
    }

    /// Reads a document that may have no header, such as the files of `-camread` and `-e`. It is
    /// then read as Inventor V2.1.
    ///
    /// # Errors
    /// Returns an error if the bytes exceed a limit.
    pub fn read_headerless(name: &str, bytes: Vec<u8>) -> Result<Self> {
        let header = Some(Header::ascii_2_1());
        let bytes = FileBytes::Read(bytes);
        Self::read_as(name, bytes, Arc::new(NoFiles), &Limits::default(), header)
    }

    /// Reads another file, which may have no header, into this document's arena. Returns its roots,
    /// which do not become roots of the document.
    ///
    /// # Errors
    /// Returns an error if the bytes exceed a limit.
    pub fn read_more(&mut self, name: &str, bytes: Vec<u8>) -> Result<Vec<NodeId>> {
        let header = Some(Header::ascii_2_1());
        let roots = read_into(
            self,
            name,
            FileBytes::Read(bytes),
            &Limits::default(),
            header,
        )?
        .roots;
        cycles::cut_cycles(self);
        Ok(roots)
    }

    /// Reads VRML97 nodes that a script creates into this document's arena. Returns the top-level
    /// nodes, which are not part of the scene until a field holds them. The routes between the new
    /// nodes are added to the document's.
    ///
    /// # Errors
    /// Returns an error if the bytes exceed a limit.
    pub fn read_created(
        &mut self,
        name: &str,
        bytes: Vec<u8>,
        limits: &Limits,
    ) -> Result<Vec<NodeId>> {
        let first = self.nodes.len();
        let routes = std::mem::take(&mut self.routes);
        let stated = std::mem::take(&mut self.stated_routes);
        let read = read_into(
            self,
            name,
            FileBytes::Read(bytes),
            limits,
            Some(Header::vrml97()),
        );
        if read.is_ok() {
            inline::include(self, limits, first);
            expand::resolve_routes(self);
        }
        let created = std::mem::replace(&mut self.routes, routes);
        self.routes.extend(created);
        self.stated_routes = stated;
        Ok(read?.roots)
    }

    /// Returns the nodes that an event of a node belongs to, with its name in each. For an instance
    /// of a proto they are nodes of its body.
    pub fn event_ends(&self, node: NodeId, name: &str) -> Vec<(NodeId, Box<str>)> {
        expand::route_ends(self, node, name)
    }

    /// Removes every edge that closes a cycle, which events can create.
    pub(crate) fn cut_cycles(&mut self) {
        cycles::cut_cycles(self);
    }

    /// Reads a document from bytes. `otherwise` is used if they have no header.
    fn read_as(
        name: &str,
        bytes: FileBytes,
        loader: Arc<dyn Loader>,
        limits: &Limits,
        otherwise: Option<Header>,
    ) -> Result<Self> {
        let mut document = Self {
            loader: Some(loader),
            ..Self::default()
        };
        document.roots = read_into(&mut document, name, bytes, limits, otherwise)?.roots;
        inline::include(&mut document, limits, 0);
        expand::resolve_routes(&mut document);
        cycles::cut_cycles(&mut document);
        Ok(document)
    }
}
