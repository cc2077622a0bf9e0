//! The interface through which a snapshot gets bounding boxes.

use glam::DVec3;

use super::at_time::Snapshot;
use crate::iv::NodeId;

/// The smallest and the largest corner of a box in world space.
pub type Corners = (DVec3, DVec3);

/// Computes the bounding boxes of parts of a scene.
pub trait Bounds {
    /// Returns the bounding box of everything that the roots of a part draw.
    fn of_roots(&self, part: &Snapshot<'_>) -> Option<Corners>;

    /// Returns the bounding box of the nodes when they are traversed in order from the default
    /// state, with all levels of detail.
    fn of_nodes(&self, part: &Snapshot<'_>, nodes: &[NodeId]) -> Option<Corners>;
}

/// An implementation that knows no boxes. `ComputeBoundingBox` then has no outputs, and handles
/// surround a cube.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoBounds;

impl Bounds for NoBounds {
    fn of_roots(&self, _: &Snapshot<'_>) -> Option<Corners> {
        None
    }

    fn of_nodes(&self, _: &Snapshot<'_>, _: &[NodeId]) -> Option<Corners> {
        None
    }
}
