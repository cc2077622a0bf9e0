//! Comparison of a new rendering with an archival picture, by the crate [`ivcam_compare`]; the
//! camera of a picture; and the files that a comparison writes.

pub(crate) mod camera_fit;
pub(crate) mod difference;
mod fit_clock;
pub(crate) mod lens_ranking;
mod selection;
pub(crate) mod sheet;

pub use camera_fit::{FittedCamera, fit_camera, fit_camera_and_aperture};
pub use ivcam_compare::*;
pub(crate) use selection::Selection;
