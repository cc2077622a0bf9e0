//! The snapshot; `take` creates it.

use std::borrow::Cow;

use ivcam_base::diag::Diagnostic;

use super::events::ScriptEngine;
use crate::iv::Document;

/// The options of a snapshot.
#[derive(Clone, Copy, Debug, Default)]
pub struct SnapshotOptions {
    /// Seconds since the scene was opened. Default: 0. A time that is not finite counts as 0.
    pub time: f64,
    /// Whether the handles of draggers and manipulators are added. Default: no.
    pub handles: bool,
    /// The engine that runs scripts. Default: none, so that each script is reported as not run.
    pub scripts: Option<&'static dyn ScriptEngine>,
}

/// A document at one time.
#[derive(Clone, Debug)]
pub struct Snapshot<'a> {
    pub(super) document: Cow<'a, Document>,
    time: f64,
    pub(super) has_handles: bool,
    /// The number of diagnostics that the document had before.
    known_diagnostics: usize,
}

impl<'a> Snapshot<'a> {
    /// Creates a snapshot of a document that is still being evaluated.
    pub(super) fn of_part(document: &'a Document, time: f64) -> Self {
        Self {
            document: Cow::Borrowed(document),
            time,
            has_handles: false,
            known_diagnostics: document.sink.items().len(),
        }
    }

    /// Returns the evaluated document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Returns the time in seconds since the scene was opened.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Returns whether the document has the handles of draggers and manipulators.
    pub fn has_handles(&self) -> bool {
        self.has_handles
    }

    /// Returns the diagnostics about engines and routes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        let all = self.document.sink.items();
        all.get(self.known_diagnostics..).unwrap_or_default()
    }
}
