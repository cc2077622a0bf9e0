//! A list that collects diagnostics and counts repeated ones.

use std::collections::HashMap;
use std::sync::Arc;

use super::diagnostic::{Diagnostic, ErrorKind, Severity};
use super::source::{Source, Span};

/// A list of diagnostics. A message that is reported again is counted and not added.
#[derive(Clone, Debug, Default)]
pub struct Sink {
    items: Vec<Diagnostic>,
    seen: HashMap<(Severity, String), usize>,
    source: Option<Arc<Source>>,
}

impl Sink {
    /// Creates an empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the source that later spans refer to. Returns the previous source, which the caller
    /// sets again when it is done.
    pub fn set_source(&mut self, source: Option<Arc<Source>>) -> Option<Arc<Source>> {
        std::mem::replace(&mut self.source, source)
    }

    /// Adds a warning about a range of the current source.
    pub fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.add_here(Severity::Warning, span, message)
    }

    /// Adds a warning that the current source is damaged at a range.
    pub fn damage(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        let warning = self.warn(span, message);
        warning.kind = ErrorKind::Damaged;
        warning
    }

    /// Adds a note about a range of the current source.
    pub fn note(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.add_here(Severity::Note, span, message)
    }

    fn add_here(
        &mut self,
        severity: Severity,
        span: Span,
        message: impl Into<String>,
    ) -> &mut Diagnostic {
        let place = self.source.clone().map(|s| (s, span));
        self.add(Diagnostic {
            kind: ErrorKind::Syntax,
            place,
            ..Diagnostic::new(severity, message)
        })
    }

    /// Adds a diagnostic, or counts it if the list already has the same message.
    pub fn add(&mut self, diagnostic: Diagnostic) -> &mut Diagnostic {
        let key = (diagnostic.severity, diagnostic.message.clone());
        let next = self.items.len();
        let index = *self.seen.entry(key).or_insert(next);
        if index == next {
            self.items.push(diagnostic);
        } else {
            self.items[index].count += diagnostic.count;
        }
        &mut self.items[index]
    }

    /// Adds a copy of a diagnostic about something that the work goes on without: an error becomes
    /// a warning.
    pub fn add_at_most_warning(&mut self, diagnostic: &Diagnostic) {
        let copy = Box::new(diagnostic.clone());
        self.add(*copy.at_most(Severity::Warning));
    }

    /// Returns whether the list has a message.
    pub fn has(&self, message: &str) -> bool {
        self.items.iter().any(|item| item.message == message)
    }

    /// Creates an error about a range of the current source. It is not added to the list.
    pub fn error(&self, span: Span, message: impl Into<String>) -> Box<Diagnostic> {
        let error = Diagnostic::error(message);
        match &self.source {
            Some(source) => error.at(source, span),
            None => error,
        }
    }

    /// Returns the diagnostics in the order in which they were first reported.
    pub fn items(&self) -> &[Diagnostic] {
        &self.items
    }

    /// Moves the places in a source of the diagnostics from an index on. A reader does so that has
    /// read a text made from the source.
    pub fn move_places(&mut self, first: usize, source: &Arc<Source>, to: impl Fn(Span) -> Span) {
        for item in &mut self.items[first..] {
            if let Some((at, span)) = &mut item.place
                && Arc::ptr_eq(at, source)
            {
                *span = to(*span);
            }
        }
    }

    /// Adds all diagnostics of another sink.
    pub fn extend_from(&mut self, other: &Sink) {
        for item in &other.items {
            self.add(item.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_twice_is_one_with_a_count() {
        let mut sink = Sink::new();
        sink.warn(Span::at(0), "odd");
        sink.warn(Span::at(9), "odd");
        assert_eq!((sink.items().len(), sink.items()[0].count), (1, 2));
    }
}
