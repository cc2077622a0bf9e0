//! Hands a lens on to other programs: calibrations, corrections and maps.
//!
//! Everything here describes one picture: a lens with its aperture and focus, a film, and its
//! pixels ([`View`]). The reference is the chief ray, traced exactly (`ChiefRays`); a model of
//! another program is fitted to it and states its residual, or is refused (`Fit`).
//!
//! A picture shows the scene upright: x points to the right and y down, as on a screen, although
//! the image on the film is upside down. The scene's coordinates are x to the right, y down and z
//! forward, from the center of the entrance pupil. The center of the first pixel, at the top left,
//! is (0, 0).

mod chief_rays;
mod fit;
mod frame;
mod lensfun;
mod odd_curve;
mod opencv;
mod opentrackio;
mod osl;
mod ros;
mod series;
mod stmap;
#[cfg(test)]
mod tests;
mod view;

pub use fit::{CameraModel, Chosen};
pub use frame::Frame;
pub use lensfun::lensfun;
pub use opencv::opencv;
pub use opentrackio::opentrackio;
pub use osl::osl;
pub use ros::ros;
pub use stmap::StMaps;
pub use view::View;
