//! Reads prescriptions, whose format is recognized by their content, and writes them.

mod apertures;
pub(crate) mod dat;
mod format;
mod index_table;
pub(crate) mod iset;
pub(crate) mod json;
pub(crate) mod origin;
pub(crate) mod read;
pub(crate) mod seq;
pub(crate) mod write;
pub(crate) mod zmx;

pub(crate) use format::Format;
pub use format::{Gap, Reading};
use origin::name_of;
pub(crate) use read::read;

/// The formats that are read; a file is in the first that recognizes it.
pub(crate) static FORMATS: [&Format; 5] = [
    &iset::FORMAT,
    &json::FORMAT,
    &zmx::FORMAT,
    &seq::FORMAT,
    &dat::FORMAT,
];
