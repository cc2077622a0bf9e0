//! Lenses: exact tracing, focus and pupils.
//!
//! Lens space is in millimeters. Light travels toward +z, the first vertex is the origin, and the
//! film is at positive z. A [`Lens`] is a [`Prescription`] made ready for tracing. Nothing here
//! knows about scenes, pixels or samples.
//!
//! The folder's parts, from the ground up: `trace` follows one ray; `lens` is a prescription made
//! ready, `lanes` traces many rays, `library` finds a lens by name; `optics` answers what a photographer asks of it, `pupil`
//! where to aim rays, `analysis` what it does to a picture.

pub mod analysis;
pub mod lanes;
// The file of the central type has its name.
#[allow(clippy::module_inception)]
mod lens;
mod library;
pub mod optics;
pub mod pupil;
pub mod trace;

pub use crate::math::lanes::LANES;
pub use crate::prescription::About;
pub use crate::prescription::Reading;
pub use crate::prescription::{Catalogue, Coating, Medium};
pub use crate::prescription::{Curvature, Plane, Shape, Surface};
pub use crate::prescription::{FirstOrder, Focal, Pupil};
pub use crate::prescription::{Iris, Prescription};
pub use analysis::beam::Beam;
pub use analysis::diffraction::{Openings, Wavefront};
pub use analysis::ghosts::GhostPair;
pub use analysis::sheet::LensSheet;
pub use lanes::bundle::Bundle;
pub use lens::Lens;
pub use library::{at_zoom_list, open_prescription, shipped_names};
pub use optics::breathing::Breath;
pub use optics::chief_ray::Distortion;
pub use optics::film_place::{FilmPlace, Movements, PlaceFault};
pub use optics::focus::{Focus, FocusFault, FocusMethod};
pub use optics::spot::{AxialBeam, Spot};
pub use pupil::aims::Aims;
pub use pupil::exit_pupil::ExitPupil;
pub use pupil::rear_element::RearElement;
pub use pupil::target::PupilTarget;
pub use pupil::transmission::PupilTransmission;
pub use pupil::window::PupilWindow;
pub use trace::ray::{LensRay, Loss, LossKind, RayPath, Toward};
