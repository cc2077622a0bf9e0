//! The film: sums of radiance as irradiance, exposure, and levels.
//!
//! By default the film is 36×24 mm, has unlimited resolution, and responds in proportion to
//! exposure (the paper, section Assumptions). [`Metering`] sets the exposure in photometric units,
//! and [`Response`] has other characteristic curves. The samples of a pixel are added in one fixed
//! order, so that a picture has the same bits at any number of threads.

mod draw_probability;
mod error;
mod exposed_film;
mod format;
mod ghost_image;
mod metering;
mod pixel;
mod region;
mod response;
mod squared_error;
mod white_balance;

pub use draw_probability::DrawProbabilities;
pub use error::{ErrorEstimate, ErrorUnknown};
pub use exposed_film::Film;
pub use format::{FilmFormat, Resolution};
pub use ghost_image::GhostImage;
pub use metering::Metering;
pub use pixel::Exposed;
pub use region::Region;
pub use response::{Emulsion, Response};
pub use squared_error::{MissedLight, Pair, SquaredError, student};
pub use white_balance::WhiteBalance;
