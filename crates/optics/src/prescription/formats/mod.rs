//! Reads prescriptions, whose format is recognized by their content, and writes them.
//!
//! Each format has a file or a folder with its `PrescriptionFormat`. What the readers share is in
//! `reader` (messages, numbers, glasses, units, the surfaces read so far), `apertures` (the beam of
//! a file), `commands` (CODE V and OSLO), `decenters` (breaks and tilts), `json_text` and `loose`
//! (JSON) and `index_table` (glasses by their indices at several wavelengths).

mod apertures;
mod bench;
mod commands;
mod crayg;
mod dat;
mod decenters;
mod flare;
mod format;
mod index_table;
mod iset;
mod json;
mod json_text;
mod lensoptics;
mod lhlt;
mod loose;
mod optiland;
pub(crate) mod origin;
mod oslo;
mod oslo_solves;
pub mod read;
mod reader;
mod reading;
mod roa;
mod seq;
pub mod write;
mod write_seq;
mod zmx;

pub(crate) use format::PrescriptionFormat;
pub use read::read;
pub use reading::{Gap, Reading};

/// The formats that are read; a file is in the first that recognizes it.
pub(crate) static FORMATS: [&PrescriptionFormat; 13] = [
    &iset::FORMAT,
    &roa::FORMAT,
    &optiland::FORMAT,
    &lhlt::FORMAT,
    &json::FORMAT,
    &bench::FORMAT,
    &crayg::FORMAT,
    &flare::FORMAT,
    &oslo::FORMAT,
    &zmx::FORMAT,
    &seq::FORMAT,
    &lensoptics::FORMAT,
    &dat::FORMAT,
];
