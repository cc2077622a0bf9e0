//! The effects of property nodes on the traversal state, with one function for each class.
//!
//! A new class of property needs an entry in `grammar/`, a line in the table of `apply.rs`, and a
//! function in the file of its subject.

mod apply;
mod environment;
mod geometry;
mod light;
mod material;
mod texture;
mod transform;

pub(crate) use apply::apply;
pub use environment::fog97;
pub use geometry::vertex_property;
pub(super) use light::{LightReach, light, reach};
pub(super) use material::highlight;
pub(super) use transform::{transform, turn_z};
