#![doc = include_str!("../README.md")]
#![deny(unsafe_code)]
#![forbid(unsafe_op_in_unsafe_fn)]
#![deny(clippy::undocumented_unsafe_blocks)]
#![warn(missing_docs, unreachable_pub)]

pub mod events;
pub mod grammar;
pub mod iv;
pub mod pose;
pub mod snapshot;
pub mod traversal;

pub use glam;
pub use ivcam_base::{diag, math};
