//! What a lens does to a picture, computed from its rays: no sampling noise, no scene.

pub mod beam;
pub mod diffraction;
pub mod ghosts;
mod irradiance;
pub mod psf;
pub mod sheet;
mod transmittance;
