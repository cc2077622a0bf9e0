//! A ray, and the classification of its direction.

use glam::Vec3;

/// A ray in the space of its tree. For a scene that is in meters, with the compile origin at zero.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// The point at distance 0.
    pub origin: Vec3,
    /// The direction, of any length; distances are multiples of it.
    pub direction: Vec3,
    /// Hits at this distance or nearer are ignored.
    pub t_min: f32,
    /// Hits at this distance or farther are ignored.
    pub t_max: f32,
    /// The farthest distance that counts as the same plane as the primitive that the ray passed
    /// through last.
    pub(crate) plane_end: f32,
    /// The drawing rank of that primitive. Up to `plane_end`, the ray has passed every primitive
    /// with this rank or a later one.
    pub(crate) passed: u64,
}

impl Ray {
    /// A ray without limits, from distance 0 on.
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

    /// Whether the ray starts at distance 0, and no hit is ignored.
    pub(crate) fn has_no_limits(&self) -> bool {
        self.t_min == 0.0 && self.t_max == f32::INFINITY && self.plane_end == f32::NEG_INFINITY
    }

    /// The point at distance `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// The axis along which a direction is longest: 0, 1 or 2.
#[inline(always)]
pub(super) fn longest_axis([x, y, z]: [f32; 3]) -> usize {
    let [x, y, z] = [x.abs(), y.abs(), z.abs()];
    let y_or_z = if y > z { 1 } else { 2 };
    if (x > y) & (x > z) { 0 } else { y_or_z }
}

/// A number that is larger than every direction octant.
pub(super) const OCTANTS: usize = 32;

/// The three signs of a direction and its longest axis, which the rays of a packet must share.
#[inline(always)]
pub(super) fn direction_octant(direction: [f32; 3]) -> u32 {
    let [x, y, z] = direction;
    let bit = |d: f32, bit: u32| if d < 0.0 { bit } else { 0 };
    (longest_axis(direction) as u32) << 3 | bit(x, 1) | bit(y, 2) | bit(z, 4)
}
