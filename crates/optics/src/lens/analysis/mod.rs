//! The image quality of a lens, computed from its rays without a scene and without random sampling.

pub mod aberrations;
pub(crate) mod beam;
pub(crate) mod curves;
pub mod diffraction;
pub mod ghosts;
pub(crate) mod ideal_lenses;
mod irradiance;
pub(crate) mod points;
pub(crate) mod psf;
pub mod sheet;
pub mod tolerance;
mod transmittance;
