//! Walks a document with Inventor's state rules and tells a visitor what it meets.
//!
//! The stack is a `Vec`, so depth costs memory, not the program's stack; a node that contains
//! itself is entered once a path; a budget of visits bounds trees that double at every level.

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
