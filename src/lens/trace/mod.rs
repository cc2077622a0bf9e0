//! Exact tracing, a ray at a time; `lens::lanes` traces many side by side.

pub mod element;
pub mod meet;
pub(super) mod profile;
pub mod ray;
pub mod refraction;
pub mod tracer;
