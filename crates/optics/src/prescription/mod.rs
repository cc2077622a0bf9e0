//! The contents of a lens file: a table of surfaces with their glass, apertures and notes.
//!
//! Lengths are in millimeters, and indices of refraction are those of the d line unless a
//! wavelength is given. First-order optics follow from the table alone. They are part of this
//! folder because readers need them: a file may give an f-number in place of a diameter. Nothing
//! here traces rays; `lens` does.
//!
//! The folder's parts, from the ground up: `glass`, `decenter`, `surface` and `forbes`, polynomials
//! of aspheres; `prescription` is the table, `about` its sources in words, `first_order` its focal
//! lengths and pupils, `adjust` makes another table of it (scaled, stopped down, zoomed), `changes`
//! one with other numbers; `formats` reads and writes files.

pub(crate) mod about;
mod adjust;
pub(crate) mod changes;
pub(crate) mod clear_aperture;
pub(crate) mod decenter;
pub(crate) mod first_order;
mod forbes;
pub mod formats;
pub mod glass;
// The file of the central type has its name.
#[allow(clippy::module_inception)]
pub mod prescription;
pub mod surface;
pub(crate) mod text;

pub use about::About;
pub use changes::{Change, Quantity};
pub use decenter::{Decenter, SurfaceFrame};
pub use first_order::{FirstOrder, Focal, Pupil};
pub use formats::{Gap, Reading};
pub use glass::{Catalogue, Coating, Medium};
pub use prescription::{FocusGroup, Iris, Prescription, StatedBeam, ZoomPosition};
pub use surface::{Curvature, Meridian, Shape, Surface};
