//! The exit pupil, and where on the lens to aim rays from film points.

pub mod aims;
pub mod exit_pupil;
mod polar;
mod polygon;
mod radial;
pub mod rear_element;
mod sampler;
pub(crate) mod search;
mod spans;
mod support;
pub mod target;
pub mod transmission;
pub mod window;

pub use polygon::{Polygon, SIDES, Support};
