//! The point of the scene that is visible at a place of the picture.

use glam::DVec3;
use ivcam_inventor::pose::CameraPose;
use ivcam_render::bvh::Ray;
use ivcam_render::camera::Camera;
use ivcam_render::scene::RenderScene;

use super::session::Session;

/// Lens points tried in turn for the ray that represents a pixel: the middle, then points around it
/// for places where the rim blocks the middle.
const TRIES: [[f64; 2]; 5] = [[0.5, 0.5], [0.3, 0.5], [0.7, 0.5], [0.5, 0.3], [0.5, 0.7]];

/// The point of the scene that is visible at a place of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisiblePoint {
    /// The position in the world, in meters.
    pub point: DVec3,
    /// The distance along the optical axis from the front vertex in meters, as focus distances are
    /// measured.
    pub distance: f64,
}

/// Returns the visible point at a place of the picture; x and y are from 0 to 1.
pub(crate) fn visible_at(
    scene: &RenderScene,
    camera: &Camera,
    pose: &CameraPose,
    [x, y]: [f64; 2],
) -> Option<VisiblePoint> {
    let at = camera.at(x, y);
    let ray = TRIES.iter().find_map(|pupil| at.ray(*pupil))?;
    let hit = scene.hit(&Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3()))?;
    let point = ray.origin + f64::from(hit.t) * ray.direction + scene.origin;
    let distance = (point - pose.position).dot(pose.direction());
    Some(VisiblePoint { point, distance })
}

impl Session {
    /// Returns the visible point at a place of the picture; x and y are from 0 to 1, from the left
    /// and from the top.
    pub fn visible_at(&self, x: f64, y: f64) -> Option<VisiblePoint> {
        visible_at(&self.scene, &self.camera, &self.pose, [x, y])
    }
}
