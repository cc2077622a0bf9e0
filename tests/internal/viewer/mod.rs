//! Tests of the window without a display: every control against the state that it changes, pictures
//! of the panels, and saved pictures against those of a batch run.
//!
//! `cargo test --features viewer-tests viewer`; `UPDATE=1` rewrites the pictures.

mod bench;
mod comparison;
mod controls;
mod layout;
mod motion;
mod opening;
mod raster;
mod saving;
mod touching;
