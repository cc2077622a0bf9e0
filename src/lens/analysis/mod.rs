//! What a lens does to a picture, computed from its rays: no sampling noise, no scene.

pub(crate) mod beam;
pub(crate) mod diffraction;
pub(crate) mod ghosts;
mod irradiance;
pub(crate) mod psf;
pub(crate) mod sheet;
mod transmittance;
