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
mod leading;
mod light_list;
mod lights;
pub(crate) mod property;
pub(crate) mod role;
mod same_state;
pub(crate) mod state;
mod steps;
mod visitor;
mod walk;

pub(crate) use copies::Grid;
pub(crate) use leading::{Leading, each_child};
pub(crate) use light_list::LightList;
pub(crate) use state::State;
pub(crate) use steps::Step;
pub(crate) use visitor::{Repeated, Visitor, WalkOptions};
pub(crate) use walk::{Scratch, walk, walk_list, walk_part};

#[cfg(test)]
mod tests;
