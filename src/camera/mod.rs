//! A ray for a film point and a lens point.
//!
//! This is where the film's and the lens's millimeters meet the scene's meters. Film and lens
//! space: the front vertex at the origin, light travels toward +z, the film at positive z. The
//! camera looks down its −z with +y up, so the two share their axes and differ by a factor of
//! 1000. The image on the film is upside down; a picture is the film turned upright.

mod aim;
mod film_camera;
mod film_samples;
mod ideal;
mod kinds;
mod lens_camera;
mod lens_in_scene;
mod lens_trace;
mod pinhole;
mod rays;
mod resample;
mod spectral;
mod spectral_lenses;

pub use aim::Aim;
pub(crate) use aim::pixel_aspect;
pub use film_camera::FilmCamera;
pub(crate) use film_camera::film_plane;
pub use ideal::IdealLens;
pub use kinds::{Camera, FilmPoint};
pub use lens_camera::LensCamera;
pub(crate) use lens_camera::half_field;
pub use lens_in_scene::lens_in_scene;
pub use pinhole::Pinhole;
pub use rays::CameraRay;
pub(crate) use rays::CameraRays;
pub(crate) use spectral::SpectralCorrections;
