//! Tiles, threads, passes: drives camera and shader until the film is exposed.
//!
//! A pixel's samples are added in the order of their numbers by one thread, and a sample is a
//! function of seed, pixel and number, so a picture has the same bits at any number of threads.
//! The rays of a tile go through the lens a bundle at a time, with the same arithmetic as one by
//! one, so [`Render::sample`] is what a test can hold a tile against.
//!
//! [`ghosts`] and [`diffraction`] add what lens and pupil do to light beyond the traced rays;
//! [`report`] says what a render cost and how wrong its picture is.

mod batch;
pub(crate) mod diffraction;
mod exposure;
pub(crate) mod ghosts;
mod passes;
pub(crate) mod report;
mod shares;
#[cfg(test)]
mod tests;
pub(crate) mod tile;

pub use exposure::{Counts, Exposure, Progress, Stop};
pub use passes::Render;
