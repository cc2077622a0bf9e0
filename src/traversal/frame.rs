//! The entries of the walk's stack: what is still to be done.

use glam::DMat4;

use super::state::State;
use crate::iv::{NodeId, NodeRef};

pub(super) enum Frame<'a> {
    Visit(NodeId),
    VisitDefault(NodeRef<'a>),
    /// Walks the nodes of a list from an index on.
    List {
        list: &'a [NodeId],
        next: usize,
    },
    Leave(NodeId),
    Restore(Box<State<'a>>),
    /// Restores the state at the end of a separator.
    Close(Box<State<'a>>),
    RestoreMatrix(DMat4),
    /// Frames in walking order, inside a separator that a kit makes.
    Scope {
        inner: Vec<Frame<'a>>,
        matrix_only: bool,
    },
    /// Walks a node's children under a further matrix.
    Place {
        node: NodeRef<'a>,
        matrix: DMat4,
        choice: i32,
    },
    Geometry {
        shape: NodeRef<'a>,
    },
}
