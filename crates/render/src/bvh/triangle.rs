//! The intersection of a ray with one triangle.

use glam::Vec3;

use super::ray::{Ray, longest_axis};

/// The largest inverse of a direction component: 2^64. Times a distance of up to 2^63 it is finite.
const LARGEST_INVERSE: f32 = 18_446_744_073_709_551_616.0;

/// A ray with the values of the box and triangle tests that depend only on it.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// The ray's origin.
    pub origin: Vec3,
    /// The ray's direction, in which −0.0 has become +0.0.
    pub direction: Vec3,
    /// The inverse of each component of the direction: see [`invert`].
    pub(super) inverse: Vec3,
    /// The axes of the direction: see [`axes`].
    pub(super) axes: [usize; 3],
    /// The shear that turns the direction into the third axis, and the scale of that axis.
    pub(super) shear: Vec3,
}

/// The two shorter axes of a direction and, last, its longest one; together right-handed.
#[inline]
pub(super) fn axes(direction: Vec3) -> [usize; 3] {
    let z = longest_axis(direction.to_array());
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    match direction[z] < 0.0 {
        true => [y, x, z],
        false => [x, y, z],
    }
}

impl PreparedRay {
    /// Prepares a ray.
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        Self::with_axes(ray, axes(ray.direction))
    }

    /// Prepares a ray by the axes of a ray with the same direction octant. The triangle tests are
    /// the most exact with its own axes.
    #[inline]
    pub(super) fn with_axes(ray: &Ray, axes: [usize; 3]) -> Self {
        let d = ray.direction + Vec3::ZERO; // turns −0.0 into +0.0
        let [x, y, z] = axes;
        Self {
            origin: ray.origin,
            direction: d,
            inverse: Vec3::new(invert(d.x), invert(d.y), invert(d.z)),
            axes,
            shear: Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        }
    }

    /// Intersects the ray with a triangle, and returns the distance and the weights of the second
    /// and third corner.
    ///
    /// This is the watertight test of Woop, Benthin and Wald (2013). Two triangles that share an
    /// edge compute the same sign for it, so no ray passes between them. If an edge function is
    /// exactly 0, it is computed again in f64. A ray that meets an edge or a corner exactly counts
    /// as one slightly beside it, the same for all triangles, so that it hits one of those that
    /// share the edge, as in OpenGL 1.1, 3.5.1.
    pub(crate) fn triangle(
        &self,
        corners: &[Vec3; 3],
        t_min: f32,
        t_max: f32,
    ) -> Option<(f32, f32, f32)> {
        let [kx, ky, kz] = self.axes;
        let (a, b, c) = (
            corners[0] - self.origin,
            corners[1] - self.origin,
            corners[2] - self.origin,
        );
        let s = self.shear;
        let (ax, ay) = (a[kx] - s.x * a[kz], a[ky] - s.y * a[kz]);
        let (bx, by) = (b[kx] - s.x * b[kz], b[ky] - s.y * b[kz]);
        let (cx, cy) = (c[kx] - s.x * c[kz], c[ky] - s.y * c[kz]);
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        let outside = |u: f32, v: f32, w: f32| {
            (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)
        };
        // A sign other than 0 is correct, because rounding keeps the order of the two products.
        if outside(u, v, w) {
            return None;
        }
        if u == 0.0 || v == 0.0 || w == 0.0 {
            let wide = |p: f32, q: f32, r: f32, t: f32| {
                (f64::from(p) * f64::from(q) - f64::from(r) * f64::from(t)) as f32
            };
            u = wide(cx, by, cy, bx);
            v = wide(ax, cy, ay, cx);
            w = wide(bx, ay, by, ax);
            // What remains 0 has the sign of its change with the ray's first axis, or its second.
            let beside = |edge: f32, (px, py): (f32, f32), (qx, qy): (f32, f32)| {
                let changes = [edge, py - qy, qx - px];
                changes.into_iter().find(|n| *n != 0.0).unwrap_or(0.0)
            };
            let (a, b, c) = ((ax, ay), (bx, by), (cx, cy));
            if outside(beside(u, c, b), beside(v, a, c), beside(w, b, a)) {
                return None;
            }
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = (u * a[kz] + v * b[kz] + w * c[kz]) * s.z / det;
        (t > t_min && t < t_max).then(|| (t, v / det, w / det))
    }
}

/// The inverse of a direction component, at most [`LARGEST_INVERSE`] in size.
#[inline(always)]
pub(super) fn invert(component: f32) -> f32 {
    let inverse = 1.0 / component;
    if component.abs() <= 1.0 / LARGEST_INVERSE {
        LARGEST_INVERSE.copysign(component)
    } else {
        inverse
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The distance of the nearest hit, found by testing every triangle.
    pub(crate) fn brute(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<f32> {
        let prepared = PreparedRay::new(ray);
        triangles
            .iter()
            .filter_map(|c| prepared.triangle(c, 0.0, f32::INFINITY).map(|h| h.0))
            .min_by(f32::total_cmp)
    }

    #[test]
    fn no_ray_passes_between_two_triangles_with_a_common_edge() {
        let a = [Vec3::ZERO, Vec3::X, Vec3::ONE];
        let b = [Vec3::ZERO, Vec3::ONE, Vec3::Y];
        for i in 1..10_000 {
            let s = i as f32 / 10_000.0;
            let ray = Ray::new(
                Vec3::new(0.3, 0.2, -7.0),
                Vec3::splat(s) - Vec3::new(0.3, 0.2, -7.0),
            );
            assert!(brute(&[a, b], &ray).is_some(), "missed both at {s}");
        }
    }

    /// The triangles are those of a square with two diagonals, of both orders of corners.
    #[test]
    fn a_ray_through_an_edge_or_a_corner_hits_one_of_the_triangles_around_it() {
        let ring = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corner = |i: usize| Vec3::new(ring[i % 4][0], ring[i % 4][1], 0.0);
        let fan: [[Vec3; 3]; 4] = std::array::from_fn(|i| match i {
            0 | 1 => [Vec3::ZERO, corner(i), corner(i + 1)],
            _ => [corner(i + 1), corner(i), Vec3::ZERO],
        });
        for (x, y) in [
            (0.0, 0.0),
            (0.5, 0.5),
            (-0.25, 0.25),
            (0.75, -0.75),
            (0.25, 0.5),
        ] {
            for toward in [
                Vec3::NEG_Z,
                Vec3::new(0.25, -0.5, -1.0),
                Vec3::new(0.5, 0.5, 1.0),
            ] {
                let ray = PreparedRay::new(&Ray::new(Vec3::new(x, y, 0.0) - 4.0 * toward, toward));
                let hits = fan
                    .iter()
                    .filter_map(|c| ray.triangle(c, 0.0, f32::INFINITY));
                assert_eq!(hits.count(), 1, "{x} {y} {toward}");
            }
        }
    }
}
