//! What a snapshot asks of whoever can draw.

use glam::DVec3;

use super::at_time::Snapshot;
use crate::iv::NodeId;

/// The smallest and the largest corner of a box in the world.
pub(crate) type Corners = (DVec3, DVec3);

/// Measures parts of a scene.
pub trait Bounds {
    /// Returns the box around everything that the roots of a part draw.
    fn of_roots(&self, part: &Snapshot<'_>) -> Option<Corners>;

    /// Returns the box around what some nodes draw when they are walked in order from the default
    /// state, with all levels of detail.
    fn of_nodes(&self, part: &Snapshot<'_>, nodes: &[NodeId]) -> Option<Corners>;
}

/// Measures nothing: `ComputeBoundingBox` has no outputs, and handles surround a cube.
pub(crate) struct NoBounds;

impl Bounds for NoBounds {
    fn of_roots(&self, _: &Snapshot<'_>) -> Option<Corners> {
        None
    }

    fn of_nodes(&self, _: &Snapshot<'_>, _: &[NodeId]) -> Option<Corners> {
        None
    }
}
