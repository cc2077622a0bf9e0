//! Lenses: prescriptions, first-order optics, exact tracing, focus and pupils.
//!
//! Lens space is millimeters with z = 0 at the front vertex and light travelling toward +z, to
//! the film. A [`Lens`] is a [`Prescription`] made ready for tracing. Nothing here knows about
//! scenes, pixels or samples.
//!
//! The folder's parts, from the ground up: `surface`, `glass`, `prescription` and `about` hold
//! what a file says; `formats` reads and writes it; `trace` follows rays; `lens` is a
//! prescription made ready, and `library` finds one by name; `optics` answers what a
//! photographer asks of it, `pupil` where to aim rays, `analysis` what it does to a picture.

pub mod about;
pub mod analysis;
pub mod formats;
pub mod glass;
// The file of the central type has its name.
#[allow(clippy::module_inception)]
mod lens;
mod library;
pub mod optics;
pub mod prescription;
pub mod pupil;
pub mod surface;
pub mod trace;

pub use crate::math::lanes::LANES;
pub use about::About;
pub use analysis::beam::Beam;
pub use analysis::diffraction::{Openings, Wavefront};
pub use analysis::ghosts::GhostPair;
pub use analysis::sheet::LensSheet;
pub use formats::Reading;
pub use glass::{Catalogue, Coating, Medium};
pub use lens::Lens;
pub use library::{at_zoom_list, open_prescription, shipped_names};
pub use optics::breathing::Breath;
pub use optics::chief_ray::Distortion;
pub use optics::film_place::{FilmPlace, Movements, PlaceFault};
pub use optics::first_order::{FirstOrder, Focal, Pupil};
pub use optics::focus::{Focus, FocusFault, FocusMethod};
pub use optics::spot::{AxialBeam, Spot};
pub use prescription::{Iris, Prescription};
pub use pupil::aims::Aims;
pub use pupil::exit_pupil::ExitPupil;
pub use pupil::rear_element::RearElement;
pub use pupil::target::PupilTarget;
pub use pupil::transmission::PupilTransmission;
pub use pupil::window::PupilWindow;
pub use surface::{Curvature, Plane, Shape, Surface};
pub use trace::lanes::bundle::Bundle;
pub use trace::ray::{LensRay, Loss, LossKind, RayPath, Toward};
