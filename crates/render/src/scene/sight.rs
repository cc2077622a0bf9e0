//! What a point of the scene sees: the hits of rays that do not start at the camera, and the light
//! that comes straight from a luminous shape.
//!
//! A face that its shape culls is there only for what sees its front, be it the camera or another
//! point. Shapes below an `Annotation` are in front of everything for the camera only.

use glam::Vec3;

use super::point::{Point, clear_of};
use super::render_scene::RenderScene;
use crate::bvh::{Hit, Ray};

/// The largest number of transparent primitives that light passes between two points.
const MAX_PASSED: usize = 10_000;

impl Point<'_> {
    /// The distance from the surface at which [`Point::leave_anywhere`] starts a ray, in meters.
    pub(crate) fn clearance(&self) -> f32 {
        let size = self.position.abs().max_element();
        self.error + f32::EPSILON * (16.0 * size).max(6.0 * self.extent)
    }

    /// Returns a ray from the point in any direction, also along its surface.
    ///
    /// Where a ray meets the plane that it starts on, the distance has an error of a few ulps of
    /// the largest coordinate of the point or of the triangle's corners, whatever the plane's
    /// direction. So the ray starts that far from the surface. [`Point::leave`] allows only for the
    /// error of the position: from a floor at the camera's height, 17% of the rays of a cosine lobe
    /// met the floor again.
    pub(crate) fn leave_anywhere(&self, direction: Vec3) -> Ray {
        let side = match direction.dot(self.geometric) < 0.0 {
            true => -self.geometric,
            false => self.geometric,
        };
        let origin = [0, 1, 2].map(|i| clear_of(self.position[i], side[i], self.clearance()));
        Ray::new(Vec3::from_array(origin), direction)
    }
}

impl RenderScene {
    /// Returns the nearest hit that a point of the scene sees along a ray.
    pub(crate) fn hit_seen(&self, ray: &Ray) -> Option<Hit> {
        match self.special {
            false => self.hit_any_side(ray),
            true => self.nearest(ray, |hit| self.is_visible(ray, hit)),
        }
    }

    /// Whether what stops light on its way to a lamp is what a point sees, so that
    /// [`RenderScene::transmittance`] is [`RenderScene::clear_share`].
    pub(crate) fn sees_what_casts_shadows(&self) -> bool {
        let plain = |s: &super::Surface| s.casts_shadow && (s.refraction == 1.0 || s.is_opaque());
        !self.special && self.surfaces.iter().all(plain)
    }

    /// Returns the fraction of light that comes to the ray's origin in a straight line from its
    /// end. Glass that bends light stops it: a bent ray finds its own way.
    pub(crate) fn clear_share(&self, ray: &Ray) -> f32 {
        let (mut ahead, mut share) = (*ray, 1.0);
        for _ in 0..MAX_PASSED {
            let Some(hit) = self.hit_seen(&ahead) else {
                return share;
            };
            let point = self.point(&ahead, &hit);
            if point.surface.refraction != 1.0 {
                return 0.0;
            }
            share *= point.transparency;
            if share <= 0.0 {
                return 0.0;
            }
            ahead = self.continue_behind(&ahead, &hit);
        }
        0.0
    }
}
