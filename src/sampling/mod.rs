//! Numbered samples for a pixel, and maps from the square to a disc.
//!
//! A sample is a function of (seed, pixel, index) alone, so tiles, threads and ranks agree on it.
//! No state is carried from one sample to the next.

pub(crate) mod disc;
mod filter;
mod hash;
mod sampler;
mod sobol;

pub(crate) use disc::DiscMap;
pub(crate) use filter::{Filter, FilterTable};
pub(crate) use hash::mix;
pub(crate) use sampler::{PixelSampler, Sampler, SamplerKind, Samples};
