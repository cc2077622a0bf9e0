//! Comparison of a new rendering with an archival picture.
//!
//! The old picture is mapped to the new one's pixels, its tones are matched, and the difference is
//! measured. Levels from 0 to 1 are compared, as stored in the file; exposures (EXR) are taken as
//! the levels of a linear film.

pub(crate) mod align;
pub(crate) mod camera_fit;
mod chance;
pub(crate) mod difference;
pub(crate) mod edges;
pub(crate) mod fit;
pub(crate) mod flip;
mod frame;
mod measure;
pub(crate) mod metric;
pub(crate) mod plane;
mod refine;
mod search;
mod selection;
pub(crate) mod sheet;
pub(crate) mod tone;
pub(crate) mod warp;

pub(crate) use align::probability;
pub use align::{Alignment, Alternative};
pub use camera_fit::{FittedCamera, fit_camera};
pub(crate) use chance::LIMIT as CHANCE_LIMIT;
pub use edges::EdgeDistance;
pub use fit::FitStep;
pub use frame::PhotographFrame;
pub use measure::{Comparison, METRICS, Measures, Metric, Options, Registration, compare};
pub(crate) use measure::{ExceededLimit, MetricLimit, exceeded};
pub use metric::Mask;
pub use plane::{Plane, Plate};
pub(crate) use selection::Selection;
pub use tone::{Matching, Tone};
