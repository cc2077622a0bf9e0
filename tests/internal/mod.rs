//! Integration tests, compiled into the crate so that they may use its private items.
//!
//! A test of one file is in that file; a test of one scene or one scene file is a file under
//! `tests/golden` or `tests/iv`; a test of the program as a process is in `tests/cli.rs`.

mod aberrations;
pub(crate) mod common;
mod compare;
mod extreme;
mod film;
mod fit;
mod glass;
mod hostile;
mod iv;
mod language;
mod layers;
mod lens;
mod lens_files;
mod movements;
mod nodes;
mod options;
mod photograph;
mod roundtrip;
#[cfg(feature = "scripts")]
mod scripts;
mod second_approach;
mod snapshot;
#[cfg(feature = "viewer-tests")]
mod viewer;
mod vrml97_defaults;
mod walk;
