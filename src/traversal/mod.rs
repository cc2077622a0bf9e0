//! Traverses a document by Inventor's rules of state, and calls a visitor at its nodes.
//!
//! The stack is a `Vec`, so a deep document cannot overflow the program's stack. A node that
//! contains itself is entered only once on each path. A limit on visits bounds the time for
//! documents whose nodes use shared subtrees at every level.

mod appearance;
mod copies;
mod frame;
mod groups;
mod kit;
mod light_list;
mod lights;
pub(crate) mod property;
pub(crate) mod role;
pub(crate) mod state;
mod visitor;
mod walk;

pub(crate) use light_list::LightList;
pub(crate) use state::State;
pub(crate) use visitor::{Visitor, WalkOptions};
pub(crate) use walk::{walk, walk_list};

#[cfg(test)]
mod tests;
