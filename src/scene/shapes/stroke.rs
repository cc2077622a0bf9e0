//! Lines and points as a camera's picture has them: a width in pixels, so a thickness that grows
//! with the distance from the camera, which is the scene's origin.

use glam::Vec3;

/// A tube with round ends between two points, or a ball where they are one.
#[derive(Clone, Copy, Debug)]
pub struct Stroke {
    pub a: Vec3,
    pub b: Vec3,
    /// Radius in meters, and what is added a meter of distance from the origin.
    pub fixed: f32,
    pub per_distance: f32,
    /// Materials at the ends; in between they mix.
    pub materials: [u32; 2],
    /// Normals at the ends, to be lit with; zero faces the camera.
    pub normals: [Vec3; 2],
}

impl Stroke {
    fn radius_at(&self, p: Vec3) -> f32 {
        self.fixed + self.per_distance * p.length()
    }

    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (ra, rb) = (self.radius_at(self.a), self.radius_at(self.b));
        (
            (self.a - ra).min(self.b - rb),
            (self.a + ra).max(self.b + rb),
        )
    }

    /// How far from `a` to `b` a point lies, 0 to 1.
    pub fn share_at(&self, p: Vec3) -> f32 {
        let along = self.b - self.a;
        let s = (p - self.a).dot(along) / along.length_squared();
        if s.is_finite() {
            s.clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// The normal at a share of the way, or none of its own.
    pub fn normal_at(&self, share: f32) -> Option<Vec3> {
        self.normals[0].lerp(self.normals[1], share).try_normalize()
    }

    /// Where a ray passes nearest to the line, if that is within the radius there.
    pub fn meet(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let (a, along) = (self.a.as_dvec3(), (self.b - self.a).as_dvec3());
        let w = o - a;
        let (dd, de, ee) = (d.dot(d), d.dot(along), along.dot(along));
        let (dw, ew) = (d.dot(w), along.dot(w));
        let disc = dd * ee - de * de;
        // The foot on the segment, clamped to its ends, then the ray's nearest point to it.
        let s = if disc > 1e-12 * dd * ee {
            ((dd * ew - de * dw) / disc).clamp(0.0, 1.0)
        } else if ee > 0.0 {
            (ew / ee).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let foot = a + s * along;
        let t = (foot - o).dot(d) / dd;
        let gap = (o + t * d - foot).length();
        (gap <= f64::from(self.radius_at(foot.as_vec3()))).then_some(t as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_as_wide_as_its_pixels_wherever_it_is() {
        let line = |z: f32| Stroke {
            a: Vec3::new(-1e3, 0.0, z),
            b: Vec3::new(1e3, 0.0, z),
            fixed: 0.0,
            per_distance: 0.01,
            materials: [0; 2],
            normals: [Vec3::ZERO; 2],
        };
        for z in [-1.0, -10.0, -1000.0] {
            let inside = Vec3::new(0.0, 0.0099, -1.0);
            let outside = Vec3::new(0.0, 0.0101, -1.0);
            assert!(line(z).meet(Vec3::ZERO, inside).is_some());
            assert!(line(z).meet(Vec3::ZERO, outside).is_none());
        }
    }
}
