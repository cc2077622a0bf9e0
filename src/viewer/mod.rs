//! The window, for composing a photograph with a live view through the lens.
//!
//! [`model`] is the state of the window, without widgets; [`engine`] is the renderer's thread; the
//! panels under [`panels`] show the model and change it. Pictures are saved from the [`setup`]'s
//! plan by the code of batch runs.

pub(crate) mod archive;
pub(crate) mod autofocus;
pub(crate) mod develop;
pub mod draft;
pub mod engine;
pub(crate) mod files;
pub(crate) mod history;
pub(crate) mod lenses;
pub mod live;
pub(crate) mod model;
pub(crate) mod navigate;
pub(crate) mod panels;
pub(crate) mod pull;
pub(crate) mod pulling;
pub(crate) mod recent;
pub(crate) mod saving;
pub mod setup;
pub(crate) mod sharpness;
pub(crate) mod taking;
pub(crate) mod touch;
pub(crate) mod view;
#[cfg(feature = "viewer")]
pub(crate) mod window;
