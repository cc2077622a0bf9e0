//! Traces many rays at once: the arithmetic of `trace`, a lane a ray.
//!
//! The arithmetic is that of `trace` in fewer steps: the cosine comes from the discriminant, and
//! products are summed in one step where the processor can. A lane's ray is that of
//! [`Lens::trace_from_film`] to 1e-13 of the lens's size, away from grazing
//! (docs/decisions/0002-fused-arithmetic.md).

mod asphere;
pub(crate) mod bundle;
pub(crate) mod fills;
pub(crate) mod follow;
mod one_by_one;
mod quadric;
mod sphere;
mod step;
