//! Exact tracing: a ray at a time ([`tracer`]), and many side by side ([`lanes`]).

pub mod element;
pub mod lanes;
pub mod meet;
mod profile;
pub mod ray;
pub mod refraction;
pub mod tracer;
