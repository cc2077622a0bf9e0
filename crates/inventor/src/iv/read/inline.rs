//! Includes the files that `File`, `WWWInline` and `Inline` nodes refer to.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use ivcam_base::diag::Severity;
use ivcam_base::files::FileBytes;

use super::file::read_into;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{class, file, inline, www_inline};
use crate::iv::document::{ClassRef, Document};
use crate::iv::limits::Limits;
use crate::iv::loader::{Loader, is_absolute};

/// Includes the files that nodes refer to, and the files that those refer to. Nodes of the arena
/// before `first` are left as they are.
pub(super) fn include(document: &mut Document, limits: &Limits, first: usize) {
    let Some(loader) = document.loader.clone() else {
        return;
    };
    let mut inclusion = Inclusion {
        depth: vec![0; document.sources.len()],
        document,
        limits,
        loader,
        read: HashMap::new(),
        inside: HashMap::new(),
    };
    let mut next = first;
    while next < inclusion.document.nodes.len() {
        inclusion.node(NodeId(next as u32));
        next += 1;
    }
}

/// The state of including files.
struct Inclusion<'d> {
    document: &'d mut Document,
    limits: &'d Limits,
    loader: Arc<dyn Loader>,
    /// The source and the roots of each file that has been read, by its name.
    read: HashMap<String, (u16, Vec<NodeId>)>,
    /// The sources that each source includes. A cycle means that a file includes itself.
    inside: HashMap<u16, BTreeSet<u16>>,
    /// The number of files that each source is nested in.
    depth: Vec<usize>,
}

impl Inclusion<'_> {
    /// Includes the file that a node refers to, if it refers to one.
    fn node(&mut self, id: NodeId) {
        if self.document.is_template(id) {
            return;
        }
        let names = references(self.document, id);
        if names.is_empty() {
            return;
        }
        let from = self.document.nodes[id.0 as usize].source;
        let source = self.document.sources[usize::from(from)].clone();
        let before = self.document.sink.set_source(Some(source.clone()));
        let outcome = names
            .iter()
            .map(|n| self.loader.load(&source.name, n).map(|found| (n, found)))
            .reduce(|best, next| if best.is_ok() { best } else { next });
        let span = self.document.nodes[id.0 as usize].span;
        match outcome {
            Some(Ok((reference, (name, bytes)))) => {
                if is_absolute(reference) {
                    let message =
                        format!("`{reference}` is an absolute path; `{name}` is used instead");
                    self.document.sink.warn(span, message);
                }
                self.file(id, name, bytes);
            }
            Some(Err(error)) => {
                let help = error.help.clone();
                let warning = self.document.sink.warn(span, error.message.clone());
                if let Some(help) = help {
                    warning.help(help);
                }
            }
            None => {}
        }
        self.document.sink.set_source(before);
    }

    /// Makes the roots of a file the children of the node that includes it.
    fn file(&mut self, id: NodeId, name: String, bytes: Vec<u8>) {
        let node = &self.document.nodes[id.0 as usize];
        let (from, span) = (node.source, node.span);
        let known = self.read.get(&name).cloned();
        let depth = self.depth[usize::from(from)] + 1;
        let target = known.as_ref().map(|(target, _)| *target);
        let is_inside = |target| reaches(&self.inside, target, from);
        if name == self.document.sources[usize::from(from)].name || target.is_some_and(is_inside) {
            let message = format!("`{name}` includes itself; the inner one is left out");
            self.document.sink.warn(span, message);
            return;
        }
        if depth > self.limits.include_depth || self.read.len() >= self.limits.files {
            let message = format!("`{name}` is left out: too many included files");
            let warning = self.document.sink.warn(span, message);
            warning.help(
                "`--scene-limit files=N` and `--scene-limit include-depth=N` raise the limits",
            );
            return;
        }
        let total = |own: usize| {
            let sources = self.document.sources.iter().map(|s| s.len());
            sources.fold(own, usize::saturating_add)
        };
        if known.is_none() && total(bytes.len()) > self.limits.bytes {
            let most = self.limits.bytes;
            let message = format!("`{name}` is left out: the files have more than {most} bytes");
            let warning = self.document.sink.warn(span, message);
            warning.help("`--scene-limit bytes=N` raises the limit");
            return;
        }
        let (target, roots) = known.unwrap_or_else(|| self.read(name, bytes, depth));
        self.inside.entry(from).or_default().insert(target);
        self.document.included.insert(id, roots);
    }

    /// Reads a file for the first time and returns its source and its roots. A file that cannot be
    /// read has no roots.
    fn read(&mut self, name: String, bytes: Vec<u8>, depth: usize) -> (u16, Vec<NodeId>) {
        let target = self.document.sources.len() as u16;
        let roots = match read_into(
            self.document,
            &name,
            FileBytes::Read(bytes),
            self.limits,
            None,
        ) {
            Ok(file) => file.roots,
            Err(error) => {
                self.document.sink.add(*error.at_most(Severity::Warning));
                Vec::new()
            }
        };
        if self.document.sources.len() > usize::from(target) {
            self.depth.resize(self.document.sources.len(), depth);
            self.read.insert(name, (target, roots.clone()));
        }
        (target, roots)
    }
}

/// Returns the files that a node refers to, in the order in which they are tried. An `Inline` whose
/// `load` is false, as X3D allows, refers to none.
fn references(document: &Document, id: NodeId) -> Vec<String> {
    let node = document.nodes[id.0 as usize].class;
    let index = match node {
        ClassRef::Known(class::FILE) => file::NAME.index,
        ClassRef::Known(class::WWW_INLINE) => www_inline::NAME.index,
        ClassRef::Known(class::INLINE) => inline::URL.index,
        _ => return Vec::new(),
    };
    let fields = &document.nodes[id.0 as usize].fields;
    if node == ClassRef::Known(class::INLINE) && !document.node(id).get(inline::LOAD) {
        return Vec::new();
    }
    match fields
        .iter()
        .find(|f| f.index == index && !f.ignored)
        .map(|f| &f.value)
    {
        Some(Value::String(name)) if !name.is_empty() && !name.starts_with('<') => {
            vec![name.to_string()]
        }
        Some(Value::Strings(urls)) => urls.clone(),
        _ => Vec::new(),
    }
}

/// Returns whether one source includes another, directly or through others.
fn reaches(inside: &HashMap<u16, BTreeSet<u16>>, from: u16, to: u16) -> bool {
    let mut stack = vec![from];
    let mut seen = BTreeSet::new();
    while let Some(source) = stack.pop() {
        if source == to {
            return true;
        }
        if seen.insert(source) {
            stack.extend(inside.get(&source).into_iter().flatten());
        }
    }
    false
}
