//! Lenses: exact tracing, focus and pupils.
//!
//! Lens space is in millimeters. Light travels toward +z, the first vertex is the origin, and the
//! film is at positive z. A [`Lens`] is a [`Prescription`] prepared for tracing. Nothing here
//! knows about scenes, pixels or samples.
//!
//! The folder's parts, from the ground up: `trace` follows one ray; `lens` is a prescription made
//! ready, `lanes` traces many rays, `library` finds a lens by name; `optics` answers what a
//! photographer asks of it, `pupil` where to aim rays, `analysis` what it does to a picture.

pub mod analysis;
pub(crate) mod lanes;
// The file of the central type has its name.
#[allow(clippy::module_inception)]
mod lens;
mod library;
pub mod optics;
pub(crate) mod pupil;
pub mod trace;

pub use crate::prescription::About;
pub use crate::prescription::Coating;
pub use crate::prescription::Gap;
pub use crate::prescription::Reading;
pub use crate::prescription::{FirstOrder, Pupil};
pub use crate::prescription::{Iris, Prescription};
pub use crate::prescription::{Meridian, Shape, Surface};
pub use analysis::aberrations::fans::{FanRay, Fans, WavefrontFit};
pub use analysis::aberrations::merit::{Merit, MeritFilm, MeritPoint, MeritSetting};
pub use analysis::aberrations::report::{Aberrations, PointAberrations};
pub use analysis::aberrations::seidel::{Seidel, SeidelSums};
pub use analysis::aberrations::through_focus::FocusRow;
pub use analysis::beam::Beam;
pub use analysis::curves::{ColorRow, Conjugate, FieldRow, Zone};
pub use analysis::diffraction::Wavefront;
pub use analysis::ghosts::GhostPair;
pub use analysis::points::{Modulation, PointImage};
pub use analysis::psf::PointSpreads;
pub use analysis::sheet::{FieldPoint, LensSheet, SheetSetting};
pub use analysis::tolerance::{Distribution, Requirement, Tolerance, Yield, yield_of};
pub use ivcam_base::math::lanes::LANES;
pub use lanes::bundle::Bundle;
pub use lanes::rows::{RayRows, TracedRows};
pub use lanes::transmittances::Transmittances;
pub use lens::Lens;
pub use library::at_zoom_list;
pub use library::{open_prescription, shipped_names};
pub use optics::breathing::Breathing;
pub use optics::chief_ray::Distortion;
pub use optics::film_place::{FilmPlace, Movements, PlaceFault};
pub use optics::focus::{Focus, FocusFault, FocusMethod};
pub use optics::spot::Spot;
pub use pupil::aims::Aims;
pub use pupil::exit_pupil::ExitPupil;
pub use pupil::rear_element::RearElement;
pub use pupil::target::PupilTarget;
pub use pupil::vignetting::Vignetting;
pub use pupil::window::PupilWindow;
pub use trace::ray::{LensRay, Loss, LossKind, RayPath, Toward};
