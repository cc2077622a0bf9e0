//! Traces many rays at once, one in each lane of a vector.
//!
//! The arithmetic is that of `trace` in fewer steps: the cosine comes from the discriminant, and
//! products are added with fused multiply-add where the processor has it. Away from grazing
//! incidence a lane's ray differs from that of
//! [`Lens::trace_from_film`](crate::lens::Lens::trace_from_film) by less than 1e-13 of the lens's
//! size (docs/decisions/0002-fused-arithmetic.md).

mod asphere;
pub(crate) mod bundle;
pub(crate) mod fills;
pub(crate) mod follow;
mod iris;
mod many;
mod quadric;
pub(crate) mod rows;
mod singly;
mod sphere;
mod step;
mod toroid;
pub(crate) mod transmittances;
