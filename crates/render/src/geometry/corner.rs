//! The corner of a polygon that is to be drawn.

use glam::{Vec2, Vec3};

/// A polygon's corner in object space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// The corner's position.
    pub position: Vec3,
    /// The normal used for lighting.
    pub normal: Vec3,
    /// The index of the diffuse color and transparency.
    pub material: u32,
    /// The texture coordinates s and t.
    pub coordinates: Vec2,
    /// The texture coordinate r, for 3D textures.
    pub third: f32,
}
