//! The image quality of a lens, computed from its rays without a scene and without random sampling.

pub(crate) mod aberrations;
pub(crate) mod beam;
pub(crate) mod curves;
pub(crate) mod diffraction;
pub(crate) mod ghosts;
mod irradiance;
pub(crate) mod points;
pub(crate) mod psf;
pub(crate) mod sheet;
mod transmittance;
