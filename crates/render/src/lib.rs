#![doc = include_str!("../README.md")]
#![deny(unsafe_code)]
#![forbid(unsafe_op_in_unsafe_fn)]
#![deny(clippy::undocumented_unsafe_blocks)]
#![warn(missing_docs, unreachable_pub)]

pub mod bvh;
pub mod camera;
pub mod geometry;
pub mod render;
pub mod scene;
pub mod shade;
pub mod team;

pub use glam;
pub use ivcam_base::{diag, math};

#[cfg(test)]
#[path = "../../../tests/common/folder.rs"]
mod folder;
