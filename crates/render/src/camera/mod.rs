//! Cameras: the ray in the scene for a film point and a lens point.
//!
//! This folder converts between the millimeters of film and lens and the meters of the scene. In
//! lens space the front vertex is the origin, light travels toward +z, and the film is at positive
//! z. A camera looks down its −z with +y up, so the two spaces have the same axes and differ by
//! the factor 1000. The image on the film is upside down; a picture is the film turned upright.

mod aim;
mod chief_ray_grid;
mod choose;
mod film_camera;
mod film_samples;
mod ideal;
mod kinds;
mod lamps;
mod lens_camera;
mod lens_in_scene;
mod lens_trace;
mod pinhole;
mod rays;
mod resample;
mod spectral;
mod spectral_lenses;
mod tint;

pub use aim::Aim;
pub use aim::pixel_aspect;
pub(crate) use chief_ray_grid::ChiefRayGrid;
pub use film_camera::FilmCamera;
pub use film_camera::film_plane;
pub use ideal::IdealLens;
pub use kinds::{Camera, FilmPoint};
pub use lamps::LampFinder;
pub(crate) use lamps::LampRays;
pub use lens_camera::LensCamera;
pub use lens_camera::half_field;
pub use lens_in_scene::lens_in_scene;
pub use pinhole::Pinhole;
pub use rays::CameraRay;
pub(crate) use rays::{CameraRays, ExitRays};
pub(crate) use spectral::SpectralCorrections;
