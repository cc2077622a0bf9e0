#![doc = include_str!("../README.md")]
#![deny(unsafe_code)]
#![warn(missing_docs, unreachable_pub)]

mod align;
mod chance;
mod contrast;
mod edges;
pub mod fit;
mod flip;
mod frame;
mod measure;
mod metric;
mod plane;
mod refine;
mod search;
mod tone;
mod warp;

pub use align::{Aligned, Alignment, Alternative, align, best, probability};
pub use chance::LIMIT as CHANCE_LIMIT;
pub use edges::EdgeDistance;
pub use flip::PIXELS_PER_DEGREE;
pub use frame::PhotographFrame;
pub use measure::{
    Comparison, ExceededLimit, METRICS, Measures, Metric, MetricLimit, Options, Registration,
    compare, exceeded,
};
pub use metric::Mask;
pub use plane::{Plane, Plate};
pub use tone::{Matching, Tone};
pub use warp::{Warp, resample};
