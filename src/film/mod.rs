//! Adds radiance up into irradiance, and turns that into exposure and levels.
//!
//! Film is 36×24 mm with unlimited resolution, and saturates in proportion to exposure (the
//! paper, section Assumptions); [`Metering`] and [`Response`] are for films that do not. The sums
//! of a pixel are made in one fixed order, so that a picture has the same bits at any number of
//! threads.

mod exposed_film;

mod format;
mod metering;
mod pixel;
mod response;

pub use exposed_film::{ErrorEstimate, Film};
pub(crate) use exposed_film::{Glare, Twin};
pub use format::{FilmFormat, Resolution};
pub use metering::Metering;
pub(crate) use pixel::Exposed;
pub use response::{Emulsion, Response};
