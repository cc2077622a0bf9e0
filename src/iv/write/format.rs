//! The formats in which a document is written, and what each cannot express.

use super::{ascii, binary};
use crate::iv::document::Document;

/// The formats that [`Document::write`] knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Inventor V2.1 ASCII, or VRML97 for a document that was read from VRML97.
    Ascii,
    /// Inventor V2.1 binary. It has no protos, which are written expanded, and no routes or
    /// interfaces of scripts, which are left out.
    Binary,
}

impl Document {
    /// Writes the document.
    pub fn write(&self, format: Format) -> Vec<u8> {
        match format {
            Format::Ascii => ascii::write(self),
            Format::Binary => binary::write(self),
        }
    }

    /// Lists what a format cannot express of this document.
    pub fn losses(&self, format: Format) -> Vec<String> {
        if format == Format::Ascii {
            return Vec::new();
        }
        let mut out = Vec::new();
        if !self.protos.list.is_empty() {
            out.push(
                "the binary form has no protos; what stands for their instances is written".into(),
            );
        }
        if !self.routes.is_empty() {
            out.push(format!(
                "{} routes are left out, which the binary form lacks",
                self.routes.len()
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
                "the contents of {names} are left out: nothing says what they are"
            ));
        }
        out
    }

    /// Whether the file was VRML97.
    pub(crate) fn is_vrml97(&self) -> bool {
        self.format.starts_with("VRML V2.0")
    }
}
