//! Numbered samples for a pixel, pixel filters, and maps from the square to a disc.
//!
//! A sample is a function of (seed, pixel, index) alone, so it does not depend on tiles and
//! threads. No state is carried from one sample to the next.

pub mod disc;
mod filter;
mod hash;
mod path_points;
mod sampler;
mod sobol;

pub use disc::DiscMap;
pub use filter::Filter;
pub use filter::FilterTable;
pub use hash::{mix, unit};
pub use path_points::PathPoints;
pub use sampler::{CameraSamples, PixelSampler};
pub use sampler::{Sampler, SamplerKind};
