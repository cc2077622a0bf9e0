//! Reads files of formats other than Inventor's and VRML's as nodes of X3D.
//!
//! * `x3d`: X3D in XML, which is translated to its classic encoding;
//! * `obj`, with `mtl`, the library of its materials;
//! * `ply` and `stl`;
//! * `gltf`, whose scenes have the nodes, materials and lights of X3D 4.
//!
//! `builder` adds the nodes of the last four. Nothing here recurses on the depth of a file, and no
//! list is larger than the bytes of the file allow.

mod builder;
pub(super) mod gltf;
mod mtl;
pub(super) mod obj;
pub(super) mod ply;
pub(super) mod stl;
mod text_lines;
pub(super) mod x3d;
