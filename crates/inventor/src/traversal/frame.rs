//! The entries of a walk's stack, which are the steps still to be done.

use std::sync::Arc;

use glam::DMat4;

use super::copies::Copies;
use super::state::State;
use super::steps::Step;
use crate::iv::{NodeId, NodeRef};

/// A step of a walk.
pub(super) enum WalkFrame<'a> {
    /// Visits a node of the document.
    Visit(NodeId),
    /// Visits a node with default values, which a kit makes.
    VisitDefault(NodeRef<'a>),
    /// Walks the nodes of a list from an index on.
    List { list: &'a [NodeId], next: usize },
    /// Leaves a node with children.
    Leave(NodeId),
    /// Restores the state.
    Restore(Box<State<'a>>),
    /// Restores the state and ends a separator.
    Close(Box<State<'a>>),
    /// Restores the matrix only, with its steps.
    RestoreMatrix(DMat4, Option<Arc<Step>>),
    /// Does some steps inside a separator that a kit makes.
    Scope {
        /// The steps, in order.
        inner: Vec<WalkFrame<'a>>,
        /// Whether only the matrix is restored at the end.
        matrix_only: bool,
    },
    /// Walks a node's children once for each remaining copy of an array.
    Copies {
        node: NodeRef<'a>,
        copies: Copies<'a>,
        /// The number of the next copy, which a `Switch` below may inherit.
        next: u64,
        /// The number of visits before the last copy.
        visits: u64,
    },
    /// Draws the geometry of a VRML97 `Shape` after its appearance.
    Geometry { shape: NodeRef<'a> },
}
