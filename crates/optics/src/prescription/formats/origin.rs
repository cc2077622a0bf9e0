//! The places in files of messages that are found after reading.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Source, Span};

use crate::prescription::text;

/// Adds the place of the list of zoom positions to a message: JSON's `zoom`, Zemax's `MNUM`, CODE
/// V's `ZOO`; without one, at the beginning.
pub(crate) fn at_zoom_list(error: Box<Diagnostic>, source: &Arc<Source>) -> Box<Diagnostic> {
    let source = text::decoded(source);
    let text = text::text(&source);
    let is_key = |at: &usize| text[at + 6..].trim_start().starts_with(':');
    let mut words = text.match_indices("\"zoom\"").map(|(at, _)| at);
    let lines = |key: &str| text.find(key).map(|at| Span::new(at + 1, at + key.len()));
    let span = words
        .find(is_key)
        .map(|at| Span::new(at, at + 6))
        .or_else(|| lines("\nMNUM"))
        .or_else(|| lines("\nZOO"))
        .unwrap_or(Span::at(0));
    error.at(&source, span)
}
