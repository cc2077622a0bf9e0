//! Fuzz targets: functions that take the bytes of a hostile file and panic if the program is wrong.
//!
//! There is one target for each kind of file that ivcam reads, and one for the whole road from a
//! scene's bytes to a picture. The crate in `afl/` runs them with a coverage-guided fuzzer
//! (CONTRIBUTING.md has the command), and `smoke` runs them on seeds, on a few thousand mutations
//! and on all inputs that a fuzzer found, which are in `findings/`, in every `cargo test`.
//!
//! `scenes`, `lenses`, `options` and `tables` have the targets, `target` lists them; `seeds` has
//! their first inputs and `words` the dictionaries; `mutate` damages inputs.

mod lenses;
#[cfg(test)]
mod mutate;
pub(crate) mod options;
mod scenes;
mod seeds;
#[cfg(test)]
mod smoke;
mod tables;
mod target;
mod words;

pub(crate) use target::{TARGETS, Target};
