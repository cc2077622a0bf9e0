//! Renders a picture: passes of tiles over threads, through camera and shader onto the film.
//!
//! A pixel's samples are added in the order of their numbers by one thread, and a sample is a
//! function of seed, pixel and number, so a picture has the same bits at any number of threads.
//! The rays of a tile go through the lens a bundle at a time, with the same arithmetic as the
//! scalar path, so a test can compare a tile with `Render::sample`.
//!
//! `strips` renders a picture whose film does not fit into memory. `ghosts` adds light reflected
//! between lens surfaces, `diffraction` spreads light at the pupil's rim, and `report` states the
//! cost of a render and the error of its picture.

mod batch;
pub(crate) mod crew;
pub(crate) mod diffraction;
mod exposure;
pub(crate) mod ghosts;
mod pairs;
mod passes;
pub(crate) mod report;
mod shares;
mod stopwatch;
mod strips;
mod surfaces;
#[cfg(test)]
mod tests;
mod tile;

pub(crate) use exposure::Summary;
pub use exposure::{Counts, Exposure, Progress, Stop};
pub(crate) use passes::Render;
pub use report::account::{RenderReport, Seconds};
pub(crate) use stopwatch::Stopwatch;
pub(crate) use strips::{StripSums, Strips};
pub(crate) use surfaces::SurfaceSum;
