//! glTF 2.0: the whole scene in one file, as JSON or binary (GLB).
//!
//! The tree of nodes, their names and their matrices are kept, and shapes that are used several
//! times share a mesh. Pictures are embedded as PNG. `docs/guide/convert.md` describes how
//! materials and lights are mapped. The numbers of section refer to the specification of glTF
//! 2.0.1.

mod animation;
mod assets;
mod buffer;
mod container;
mod lights;
mod materials;
mod meshes;
mod nodes;
mod schema;
mod write;

pub(super) use container::Packing;
pub(super) use write::write;
