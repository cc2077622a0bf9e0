//! The prototypes of a compiled scene and their instances, for rays.
//!
//! A prototype holds shapes in their object space, and other prototypes; the scene holds prototypes
//! beside its own primitives. A ray is moved into the space of a prototype to walk its tree.
//! Triangles and round surfaces that it may hit are moved to the scene by the arithmetic of
//! compiling and tested there, so that a hit has the bits of a scene without prototypes.
//!
//! The decision record 25 says why. Nothing here knows nodes or surfaces.

mod extent;
mod local_ray;
mod prototype;
mod search;
mod shape;
mod steps;
mod store;
mod tree;

pub(in crate::scene) use extent::{Extent, grid_bounds, moved};
pub(in crate::scene) use prototype::{ElementContent, Prototype};
pub(in crate::scene) use shape::{ShapeLists, ShapePrimitives};
pub(in crate::scene) use steps::RaySteps;
pub(in crate::scene) use store::Instances;
