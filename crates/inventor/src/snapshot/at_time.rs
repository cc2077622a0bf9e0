//! The snapshot; `events` takes it.

use std::borrow::Cow;

use ivcam_base::diag::Diagnostic;

use super::bound::BoundNodes;
use crate::iv::Document;

/// An event that a node sent.
#[derive(Clone, Debug, PartialEq)]
pub struct SentEvent {
    /// Seconds since the scene was opened.
    pub time: f64,
    /// The node's name, or its class if it has none.
    pub node: String,
    /// The name of the event.
    pub event: String,
    /// The value, as a file states it, with the name of a node in place of the node.
    pub value: String,
}

/// A document at one time.
#[derive(Clone, Debug)]
pub struct Snapshot<'a> {
    pub(crate) document: Cow<'a, Document>,
    time: f64,
    pub(crate) has_handles: bool,
    /// The bindable nodes that events have bound.
    pub(crate) bound: Option<BoundNodes>,
    /// The events that were recorded.
    pub(crate) sent: Vec<SentEvent>,
    /// The number of diagnostics that the document had before.
    known_diagnostics: usize,
}

impl<'a> Snapshot<'a> {
    /// Creates a snapshot of a document that is still being evaluated.
    pub(crate) fn of_part(document: &'a Document, time: f64) -> Self {
        Self {
            document: Cow::Borrowed(document),
            time,
            has_handles: false,
            bound: None,
            sent: Vec::new(),
            known_diagnostics: document.sink.items().len(),
        }
    }

    /// Returns the evaluated document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Returns the evaluated document, which is copied if nothing changed it.
    pub fn into_document(self) -> Document {
        self.document.into_owned()
    }

    /// Returns the time in seconds since the scene was opened.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Returns whether the document has the handles of draggers and manipulators.
    pub fn has_handles(&self) -> bool {
        self.has_handles
    }

    /// Returns the bindable nodes that are bound, if events have changed which. Otherwise the first
    /// of each kind is bound (ISO 14772-1, 4.6.10).
    pub fn bound(&self) -> Option<&BoundNodes> {
        self.bound.as_ref()
    }

    /// Returns the events that nodes have sent, if the options asked for them.
    pub fn sent(&self) -> &[SentEvent] {
        &self.sent
    }

    /// Returns the diagnostics about engines and routes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        let all = self.document.sink.items();
        all.get(self.known_diagnostics..).unwrap_or_default()
    }
}
