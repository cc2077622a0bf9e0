//! The binary tree that `build` makes and `collapse` turns into nodes of eight boxes.

use glam::Vec3;

/// The smallest and the largest corner of a box.
pub(super) type Box3 = (Vec3, Vec3);

/// A node of the binary tree: a box with two children, which follow each other, or with primitives.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    /// The smallest corner of the box.
    pub min: Vec3,
    /// The first child, or the first slot of a leaf.
    pub first: u32,
    /// The largest corner of the box.
    pub max: Vec3,
    /// Number of primitives in a leaf; 0 in an inner node.
    pub count: u32,
}

impl BinaryNode {
    pub(super) const NONE: Self = Self {
        min: Vec3::ZERO,
        first: 0,
        max: Vec3::ZERO,
        count: 0,
    };
}

/// A binary tree of boxes around primitives.
#[derive(Clone, Debug, Default)]
pub(super) struct BinaryBvh {
    /// The nodes, with the root first.
    pub nodes: Vec<BinaryNode>,
    /// The primitives, in the order of the leaves' slots.
    pub order: Vec<u32>,
}
