//! JSON texts: their errors, and the places of surfaces in them.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Source, Span};
use serde::de::IgnoredAny;
use serde_json::{Deserializer, Value};

use crate::prescription::formats::reader::SurfaceSpans;

/// Parses a JSON text.
pub(super) fn parse(source: &Arc<Source>) -> Result<Value> {
    serde_json::from_slice(&source.bytes).map_err(|error| {
        let offset = offset_of(&source.bytes, error.line(), error.column());
        let rest = source.bytes.get(offset..).unwrap_or_default();
        let no_number = ["NaN", "Infinity", "-Infinity", "nan", "inf", "-inf"]
            .into_iter()
            .find(|word| rest.starts_with(word.as_bytes()));
        let message = match no_number {
            Some(word) => format!("`{word}` is not a number"),
            None => format!("this is not valid JSON: {}", reason(&error)),
        };
        Diagnostic::error(message).at(source, Span::at(offset))
    })
}

/// The message of serde_json without its position, because the diagnostic has its own.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line")
        .map_or(text.clone(), |(reason, _)| reason.to_owned())
}

fn offset_of(bytes: &[u8], line: usize, column: usize) -> usize {
    let start: usize = bytes
        .split_inclusive(|&b| b == b'\n')
        .take(line.saturating_sub(1))
        .map(<[u8]>::len)
        .sum();
    (start + column.saturating_sub(1)).min(bytes.len())
}

/// Where each of the `surfaces` stands in a text, which is valid JSON.
pub(super) struct JsonPlaces {
    objects: Vec<(usize, usize)>,
    bytes: Arc<Source>,
}

impl JsonPlaces {
    /// Finds the elements of the list.
    pub(super) fn new(source: &Arc<Source>) -> Self {
        let bytes = &source.bytes;
        let key = b"\"surfaces\"";
        let found = bytes.windows(key.len()).position(|w| w == key);
        let mut at = found.map_or(bytes.len(), |at| at + key.len());
        at += count(&bytes[at..], |b| *b != b'[');
        let mut objects = Vec::new();
        while at < bytes.len() {
            // Here is the bracket that opens the list, or the comma behind an element.
            at += 1;
            at += count(&bytes[at..], u8::is_ascii_whitespace);
            let mut elements = Deserializer::from_slice(&bytes[at..]).into_iter::<IgnoredAny>();
            let Some(Ok(_)) = elements.next() else { break };
            let end = at + elements.byte_offset();
            objects.push((at, end));
            at = end + count(&bytes[end..], |b| *b != b',' && *b != b']');
        }
        Self {
            objects,
            bytes: source.clone(),
        }
    }

    /// The place at which the object of a surface begins.
    pub(super) fn object(&self, surface: usize) -> Span {
        let (from, _) = self.objects.get(surface).copied().unwrap_or((0, 0));
        Span::new(from, from + 1)
    }

    /// The values of the columns of a surface: each is that of the first of the names that the
    /// surface has.
    pub(super) fn columns(&self, surface: usize, names: [&[&str]; 4]) -> SurfaceSpans {
        names.map(|names| self.value(surface, names))
    }

    /// The value of the first of these names that a surface has, or the place at which its object
    /// begins.
    pub(super) fn value(&self, surface: usize, names: &[&str]) -> Span {
        let (from, to) = self.objects.get(surface).copied().unwrap_or((0, 0));
        let text = &self.bytes.bytes[from..to];
        let found = names.iter().find_map(|name| {
            let key = format!("\"{name}\"");
            let at = text.windows(key.len()).position(|w| w == key.as_bytes());
            at.map(|at| at + key.len())
        });
        let Some(at) = found else {
            return self.object(surface);
        };
        let begin = at + count(&text[at..], |b| b.is_ascii_whitespace() || *b == b':');
        let end = begin
            + count(&text[begin..], |b| {
                !b.is_ascii_whitespace() && !b",}]".contains(b)
            });
        Span::new(from + begin, from + end)
    }
}

/// The number of bytes at the beginning of a text that are of a kind.
fn count(text: &[u8], is_of_kind: fn(&u8) -> bool) -> usize {
    text.iter().take_while(|b| is_of_kind(b)).count()
}
