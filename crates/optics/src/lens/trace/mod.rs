//! Exact tracing of one ray at a time. `lens::lanes` traces many at once.

pub(crate) mod element;
pub(crate) mod intersect;
pub(super) mod profile;
pub mod ray;
pub(crate) mod refraction;
mod thin_lens;
pub(crate) mod tracer;
