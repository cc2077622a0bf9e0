//! The aberrations of a lens as lens designers read them: ray and wavefront fans, Zernike
//! coefficients, the Strehl ratio, Seidel sums, and spots and modulation through focus.

pub mod fans;
pub mod merit;
mod point_rays;
pub mod report;
pub mod seidel;
pub(crate) mod through_focus;
mod zernike;
