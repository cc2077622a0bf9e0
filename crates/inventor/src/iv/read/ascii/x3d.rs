//! Reads the statements at the beginning of a file in X3D's classic encoding (ISO/IEC 19776-2).

use super::reader::AsciiReader;
use crate::iv::read::tokens::{skip, string, word};

impl<'s> AsciiReader<'_, '_, 's> {
    /// Reads a statement whose keyword has been read. Returns `false`, and reads nothing, if the
    /// word is no keyword.
    pub(super) fn x3d_statement(&mut self, keyword: &[u8], rest: &'s [u8]) -> bool {
        let start = self.rest;
        match keyword {
            b"PROFILE" | b"COMPONENT" => self.rest = past_word(rest),
            b"META" => self.meta(rest),
            b"UNIT" => {
                self.rest = past_word(past_word(past_word(rest)));
                let span = self.span(start, self.rest);
                self.warn(
                    span,
                    "units are not converted; numbers are used as they are stated",
                );
            }
            b"EXPORT" => self.rest = self.past_renaming(past_word(rest)),
            b"IMPORT" => {
                let rest = skip(past_word(rest));
                let rest = rest.strip_prefix(b".").map_or(rest, past_word);
                self.rest = self.past_renaming(rest);
                let span = self.span(start, self.rest);
                self.warn(span, "nodes of an included file cannot be imported")
                    .help("routes to them are left out");
            }
            _ => return false,
        }
        true
    }

    /// Reads the name and the content of a `META` statement.
    fn meta(&mut self, rest: &'s [u8]) {
        self.rest = rest;
        let escapes = self.asm.header.escapes();
        let Ok((rest, name)) = string(skip(rest), escapes) else {
            return;
        };
        let Ok((rest, content)) = string(skip(rest), escapes) else {
            return;
        };
        self.rest = rest;
        if self.asm.source == 0 {
            self.asm.document.meta.push((name, content));
        }
    }

    /// Returns the input after `AS name`, if that comes next.
    fn past_renaming(&self, rest: &'s [u8]) -> &'s [u8] {
        match word(skip(rest)) {
            Ok((after, b"AS")) => past_word(after),
            _ => rest,
        }
    }
}

/// Returns the input after a word.
fn past_word(rest: &[u8]) -> &[u8] {
    word(skip(rest)).map_or(rest, |(rest, _)| rest)
}
