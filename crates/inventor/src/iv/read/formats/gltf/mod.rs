//! Reads glTF 2.0 (Khronos, *glTF 2.0 Specification*), as JSON and as GLB, into the nodes of X3D 4.
//!
//! * `schema` is the JSON, `container` finds it, and `buffers` reads numbers;
//! * `reader` adds the tree of nodes, with cameras and lights; `skins` places the vertices of
//!   meshes by their joints at rest;
//! * `meshes` and `materials` add shapes and appearances;
//! * `animation` adds clocks, interpolators and routes.
//!
//! The colors of glTF are linear, and those of a `PhysicalMaterial` and its vertices are too.

mod animation;
mod buffers;
mod container;
mod materials;
mod meshes;
mod reader;
mod schema;
mod skins;

pub(in crate::iv::read) use reader::read;
