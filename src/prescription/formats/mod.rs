//! Reads prescriptions, whose format is recognized by their content, and writes them.

mod apertures;
pub mod dat;
mod format;
mod index_table;
pub mod iset;
pub mod json;
pub mod origin;
pub mod read;
pub mod seq;
pub mod write;
pub mod zmx;

pub use format::{Format, Reading};
use origin::name_of;
pub use read::{read, read_with};

/// The formats that are read; a file is in the first that recognizes it.
pub static FORMATS: [&Format; 5] = [
    &iset::FORMAT,
    &json::FORMAT,
    &zmx::FORMAT,
    &seq::FORMAT,
    &dat::FORMAT,
];
