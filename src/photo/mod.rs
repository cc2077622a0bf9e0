//! All choices of a photograph in one value, and the state that is ready to render.
//!
//! The 1999 program and ivcam's own defaults differ only in the [`Plan`] that they start from. The
//! command line, the window, convergence runs and movies all make a `Plan` and open a [`Session`]
//! from it, so they use the same code to render. `options` is the table of all options.

mod actions;
mod camera_choice;
pub mod checkpoint;
mod denoise;
mod environment_picture;
mod exposure_meter;
mod facts;
mod file_kind;
mod flash;
mod further_layers;
pub(crate) mod headlight;
mod layer_choice;
mod layers;
mod lens_settings;
mod light_plan;
mod memory;
pub(crate) mod merge;
pub mod options;
pub(crate) mod output_files;
pub(crate) mod overview;
mod parts;
mod picture_hint;
mod plan;
#[cfg(feature = "panels")]
mod pointer_scene;
mod pose;
mod ray_section;
mod session;
mod snapshot_options;
mod stopping;
mod strips;
mod studio;
#[cfg(test)]
mod tests;
mod view;
mod visible;

#[cfg(feature = "panels")]
pub(crate) use camera_choice::camera_file;
pub use camera_choice::{CameraChoice, CameraNode};
#[cfg(feature = "mpi")]
pub(crate) use checkpoint::Facts;
pub(crate) use denoise::Denoiser;
pub(crate) use file_kind::FileKind;
pub use headlight::{Headlight, HeadlightCause, HeadlightState};
pub use layer_choice::FurtherLayers;
pub use light_plan::{Backdrop, LightPlan, Surroundings};
pub(crate) use plan::free_name;
pub use plan::{Era, IdealChoice, LensChoice, LensWavelength, Optics, Plan, picture_name};
#[cfg(feature = "panels")]
pub(crate) use pointer_scene::PointerScene;
#[cfg(feature = "panels")]
pub(crate) use pose::view_through_lens;
#[cfg(feature = "panels")]
pub(crate) use ray_section::{RAYS, ray_section};
pub use session::Session;
pub(crate) use session::{UNFINISHED, check_region};
pub(crate) use snapshot_options::snapshot_options;
pub(crate) use view::NEUTRAL;
pub use view::{Override, WholeView};
pub use visible::VisiblePoint;
#[cfg(feature = "panels")]
pub(crate) use visible::visible_at;

pub use ivcam_optics::sampling::{DiscMap, Filter, Sampler, SamplerKind};
pub use ivcam_render::shade::Shading;
