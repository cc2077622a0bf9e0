//! Numbered samples for a pixel, pixel filters, and maps from the square to a disc.
//!
//! A sample is a function of (seed, pixel, index) alone, so it does not depend on tiles and
//! threads. No state is carried from one sample to the next.

pub(crate) mod disc;
mod filter;
mod hash;
mod sampler;
mod sobol;

pub use disc::DiscMap;
pub use filter::Filter;
pub(crate) use filter::FilterTable;
pub(crate) use hash::{mix, unit};
pub(crate) use sampler::{PixelSampler, Samples};
pub use sampler::{Sampler, SamplerKind};
