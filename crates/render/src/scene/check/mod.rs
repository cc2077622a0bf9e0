//! Checks scene files: what they contain, what of it is drawn, and what is wrong.
//!
//! The JSON form is described in `docs/guide/machine.md`.

mod checked;
mod classes;
mod contents;
mod files;
mod identity;
mod json;
mod missing;

pub use checked::{Checked, FileState};
pub use classes::classes;
pub use files::{files_below, scene_files, without_ending};
pub use identity::{packed, round_solids, unexpected_ending};
pub use json::diagnostic as diagnostic_json;
pub use missing::{Missing, missing};
