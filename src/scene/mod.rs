//! Compiles what a walk meets into what a ray can hit.

pub mod mesh;
pub mod nurbs;
pub mod text;
