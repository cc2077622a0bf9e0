//! What nodes refer to: the meshes, the materials and the binary part of a file.

use super::buffer::BinaryBuffer;
use super::materials::Materials;
use super::meshes::Meshes;

/// The meshes, the materials and the binary part of a file.
#[derive(Debug, Default)]
pub(super) struct Assets {
    pub buffer: BinaryBuffer,
    pub meshes: Meshes,
    pub materials: Materials,
}
