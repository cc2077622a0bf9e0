//! Walks a document by Inventor's rules of state, and calls a visitor for what it meets.
//!
//! The stack is a `Vec`, so that depth costs memory and not the program's stack. A node that contains
//! itself is entered once on each path. A limit on visits bounds trees that double at every level.

mod appearance;
mod frame;
mod groups;
mod kit;
pub mod property;
pub mod role;
pub mod state;
mod visitor;
mod walk;

pub use state::State;
pub use visitor::{Visitor, WalkOptions};
pub use walk::{walk, walk_list};

#[cfg(test)]
mod tests;
