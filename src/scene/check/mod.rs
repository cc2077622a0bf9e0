//! What is in scene files, what of it is drawn, and what is wrong with it.
//!
//! The JSON form is described in `docs/guide/machine.md`.

mod checked;
mod classes;
mod files;
mod json;
mod missing;

pub use checked::{Checked, counted};
pub use classes::classes;
pub use files::scene_files;
pub use missing::Missing;
