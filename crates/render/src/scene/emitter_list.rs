//! The list of the luminous primitives of a scene.

use std::collections::HashMap;

use super::emitter_tree::LampTree;
use super::lamp_faces::LampFace;
use super::lamp_lanes::LampLanes;

/// The luminous primitives of a scene, as the leaves of a tree.
#[derive(Debug, Default)]
pub(crate) struct Emitters {
    /// The number and the place of each primitive, in the order of the leaves.
    pub(super) list: Vec<(u32, u64)>,
    pub(super) tree: LampTree,
    pub(super) lanes: LampLanes,
    /// The flat shape of each leaf that is one; empty if there are very many leaves.
    pub(super) faces: Vec<Option<LampFace>>,
    /// The leaf of each primitive of the scene's own list, up to the last luminous one;
    /// [`NO_LEAF`] if it has none.
    pub(super) leaves: Vec<u32>,
    /// The leaves of primitives of prototypes.
    pub(super) placed_leaves: HashMap<(u32, u64), u32>,
}

/// The leaf of no primitive.
pub(super) const NO_LEAF: u32 = u32::MAX;
