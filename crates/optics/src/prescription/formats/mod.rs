//! Reads prescriptions, whose format is recognized by their content, and writes them.

pub(crate) mod apertures;
mod bench;
pub(crate) mod dat;
mod flare;
mod format;
mod index_table;
pub(crate) mod iset;
pub(crate) mod json;
mod loose;
mod optiland;
pub(crate) mod origin;
mod oslo;
pub mod read;
mod roa;
pub(crate) mod seq;
pub mod write;
mod write_seq;
pub(crate) mod zmx;

pub(crate) use format::Format;
pub use format::{Gap, Reading};
use origin::name_of;
pub use read::read;

/// The formats that are read; a file is in the first that recognizes it.
pub(crate) static FORMATS: [&Format; 10] = [
    &iset::FORMAT,
    &roa::FORMAT,
    &optiland::FORMAT,
    &json::FORMAT,
    &bench::FORMAT,
    &flare::FORMAT,
    &oslo::FORMAT,
    &zmx::FORMAT,
    &seq::FORMAT,
    &dat::FORMAT,
];
