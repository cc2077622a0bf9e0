//! Rational B-spline curves and surfaces of any order, with trimming and tessellation.
//!
//! Control points are homogeneous as in Inventor: `(x, y, z, w)` is the point `(x, y, z) / w`. All
//! arithmetic is `f64`. A surface is divided evenly between knots, at least as finely as in Coin,
//! and more finely where its control net bends. Vertices have the exact positions and normals of
//! the surface.
//!
//! The input comes from a file and may have any values. If a shape cannot be drawn the error is a
//! sentence with the reason. The work is bounded by [`MAX_ORDER`] and [`MAX_CELLS`].

mod basis;
mod control;
mod curve;
mod mesh;
mod surface;
mod trim;

pub(crate) use curve::Curve;
pub(crate) use surface::Surface;
pub(crate) use trim::trim_curve;

#[cfg(test)]
mod tests;
