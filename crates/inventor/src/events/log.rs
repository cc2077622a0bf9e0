//! The record of the events that a scene sends.

use std::collections::HashMap;
use std::sync::Arc;

use crate::iv::{Document, NodeId};
use crate::snapshot::SentEvent;

/// The largest number of events that are recorded.
pub(super) const MAX_LOGGED: usize = 10_000;

/// The events that were sent so far, with the names of the nodes.
#[derive(Debug)]
pub(super) struct EventLog {
    pub(super) names: HashMap<NodeId, Arc<str>>,
    pub(super) sent: Vec<SentEvent>,
    /// Whether the limit was reported.
    pub(super) is_full: bool,
}

impl EventLog {
    /// Begins a record.
    pub(super) fn new(document: &Document) -> Self {
        let names = document.names.iter();
        let names = names.map(|(name, id)| (document.node(*id).id, name.clone()));
        Self {
            names: names.collect(),
            sent: Vec::new(),
            is_full: false,
        }
    }
}
