//! The window: composing a photograph with the real lens live on screen.
//!
//! [`model`] is everything the window knows, and has no widget in it; [`engine`] is the renderer's
//! thread; the panels under [`panels`] only show the model and change it. What is saved is made
//! from the [`setup`]'s plan by the code of batch runs.

pub mod archive;
pub mod autofocus;
pub mod develop;
pub mod draft;
pub mod engine;
pub mod files;
pub mod history;
pub mod lenses;
pub mod live;
pub mod model;
pub mod navigate;
pub mod panels;
pub mod setup;
pub mod sharpness;
pub mod view;
#[cfg(feature = "viewer")]
pub mod window;
