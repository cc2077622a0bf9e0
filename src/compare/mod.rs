//! How far apart two pictures are: a new rendering against an archival one.
//!
//! The old picture is brought onto the new one's pixels (registration, tones) and then measured.
//! Levels are what is compared, 0 to 1, as a file holds them; exposures (EXR) are taken as the
//! levels that a linear film would show.

pub mod align;
pub mod camera_fit;
pub mod edges;
pub mod fit;
pub mod flip;
mod measure;
pub mod metric;
pub mod plane;
pub mod sheet;
pub mod tone;

pub use align::Alignment;
pub use edges::EdgeDistance;
pub use measure::{Comparison, METRICS, Measures, Metric, Options, Registration, compare};
pub use metric::Mask;
pub use plane::{Plane, Plate};
pub use tone::{Matching, Tone};
