//! The window: composing a photograph with the real lens live on screen.
//!
//! [`model`] is everything the window knows, and has no widget in it; [`engine`] is the renderer's
//! thread; the panels under [`panels`] only show the model and change it. What is saved is made
//! from the [`setup`]'s plan by the code of batch runs.

pub(crate) mod archive;
pub(crate) mod autofocus;
pub(crate) mod develop;
pub(crate) mod draft;
pub(crate) mod engine;
pub(crate) mod files;
pub(crate) mod history;
pub(crate) mod lenses;
pub(crate) mod live;
pub(crate) mod model;
pub(crate) mod navigate;
pub(crate) mod panels;
pub(crate) mod setup;
pub(crate) mod sharpness;
pub(crate) mod view;
#[cfg(feature = "viewer")]
pub(crate) mod window;
