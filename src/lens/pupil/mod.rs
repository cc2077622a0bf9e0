//! The exit pupil as film points see it, and where on the lens to aim rays from them.
//!
//! `search` finds the outline of the pupil from one film point, and `sampler` asks it from many.
//! `radial` and `polar` are tables of outlines over the film, with and without rotational symmetry,
//! and `exit_pupil` is either. `polygon`, `spans` and `aims` draw points from an outline.

pub(crate) mod aims;
pub(crate) mod exit_pupil;
mod polar;
mod polygon;
mod radial;
pub(crate) mod rear_element;
mod sampler;
pub(crate) mod search;
mod spans;
mod support;
mod symmetry;
pub(crate) mod target;
pub(crate) mod transmission;
pub(crate) mod window;
