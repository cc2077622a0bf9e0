//! Texture coordinates from the bounding box of a shape.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

/// Generates texture coordinates from a bounding box. By default s runs from 0 to 1 along the
/// longest side of the box, and t along the next one at the same scale.
pub(crate) struct BoxCoordinates {
    origin: Vec3,
    size: Vec3,
    /// One over the longest side.
    scale: f32,
    /// The axes of s, t and r.
    axes: [usize; 3],
}

impl BoxCoordinates {
    /// Finds the bounding box of points.
    pub(crate) fn of(points: impl Iterator<Item = Vec3>) -> Self {
        let mut min = Vec3::splat(f32::INFINITY);
        let mut max = Vec3::splat(f32::NEG_INFINITY);
        for p in points.filter(|p| p.is_finite()) {
            min = min.min(p);
            max = max.max(p);
        }
        let size = (max - min).max(Vec3::ZERO);
        // The longest side is first. Of equal sides the later axis is first (Coin).
        let mut order = [2usize, 1, 0];
        order.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
        let longest = size[order[0]];
        Self {
            origin: min,
            size,
            scale: if longest > 0.0 { 1.0 / longest } else { 0.0 },
            axes: order,
        }
    }

    /// Gives equal sides the order x, y, z, as VRML97 states (6.23).
    pub(crate) fn with_first_of_equal_sides(mut self) -> Self {
        let size = self.size;
        self.axes = [0, 1, 2];
        self.axes.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
        self
    }

    /// Returns the default coordinates of a point.
    pub(crate) fn at(&self, p: Vec3) -> Vec3 {
        Vec3::from_array(self.axes.map(|axis| p[axis] - self.origin[axis])) * self.scale
    }

    /// Returns the coordinates of a point on a sphere around the origin of object space. s runs
    /// around from the back and t runs up (Coin).
    pub(crate) fn on_sphere(&self, p: Vec3) -> Vec2 {
        let up = libm::atan2f(p.y, libm::hypotf(p.x, p.z)) / PI + 0.5;
        Vec2::new(around(p), up)
    }

    /// Returns the coordinates of a point on a cylinder about the y axis with the height of the
    /// box. If y is the largest component of the normal they are those on a cap (Coin).
    pub(crate) fn on_cylinder(&self, p: Vec3, normal: Vec3) -> Vec2 {
        let q = share(p, self.origin, self.size);
        match steepest(normal) {
            1 if normal.y > 0.0 => Vec2::new(q.x, 1.0 - q.z),
            1 => Vec2::new(q.x, q.z),
            _ => Vec2::new(around(p), q.y),
        }
    }

    /// Returns the coordinates of a point on the side of a cube that its normal points to. The cube
    /// has the box's center, and its side is the longest side of the box (Coin).
    pub(crate) fn on_cube(&self, p: Vec3, normal: Vec3) -> Vec2 {
        let size = Vec3::splat(self.size.max_element());
        let q = share(p, self.origin + 0.5 * (self.size - size), size);
        let side = steepest(normal);
        match (side, normal[side] >= 0.0) {
            (0, true) => Vec2::new(1.0 - q.z, q.y),
            (0, false) => Vec2::new(q.z, q.y),
            (1, true) => Vec2::new(q.x, 1.0 - q.z),
            (1, false) => Vec2::new(q.x, q.z),
            (_, true) => Vec2::new(q.x, q.y),
            (_, false) => Vec2::new(1.0 - q.x, q.y),
        }
    }
}

/// Returns the angle of a point about the y axis, from 0 to 1 around from the back.
fn around(p: Vec3) -> f32 {
    libm::atan2f(p.x, p.z) / TAU + 0.5
}

/// Returns the position of a point in a box, from 0 to 1 along each axis. A side of length 0 counts
/// as 1.
fn share(p: Vec3, origin: Vec3, size: Vec3) -> Vec3 {
    (p - origin) / Vec3::select(size.cmpeq(Vec3::ZERO), Vec3::ONE, size)
}

/// Returns the axis of the largest component of a normal, the first of equal ones.
fn steepest(normal: Vec3) -> usize {
    let length = normal.abs();
    [1, 2].into_iter().fold(0, |most, axis| {
        if length[axis] > length[most] {
            axis
        } else {
            most
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected values are Coin's, for a corner of a block of 4 by 2 by 2.
    #[test]
    fn textures_are_wrapped_around_a_box() {
        let corners = [Vec3::new(-2.0, -1.0, -1.0), Vec3::new(2.0, 1.0, 1.0)];
        let boxed = BoxCoordinates::of(corners.into_iter());
        let p = Vec3::new(2.0, 1.0, 1.0);
        for (seen, at) in [
            (boxed.on_cube(p, Vec3::Z), [1.0, 0.75]),
            (boxed.on_cube(p, Vec3::X), [0.25, 0.75]),
            (boxed.on_cube(p, Vec3::Y), [1.0, 0.25]),
            (boxed.on_cylinder(p, Vec3::Y), [1.0, 0.0]),
            (boxed.on_cylinder(p, Vec3::Z), [0.676_208_2, 1.0]),
            (boxed.on_sphere(p), [0.676_208_2, 0.633_859]),
        ] {
            let off = (seen - Vec2::from_array(at)).length();
            assert!(off < 1e-5, "{seen} for {at:?}");
        }
    }
}
