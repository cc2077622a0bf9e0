//! The formats in which a document is written, and the features that a format cannot express.

use std::collections::HashMap;
use std::io;

use super::protos::protos_by_body;
use super::{ascii, binary};
use crate::iv::document::Document;

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

impl Document {
    /// Writes the document and returns the file's bytes.
    pub fn write(&self, format: Format) -> Vec<u8> {
        let mut bytes = Vec::new();
        let written = self.write_to(format, &mut bytes);
        written.expect("memory takes all bytes");
        bytes
    }

    /// Writes the document in pieces of at most 64 kB and a string, so that a large file is never in
    /// memory whole. It ends early if the work is stopped, which the caller must ask for.
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

    /// Returns one message for each feature of this document that a format cannot express.
    pub fn losses(&self, format: Format) -> Vec<String> {
        if format == Format::Ascii {
            return Vec::new();
        }
        let mut out = Vec::new();
        if !self.protos.list.is_empty() {
            out.push(
                "the binary format has no protos; their instances are written expanded".into(),
            );
        }
        if !self.routes.is_empty() {
            out.push(format!(
                "{} routes are left out, which the binary format cannot express",
                self.routes.len()
            ));
        }
        let with_interface = self.extensions.iter().filter(|e| !e.interface.is_empty());
        let count = with_interface.count();
        if count > 0 {
            out.push(format!(
                "the interfaces of {count} scripts are left out, which the binary format cannot \
                 express"
            ));
        }
        let skipped = self
            .extensions
            .iter()
            .filter(|e| e.fields.is_empty() && e.is_a.is_empty());
        let names: Vec<String> = skipped.map(|e| format!("`{}`", e.name)).collect();
        if !names.is_empty() {
            let names = names.join(", ");
            out.push(format!(
                "the contents of {names} are left out: the file does not declare their fields"
            ));
        }
        out
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
