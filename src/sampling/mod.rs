//! Numbered samples for a pixel, and maps from the square to a disc.
//!
//! A sample is a function of (seed, pixel, index) alone, so tiles, threads and ranks agree on it.
//! No state is carried from one sample to the next.

mod disc;
mod filter;
mod hash;
mod sampler;
mod sobol;

pub use disc::{DiscMap, concentric_disc, polar_disc};
pub use filter::{Filter, FilterTable};
pub use hash::mix;
pub use sampler::{LensSample, PixelSampler, Sampler, SamplerKind, Samples, split};
