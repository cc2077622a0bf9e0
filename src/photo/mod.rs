//! Every choice of a photograph in one value, and the value made ready to render.
//!
//! 1999 and now differ by the [`Plan`] they start from, never by an `if` in a loop. The command
//! line, the window, convergence runs and films all make a `Plan` and open a [`Session`] of it, so
//! they render by the same code. [`options`] is the table of everything that can be asked for.

mod camera_choice;
pub(crate) mod headlight;
mod lens_settings;
pub(crate) mod options;
mod overview;
mod plan;
mod pose;
mod session;
#[cfg(test)]
mod tests;

pub use camera_choice::{CameraChoice, CameraNode};
pub use headlight::{Headlight, HeadlightCause, HeadlightState};
pub use plan::{Era, IdealChoice, LensChoice, Optics, Plan, picture_name};
pub(crate) use pose::view_through_lens;
pub use session::Session;

pub use crate::sampling::{DiscMap, Filter, Sampler, SamplerKind};
pub use crate::shade::Shading;
