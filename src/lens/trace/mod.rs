//! Exact tracing, a ray at a time; `lens::lanes` traces many side by side.

pub(crate) mod element;
pub(crate) mod meet;
pub(super) mod profile;
pub(crate) mod ray;
pub(crate) mod refraction;
pub(crate) mod tracer;
