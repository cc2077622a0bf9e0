//! The formats in which a document is written, and the features that a format cannot express.

use std::collections::{HashMap, HashSet};
use std::io;

use ivcam_base::diag::counted;

use super::protos::{protos_by_body, targets};
use super::text_values::needs_blank;
use super::{ascii, binary};
use crate::grammar::value::{NodeId, Value};
use crate::iv::declarations::Extension;
use crate::iv::document::{ClassRef, Document, FieldEntry, NodeRef};
use crate::iv::encoding::Escapes;

/// A format that [`Document::write`] can write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The text format: VRML97 for a document that was read from VRML97, X3D's classic encoding for
    /// one that was read as nodes of X3D, Inventor V2.1 otherwise.
    Ascii,
    /// Inventor V2.1 binary. The format has no protos, so they are written expanded. It has no
    /// routes and no script interfaces, so they are left out.
    Binary,
}

/// A feature of a document that a format cannot express.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormatLoss {
    /// The name of the feature, for programs.
    pub code: &'static str,
    /// What becomes of it, in lower case.
    pub text: String,
    /// The first node that it is about.
    pub node: Option<NodeId>,
}

impl Document {
    /// Writes the document and returns the file's bytes. One of VRML is first to be put in
    /// Inventor's terms ([`Document::in_inventor`]).
    pub fn write(&self, format: Format) -> Vec<u8> {
        let mut bytes = Vec::new();
        let written = self.write_to(format, &mut bytes);
        written.expect("memory takes all bytes");
        bytes
    }

    /// Writes the document in pieces of at most 64 kB and a string, so that a large file is never
    /// in memory whole. It ends early if the work is stopped, which the caller must ask for.
    ///
    /// # Errors
    /// Returns the first error of the destination.
    pub fn write_to(&self, format: Format, to: &mut dyn io::Write) -> io::Result<()> {
        match format {
            Format::Ascii => ascii::write(self, to),
            Format::Binary => binary::write(self, to),
        }
    }

    /// Returns the endings, without a dot, of the names of files that hold what [`Document::write`]
    /// writes.
    pub fn written_endings(&self, format: Format) -> &'static [&'static str] {
        if format == Format::Ascii && self.is_vrml97() {
            &["wrl", "vrml"]
        } else if format == Format::Ascii && self.is_x3d() {
            &["x3dv"]
        } else {
            &["iv"]
        }
    }

    /// Returns the features of this document that a format cannot express.
    pub fn losses(&self, format: Format) -> Vec<FormatLoss> {
        let mut out = self.unwritten_edits(format);
        if format == Format::Ascii {
            out.extend(self.lengthened_strings());
            return out;
        }
        let mut lost = |code, text: String, node| out.push(FormatLoss { code, text, node });
        if let Some(proto) = self.protos.list.first() {
            let text = "the binary format has no protos; their instances are written expanded";
            lost("protos", text.into(), self.first_of(proto.extension));
        }
        if let Some(route) = self.routes.first() {
            let count = self.routes.len();
            let text =
                format!("{count} routes are left out, which the binary format cannot express");
            lost("routes", text, Some(route.to));
        }
        let extensions = || (0..).zip(&self.extensions);
        let scripts: Vec<u32> = extensions()
            .filter(|(_, e)| !e.interface.is_empty())
            .map(|(i, _)| i)
            .collect();
        if let Some(&first) = scripts.first() {
            let count = scripts.len();
            let text = format!(
                "the interfaces of {count} scripts are left out, which the binary format cannot \
                 express"
            );
            lost("script-interfaces", text, self.first_of(first));
        }
        let is_proto = |i: u32| self.protos.list.iter().any(|proto| proto.extension == i);
        // An extension without fields may be that of a node before its declaration was read.
        let classes: HashSet<ClassRef> = self.nodes.iter().map(|node| node.class).collect();
        let is_used = |i: u32| classes.contains(&ClassRef::Extension(i));
        let unknown: Vec<(u32, &Extension)> = extensions()
            .filter(|(_, e)| e.fields.is_empty() && e.is_a.is_empty())
            .filter(|(i, _)| is_used(*i) && !is_proto(*i))
            .collect();
        if let Some((first, _)) = unknown.first() {
            let names = unknown.iter().map(|(_, e)| format!("`{}`", e.name));
            let names = names.collect::<Vec<_>>().join(", ");
            let text = format!(
                "the contents of {names} are left out: the file does not declare their fields"
            );
            lost("unknown-fields", text, self.first_of(*first));
        }
        out
    }

    /// Returns the nodes whose fields were set ([`Document::set`]) and that the format does not
    /// write: those of included files, and in text those of a proto's instance, which reading makes
    /// again from the proto.
    pub fn unwritten_edits(&self, format: Format) -> Vec<FormatLoss> {
        if self.edited.is_empty() {
            return Vec::new();
        }
        let written = self.written(format);
        let lost = self.edited.iter().filter(|id| !written.contains(id));
        let loss = |id: &NodeId| {
            let node = NodeRef {
                document: self,
                id: *id,
            };
            let place = match node.source().filter(|_| node.data().source != 0) {
                Some(file) => format!("`{}`, which the scene only names", file.name),
                None => "an instance of a proto, which is written as it was".to_owned(),
            };
            let class = node.class_name();
            FormatLoss {
                code: "edited-field",
                text: format!("what was set in a `{class}` is not written: it is in {place}"),
                node: Some(*id),
            }
        };
        lost.map(loss).collect()
    }

    /// Returns the nodes of the scene that the format writes.
    fn written(&self, format: Format) -> HashSet<NodeId> {
        let mut pending = self.roots.clone();
        let mut written = HashSet::new();
        while let Some(mut id) = pending.pop() {
            if format == Format::Binary {
                id = self.node(id).id;
            }
            if written.insert(id) {
                pending.extend(targets(self, id));
            }
        }
        written
    }

    /// Returns the loss of text whose strings in quotes cannot end in a backslash.
    fn lengthened_strings(&self) -> Option<FormatLoss> {
        let escapes = self.escapes();
        let count_of = |field: &FieldEntry| match &field.value {
            Value::String(text) => usize::from(needs_blank(text, escapes)),
            Value::Strings(list) => list.iter().filter(|s| needs_blank(s, escapes)).count(),
            _ => 0,
        };
        let counts = self
            .nodes
            .iter()
            .map(|n| n.fields.iter().map(count_of).sum());
        let counts: Vec<usize> = counts.collect();
        let first = counts.iter().position(|&count| count > 0)?;
        Some(FormatLoss {
            code: "final-backslash",
            text: format!(
                "a blank is added to {}: the format has none that end in a backslash",
                counted(counts.iter().sum(), "string")
            ),
            node: Some(NodeId(first as u32)),
        })
    }

    /// Returns the escapes within the strings of the document's text format.
    pub(super) fn escapes(&self) -> Escapes {
        Escapes::of(self.is_vrml97() || self.is_x3d())
    }

    /// Returns the first node of a class that the file declares.
    fn first_of(&self, extension: u32) -> Option<NodeId> {
        let mut nodes = self.nodes.iter();
        let place = nodes.position(|node| node.class == ClassRef::Extension(extension));
        place.map(|place| NodeId(place as u32))
    }

    /// Returns the indices of the file's own protos, grouped by the proto whose body declares them.
    /// Each proto comes after the protos that it uses.
    pub fn protos_by_body(&self) -> HashMap<Option<usize>, Vec<usize>> {
        protos_by_body(self)
    }

    /// Returns whether the file was VRML97.
    pub fn is_vrml97(&self) -> bool {
        self.format.starts_with("VRML V2.0")
    }

    /// Returns whether textures of the file multiply the color of a material, as in X3D 4 and glTF.
    pub fn multiplies_textures(&self) -> bool {
        self.multiplying.contains(&0)
    }

    /// Returns whether the file was X3D, or of a format that is read as nodes of X3D: glTF, OBJ,
    /// PLY or STL.
    pub fn is_x3d(&self) -> bool {
        let formats = ["X3D", "glTF", "OBJ", "PLY", "STL"];
        formats.iter().any(|format| self.format.starts_with(format))
    }
}
