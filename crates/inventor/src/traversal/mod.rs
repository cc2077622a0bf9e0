//! Traverses a document by Inventor's rules of state, and calls a visitor at its nodes.
//!
//! The stack is a `Vec`, so a deep document cannot overflow the program's stack. A node that
//! contains itself is entered only once on each path. A limit on visits bounds the time for
//! documents whose nodes use shared subtrees at every level.

mod appearance;
mod copies;
mod first_camera;
mod frame;
pub mod geo;
mod groups;
mod kit;
mod leading;
mod light_list;
mod lights;
pub mod property;
pub mod role;
mod same_state;
pub mod state;
mod steps;
mod visitor;
mod walk;

pub use appearance::first_texture;
pub use copies::Grid;
pub use first_camera::{LaterCamera, first_camera, first_pose};
pub(crate) use leading::Parents;
pub use leading::{Leading, each_child};
pub use light_list::LightList;
pub use state::State;
pub use steps::Step;
pub use visitor::{Instance, Visitor, WalkOptions};
pub use walk::{Scratch, walk, walk_list, walk_part};

#[cfg(test)]
mod tests;
