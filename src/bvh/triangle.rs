//! A ray's meeting with one triangle.

use glam::Vec3;

use super::ray::{Ray, longest_axis};

const LARGEST_INVERSE: f32 = 18_446_744_073_709_551_616.0; // 2^64

/// The part of the box test and the triangle test that depends on the ray alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedRay {
    pub origin: Vec3,
    pub direction: Vec3,
    pub(super) inverse: Vec3,
    /// The two shorter axes of the direction and, last, its longest one; right-handed.
    pub(super) axes: [usize; 3],
    pub(super) shear: Vec3,
}

impl PreparedRay {
    #[inline]
    pub(crate) fn new(ray: &Ray) -> Self {
        let d = ray.direction + Vec3::ZERO; // turns −0.0 into +0.0
        let inverse = Vec3::new(invert(d.x), invert(d.y), invert(d.z));
        let z = longest_axis(d.to_array());
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        Self {
            origin: ray.origin,
            direction: d,
            inverse,
            axes: [x, y, z],
            shear: Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        }
    }

    /// Where the ray meets a triangle: the distance and the weights of the second and third corner.
    ///
    /// Woop, Benthin and Wald's test: the edge signs are the same for two triangles that share an
    /// edge, so no ray slips between them; an edge value of exactly 0 is decided in f64.
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
        // A sign other than 0 is right: rounding keeps the order of the two products.
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
            if outside(u, v, w) {
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

    /// The nearest hit by asking every triangle.
    pub(crate) fn brute(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<f32> {
        let prepared = PreparedRay::new(ray);
        triangles
            .iter()
            .filter_map(|c| prepared.triangle(c, 0.0, f32::INFINITY).map(|h| h.0))
            .min_by(f32::total_cmp)
    }

    #[test]
    fn no_ray_slips_through_the_edge_of_two_triangles() {
        let a = [Vec3::ZERO, Vec3::X, Vec3::ONE];
        let b = [Vec3::ZERO, Vec3::ONE, Vec3::Y];
        for i in 1..10_000 {
            let s = i as f32 / 10_000.0;
            let ray = Ray::new(
                Vec3::new(0.3, 0.2, -7.0),
                Vec3::splat(s) - Vec3::new(0.3, 0.2, -7.0),
            );
            assert!(brute(&[a, b], &ray).is_some(), "slipped at {s}");
        }
    }
}
