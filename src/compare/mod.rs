//! How far apart two pictures are: a new rendering against an archival one.
//!
//! The old picture is brought onto the new one's pixels (registration, tones) and then measured.
//! Levels are what is compared, 0 to 1, as a file holds them; exposures (EXR) are taken as the
//! levels that a linear film would show.

pub(crate) mod align;
pub(crate) mod camera_fit;
pub(crate) mod edges;
pub(crate) mod fit;
pub(crate) mod flip;
mod measure;
pub(crate) mod metric;
pub(crate) mod plane;
pub(crate) mod sheet;
pub(crate) mod tone;

pub use align::Alignment;
pub use measure::{Comparison, METRICS, Measures, Metric, Options, Registration, compare};
pub use metric::Mask;
pub(crate) use plane::Plate;
pub use tone::{Matching, Tone};
