//! Walks a document by Inventor's rules of state, and calls a visitor for what it meets.
//!
//! The stack is a `Vec`, so that depth costs memory and not the program's stack. A node that contains
//! itself is entered once on each path. A limit on visits bounds trees that double at every level.

mod appearance;
mod frame;
mod groups;
mod kit;
pub(crate) mod property;
pub(crate) mod role;
pub(crate) mod state;
mod visitor;
mod walk;

pub(crate) use state::State;
pub(crate) use visitor::{Visitor, WalkOptions};
pub(crate) use walk::{walk, walk_list};

#[cfg(test)]
mod tests;
