//! Takes snapshots: delivers events, evaluates engines, then adds handles.

use std::borrow::Cow;

use super::options::SnapshotOptions;
use super::play::play;
use crate::iv::Document;
use crate::snapshot::{Bounds, NoBounds, Snapshot, engines, handles};

impl<'a> Snapshot<'a> {
    /// Delivers the events up to the time, evaluates the document's engines, and adds handles if
    /// `options` request them. The document is copied only if this changes it.
    pub fn take(document: &'a Document, options: &SnapshotOptions, bounds: &dyn Bounds) -> Self {
        let time = options.moment();
        let mut snapshot = Self::of_part(document, time);
        if let Some(played) = play(document, options) {
            snapshot.document = Cow::Owned(played.document);
            snapshot.bound = played.bound;
            snapshot.sent = played.sent;
        }
        if let Some(evaluated) = engines::evaluate(snapshot.document(), time, bounds) {
            snapshot.document = Cow::Owned(evaluated);
        }
        if options.handles {
            let with_handles = handles::with_handles(&snapshot, bounds);
            snapshot.document = Cow::Owned(with_handles);
            snapshot.has_handles = true;
        }
        snapshot
    }

    /// Takes a snapshot at a time in seconds. Engines that need bounding boxes have no outputs.
    pub fn at(document: &'a Document, time: f64) -> Self {
        let options = SnapshotOptions {
            time,
            ..SnapshotOptions::default()
        };
        Self::take(document, &options, &NoBounds)
    }
}
