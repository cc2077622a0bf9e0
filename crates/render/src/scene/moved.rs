//! Where the points of a scene are in the same scene at another time.

use glam::{DVec3, Vec3};

use super::placed::Primitive;
use super::render_scene::RenderScene;
use crate::bvh::{Hit, Ray};

impl RenderScene {
    /// Whether the scene has the same primitives as another one, each with the same number, so that
    /// they may be the same scene at another time.
    pub fn has_primitives_of(&self, other: &Self) -> bool {
        let instances = |scene: &Self| scene.instances.as_ref().map(|all| all.len());
        self.triangles.len() == other.triangles.len()
            && self.quadrics.len() == other.quadrics.len()
            && self.strokes.len() == other.strokes.len()
            && self.owners == other.owners
            && instances(self) == instances(other)
    }

    /// Returns where the point of a hit is in the world, and where it is in the same scene at
    /// another time, in meters. The points of a primitive keep their places in it: those of a
    /// triangle between its corners, those of a round surface in object space.
    pub(crate) fn moved(&self, ray: &Ray, hit: &Hit, later: &Self) -> [DVec3; 2] {
        let place = |scene: &Self| match scene.primitive(hit) {
            Primitive::Triangle([a, b, c]) => {
                let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
                let [u, v] = [hit.u, hit.v].map(f64::from);
                a * (1.0 - u - v) + b * u + c * v
            }
            Primitive::Quadric(quadric) => quadric
                .scene_from_object
                .transform_point3(self.object_point(ray, hit)),
            Primitive::Stroke(stroke) => {
                let share = self.share_of_stroke(ray, hit);
                stroke.a.lerp(stroke.b, share).as_dvec3()
            }
        };
        [self, later].map(|scene| place(scene) + scene.origin)
    }

    /// The point of a hit on a round surface, in object space.
    fn object_point(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        match self.primitive(hit) {
            Primitive::Quadric(quadric) => {
                let (point, _) = quadric.project_to_surface(ray.at(hit.t).as_dvec3());
                point
            }
            _ => DVec3::ZERO,
        }
    }

    /// The part of a line at a hit, from 0 to 1.
    fn share_of_stroke(&self, ray: &Ray, hit: &Hit) -> f32 {
        match self.primitive(hit) {
            Primitive::Stroke(stroke) => stroke.share_at(ray.at(hit.t)),
            _ => 0.0,
        }
    }
}
