#![doc = include_str!("../README.md")]
#![deny(unsafe_code)]
#![forbid(unsafe_op_in_unsafe_fn)]
#![deny(clippy::undocumented_unsafe_blocks)]
#![warn(missing_docs, unreachable_pub)]

pub mod diag;
pub mod files;
pub mod math;
pub mod memory;
pub mod platform;
pub mod thread_context;
pub mod work;

#[cfg(test)]
#[path = "../../../tests/common/folder.rs"]
mod folder;
