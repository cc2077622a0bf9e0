//! What is in scene files, what of it is drawn, and what is wrong with it.
//!
//! The JSON form is described in `docs/guide/machine.md`.

mod checked;
mod classes;
mod files;
mod json;
mod missing;

pub(crate) use checked::{Checked, counted};
pub(crate) use classes::classes;
pub(crate) use files::scene_files;
