//! What a lens file says: a table of surfaces with their glass, apertures and notes.
//!
//! Lengths are in millimeters, indices of refraction those of the d line unless a wavelength is
//! given. First-order optics follow from the table alone and stand here too, because readers need
//! them: a file may give an f-number in place of a diameter. Nothing here traces rays; that is
//! what `lens` does with a prescription.
//!
//! The folder's parts, from the ground up: `glass` and `surface`; `prescription` is the table,
//! `about` its sources in words, `first_order` its focal lengths and pupils, `adjust` makes another
//! table of it (scaled, stopped down, zoomed); `formats` reads and writes files.

pub(crate) mod about;
mod adjust;
pub(crate) mod first_order;
pub(crate) mod formats;
pub(crate) mod glass;
// The file of the central type has its name.
#[allow(clippy::module_inception)]
pub(crate) mod prescription;
pub(crate) mod surface;
pub(crate) mod text;

pub use about::About;
pub use first_order::{FirstOrder, Focal, Pupil};
pub use formats::Reading;
pub use glass::{Catalogue, Coating, Medium};
pub use prescription::{FocusGroup, Iris, Prescription, ZoomPosition};
pub use surface::{Curvature, Plane, Shape, Surface};
