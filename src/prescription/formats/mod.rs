//! Reads prescriptions, whose format is recognized by their content, and writes them.

mod apertures;
pub mod dat;
mod index_table;
pub mod iset;
pub mod json;
pub mod origin;
pub mod read;
pub mod seq;
pub mod write;
pub mod zmx;

use origin::name_of;
pub use read::{Format, Reading, read, read_with};
