//! Rational B-spline curves and surfaces of any order, their trimming, and triangles for them.
//!
//! Control points are homogeneous as in Inventor: `(x, y, z, w)` is the point `(x, y, z) / w`.
//! Everything is `f64`. A surface is cut evenly between knots, at least as finely as Coin cuts it,
//! and more finely where its control net bends. Positions and normals are the surface's own.
//!
//! The input comes from a file and may be anything: whatever cannot be drawn is a sentence that
//! says why, and the work is bounded by [`MAX_ORDER`] and [`MAX_CELLS`].

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
