//! The list of the luminous primitives of a scene.

use super::alias::AliasTable;

/// The luminous primitives of a scene.
#[derive(Debug, Default)]
pub(crate) struct Emitters {
    /// The number and the place of each primitive.
    pub(super) list: Vec<(u32, u64)>,
    /// The choice among them.
    pub(super) table: AliasTable,
    /// The brightness of each surface's primitives in the scene's own list, and of those of
    /// prototypes; 0 if they are in no list.
    pub(super) brightness: Vec<f32>,
}
