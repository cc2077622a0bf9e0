//! The stacks of bindable nodes (ISO 14772-1, 4.6.10).

use std::collections::HashMap;

use glam::DMat4;

use crate::iv::NodeId;
use crate::snapshot::{BindableKind, BoundNodes};

/// The bindable nodes that were bound, by kind. The last of a stack is bound.
#[derive(Debug)]
pub(super) struct BindingStacks {
    pub(super) stacks: [Vec<NodeId>; BindableKind::COUNT],
    /// The transform from the viewer to the bound `Viewpoint`.
    pub(super) viewpoint_from_viewer: DMat4,
    /// The transforms of `Viewpoint`s that are on the stack and not bound.
    pub(super) saved: HashMap<NodeId, DMat4>,
    /// Whether an event has bound or unbound a node.
    pub(super) is_changed: bool,
}

impl BindingStacks {
    /// Begins with the first node of each kind.
    pub(super) fn new(first: [Option<NodeId>; BindableKind::COUNT]) -> Self {
        Self {
            stacks: first.map(|node| node.into_iter().collect()),
            viewpoint_from_viewer: DMat4::IDENTITY,
            saved: HashMap::new(),
            is_changed: false,
        }
    }

    /// Returns the bound node of a kind.
    pub(super) fn top(&self, kind: BindableKind) -> Option<NodeId> {
        self.stacks[kind as usize].last().copied()
    }

    /// Returns the bound nodes, if events have changed which.
    pub(super) fn bound(&self) -> Option<BoundNodes> {
        let tops = || [0, 1, 2, 3].map(|kind: usize| self.stacks[kind].last().copied());
        self.is_changed
            .then(|| BoundNodes::new(tops(), self.viewpoint_from_viewer))
    }
}
