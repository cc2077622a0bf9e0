//! Integration tests, compiled into the crate so that they may use its private items.
//!
//! A test of one file is in that file; a test of one scene or one scene file is a file under
//! `tests/golden` or `tests/iv`; a test of the program as a process is in `tests/cli.rs`.

mod book;
mod cameras;
pub(crate) mod common;
mod defaults;
mod dependencies;
mod film;
mod fit;
mod glass;
mod language;
mod layers;
mod metering;
mod movements;
mod option_page;
mod options;
mod paper;
mod photograph;
mod render;
mod second_approach;
mod snapshot;
#[cfg(feature = "viewer-tests")]
mod viewer;
mod work;
mod world;
