//! Renders a picture: passes of tiles over threads, through camera and shader onto the film.
//!
//! A pixel's samples are added in the order of their numbers by one thread, in units that are
//! folded in their order, and a sample is a function of seed, pixel and number. So a picture has
//! the same bits at any number of threads, after any interruption, and if its samples are divided.
//! The rays of a tile go through the lens a bundle at a time. A tile has the bits of its samples
//! made one by one, which a test checks.
//!
//! `strips` renders a picture whose film does not fit into memory. `ghosts` adds light reflected
//! between lens surfaces, `diffraction` spreads light at the pupil's rim, and `report` states the
//! cost of a render and the error of its picture.

mod batch;
pub mod crew;
pub mod diffraction;
mod exposure;
pub mod ghosts;
mod lamp_images;
#[cfg(test)]
mod lamp_tests;
mod mattes;
mod motion;
mod pairs;
mod passes;
pub mod report;
mod sample_window;
mod segment;
mod shares;
mod stopwatch;
mod strips;
mod sums;
mod surfaces;
mod tile;
pub mod units;

pub use exposure::{Counts, Exposure, Progress, Stop};
pub use exposure::{Stopped, Summary};
pub use mattes::{MatteRanks, Mattes};
pub use motion::LaterMoment;
pub use passes::{Render, Task, is_stopped};
pub use report::account::{RenderReport, StageSeconds};
pub use stopwatch::{Alarm, Stopwatch};
pub use strips::{StripSums, Strips};
pub use sums::{Keeper, PicturePlace, StateView, Sums};
pub use surfaces::SurfaceSum;
