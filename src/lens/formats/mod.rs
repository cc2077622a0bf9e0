//! Reading prescriptions, by what a file says rather than by what it is called, and writing them.

mod apertures;
pub mod dat;
pub mod iset;
pub mod json;
pub mod origin;
pub mod read;
pub mod seq;
pub(crate) mod text;
pub mod write;
pub mod zmx;

use origin::name_of;
pub use read::{Format, Reading, read, read_with};
