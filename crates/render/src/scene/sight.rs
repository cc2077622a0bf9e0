//! What a point of the scene sees: the hits of rays that do not start at the camera, and the light
//! that comes straight from a luminous shape.
//!
//! A face that its shape culls is there only for what sees its front, be it the camera or another
//! point. But the back of glass that bends light is there for every point, because light leaves a
//! body through it. Shapes below an `Annotation` are in front of everything for the camera only.

use std::ops::ControlFlow;

use glam::Vec3;

use super::hit::is_clipped;
use super::point::Point;
use super::render_scene::RenderScene;
use crate::bvh::{Hit, Ray};

/// The largest number of transparent primitives that light passes between two points.
const MAX_PASSED: usize = 10_000;

impl Point<'_> {
    /// The distance from the surface at which `MetPoint::leave` starts a ray, in meters.
    pub(crate) fn clearance(&self) -> f32 {
        clearance(self.position, self.error, self.extent)
    }
}

/// See [`Point::clearance`].
#[inline(always)]
pub(super) fn clearance(position: Vec3, error: f32, extent: f32) -> f32 {
    let size = position.abs().max_element();
    error + f32::EPSILON * (16.0 * size).max(6.0 * extent)
}

impl RenderScene {
    /// Returns the nearest hit that a point of the scene sees along a ray.
    pub(crate) fn hit_seen(&self, ray: &Ray) -> Option<Hit> {
        match self.special {
            false => self.hit_any_side(ray),
            true => self.nearest(ray, |hit| self.is_seen(ray, hit)),
        }
    }

    /// Whether a point of the scene sees a hit: it is visible, or on a back face of glass and not
    /// clipped.
    pub(crate) fn is_seen(&self, ray: &Ray, hit: &Hit) -> bool {
        let surface = self.surface(hit);
        match surface.culls && surface.bends_light() {
            true => !is_clipped(surface, ray.at(hit.t)),
            false => self.is_visible(ray, hit),
        }
    }

    /// Whether what stops light on its way to a lamp is what a point sees, so that
    /// [`RenderScene::transmittance`] is [`RenderScene::clear_share`].
    pub(crate) fn sees_what_casts_shadows(&self) -> bool {
        let plain = |s: &super::Surface| s.casts_shadow && !s.bends_light();
        !self.special && self.surfaces.iter().all(plain)
    }

    /// Returns the fraction of light that comes to the ray's origin in a straight line from its
    /// end. Glass that bends light stops it: a bent ray finds its own way.
    pub(crate) fn clear_share(&self, ray: &Ray) -> f32 {
        self.share_passed(ray, |ahead| {
            let hit = self.hit_seen(ahead);
            hit.map_or(ControlFlow::Break(true), ControlFlow::Continue)
        })
    }

    /// Returns the fraction of light that comes along a ray in a straight line, through the hits
    /// that `next` finds on it, until that says whether the light begins there.
    pub(super) fn share_passed(
        &self,
        ray: &Ray,
        next: impl Fn(&Ray) -> ControlFlow<bool, Hit>,
    ) -> f32 {
        let (mut ahead, mut share) = (*ray, 1.0);
        for _ in 0..MAX_PASSED {
            let hit = match next(&ahead) {
                ControlFlow::Continue(hit) => hit,
                ControlFlow::Break(is_lit) => return if is_lit { share } else { 0.0 },
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
