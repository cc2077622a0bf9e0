//! A ray, and what is decided by its direction alone.

use glam::Vec3;

/// A ray in the space of its tree. A scene's is in meters, with the compile origin at zero.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    /// Need not be of length 1; distances are multiples of its length.
    pub direction: Vec3,
    /// Nearer hits do not count.
    pub t_min: f32,
    /// Farther hits do not count.
    pub t_max: f32,
    /// Where the plane of the primitive that the ray passed through last ends.
    pub(crate) plane_end: f32,
    /// The ray has passed what was drawn at this rank or later in the plane that ends at
    /// `plane_end`.
    pub(crate) passed: u64,
}

impl Ray {
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
            plane_end: f32::NEG_INFINITY,
            passed: 0,
        }
    }

    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// The ray's direction octant: see [`direction_octant`].
    pub fn octant(&self) -> u32 {
        direction_octant(self.direction.to_array())
    }
}

/// The axis along which a direction is longest: 0, 1 or 2.
#[inline(always)]
pub(super) fn longest_axis([x, y, z]: [f32; 3]) -> usize {
    let [x, y, z] = [x.abs(), y.abs(), z.abs()];
    let y_or_z = if y > z { 1 } else { 2 };
    if (x > y) & (x > z) { 0 } else { y_or_z }
}

/// What the rays of a packet must agree on: the three signs of the direction and its longest axis.
#[inline(always)]
pub(super) fn direction_octant(direction: [f32; 3]) -> u32 {
    let [x, y, z] = direction;
    let bit = |d: f32, bit: u32| if d < 0.0 { bit } else { 0 };
    (longest_axis(direction) as u32) << 3 | bit(x, 1) | bit(y, 2) | bit(z, 4)
}
