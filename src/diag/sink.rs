//! Collects diagnostics.

use std::collections::HashMap;
use std::sync::Arc;

use super::diagnostic::{Diagnostic, Severity};
use super::source::{Source, Span};

/// Collects diagnostics. The same mistake a thousand times is one message with a count.
#[derive(Clone, Debug, Default)]
pub struct Sink {
    items: Vec<Diagnostic>,
    seen: HashMap<(Severity, String), usize>,
    source: Option<Arc<Source>>,
}

impl Sink {
    pub fn new() -> Self {
        Self::default()
    }

    /// Spans given from now on are in this source. Returns the one before, to be put back.
    pub(crate) fn set_source(&mut self, source: Option<Arc<Source>>) -> Option<Arc<Source>> {
        std::mem::replace(&mut self.source, source)
    }

    pub(crate) fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        let place = self.source.clone().map(|s| (s, span));
        self.add(Diagnostic {
            place,
            ..Diagnostic::new(Severity::Warning, message)
        })
    }

    pub(crate) fn note(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        let place = self.source.clone().map(|s| (s, span));
        self.add(Diagnostic {
            place,
            ..Diagnostic::new(Severity::Note, message)
        })
    }

    /// Adds one, or counts it where the same message was said before.
    pub(crate) fn add(&mut self, diagnostic: Diagnostic) -> &mut Diagnostic {
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

    /// An error made for the current source, to be returned.
    pub(crate) fn error(&self, span: Span, message: impl Into<String>) -> Box<Diagnostic> {
        let error = Diagnostic::error(message);
        match &self.source {
            Some(source) => error.at(source, span),
            None => error,
        }
    }

    pub fn items(&self) -> &[Diagnostic] {
        &self.items
    }

    /// Adds everything that another sink has.
    pub(crate) fn extend_from(&mut self, other: &Sink) {
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
