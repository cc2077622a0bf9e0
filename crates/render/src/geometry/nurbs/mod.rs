//! Rational B-spline curves and surfaces of any order, with trimming and tessellation.
//!
//! Control points are homogeneous as in Inventor: `(x, y, z, w)` is the point `(x, y, z) / w`. All
//! arithmetic is `f64`. [`Detail`] says how finely a surface is cut: so that the mesh is nowhere
//! farther from it than a tolerance, or, by Inventor's complexity, evenly between knots, at least
//! as finely as in Coin. Vertices have the exact normals of the surface, and its exact positions,
//! but for some on its edges that close gaps to neighbors.
//!
//! The input comes from a file and may have any values. If a shape cannot be drawn the error is a
//! sentence with the reason. The work is bounded by [`MAX_ORDER`] and [`MAX_CELLS`].

mod basis;
mod bezier;
mod control;
mod curve;
mod detail;
mod edges;
mod mesh;
mod surface;
mod surface_cuts;
mod trim;

pub(crate) use control::tolerance_in_pixels;
pub(crate) use curve::Curve;
pub(crate) use detail::{ChordalTolerance, Detail};
pub(crate) use surface::NurbsSurface;
pub(crate) use trim::trim_curve;

#[cfg(test)]
mod detail_tests;
#[cfg(test)]
mod tests;
