//! What waits on the walk's stack.

use glam::DMat4;

use super::state::State;
use crate::iv::{NodeId, NodeRef};

pub(super) enum Frame<'a> {
    Visit(NodeId),
    VisitDefault(NodeRef<'a>),
    /// The children of a list from an index on.
    List {
        list: &'a [NodeId],
        next: usize,
    },
    Leave(NodeId),
    Restore(Box<State<'a>>),
    /// The same at the end of a separator.
    Close(Box<State<'a>>),
    RestoreMatrix(DMat4),
    /// Frames, the first to be walked first, inside a separator that a kit makes.
    Scope {
        inner: Vec<Frame<'a>>,
        matrix_only: bool,
    },
    /// A subtree walked again under another matrix.
    Place {
        node: NodeRef<'a>,
        matrix: DMat4,
        choice: i32,
    },
    Geometry {
        shape: NodeRef<'a>,
    },
}
