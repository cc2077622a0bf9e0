#![doc = include_str!("../README.md")]
#![deny(unsafe_code)]
#![forbid(unsafe_op_in_unsafe_fn)]
#![deny(clippy::undocumented_unsafe_blocks)]
#![warn(missing_docs, unreachable_pub)]

pub mod diagram;
pub mod film;
pub mod lens;
pub mod lens_export;
pub mod picture;
pub mod prescription;
pub mod sampling;
pub mod spectrum;

pub use glam;
pub use ivcam_base::{diag, math};
