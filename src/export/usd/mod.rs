//! USD as text (`.usda`): a tree of `Xform`s with meshes, materials of `UsdPreviewSurface`, lights,
//! cameras and motion.
//!
//! Shapes that are used several times inherit one class. Pictures of textures are files beside it.
//! Colors are in linear light.

mod geometry;
mod lights;
mod materials;
mod stage;
mod text;

pub(super) use stage::write;
