//! ivcam photographs Open Inventor and VRML scenes through real lenses.
//!
//! Data moves one way: bytes become an `iv` document, a walk with Inventor's state rules turns
//! it into a render scene, a lens prescription and a pose become a camera, and a film collects
//! the radiance that the camera's rays bring. Each step is usable alone; nothing is global,
//! nothing prints, and a wrong file is a [`diag::Diagnostic`].

#![forbid(unsafe_op_in_unsafe_fn)]
#![warn(unreachable_pub)]

mod bvh;
pub mod camera;
pub mod cli;
pub mod compare;
pub mod diag;
mod diagram;
pub mod film;
mod geometry;
pub mod grammar;
pub mod iv;
pub mod lens;
pub mod math;
mod movie;
pub mod photo;
pub mod picture;
pub mod pose;
pub mod prescription;
pub mod render;
mod sampling;
pub mod scene;
mod shade;
pub mod snapshot;
mod spectrum;
mod traversal;
// Without the window itself, only tests and `measure latency` drive what is in it.
#[cfg(feature = "panels")]
#[cfg_attr(not(feature = "viewer"), allow(dead_code))]
mod viewer;

#[cfg(feature = "tools")]
#[path = "../tools/mod.rs"]
pub mod tools;

#[cfg(test)]
#[path = "../tests/internal/mod.rs"]
mod internal_tests;
