//! One corner of a polygon, as shapes hand it to be drawn.

use glam::{Vec2, Vec3};

/// A polygon's corner in the shape's own space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub position: Vec3,
    pub normal: Vec3,
    /// Index of the diffuse color and transparency.
    pub material: u32,
    pub coordinates: Vec2,
    /// The third texture coordinate, for pictures in depth.
    pub third: f32,
}
