//! A ray in the space of a prototype.

use glam::{DAffine3, DVec3};

use super::extent::absolute;
use crate::bvh::{PreparedRay, Ray};

/// A ray in the space of a prototype. Distances along it are those in the scene.
pub(super) struct LocalRay {
    /// The ray, rounded to f32.
    pub prepared: PreparedRay,
    /// The padding of boxes: see [`LocalRay::new`].
    pub padding: DVec3,
    origin: DVec3,
    inverse: DVec3,
}

impl LocalRay {
    /// Moves a ray of the scene to the space of a prototype with a box around it.
    ///
    /// The padding makes the tests of boxes conservative. It bounds four errors, each of a few
    /// units of 2^-24 of a coordinate: those of the corners in the scene, which compiling rounds;
    /// those of the triangle test, which subtracts the ray's origin in f32; and those of the ray's
    /// origin and direction here. The first two are errors in the scene, so the inverse matrix
    /// enlarges them. 2^-20 of the sum of all coordinates is 16 units.
    pub(super) fn new(
        origin: DVec3,
        direction: DVec3,
        scene_from_local: &DAffine3,
        (low, high): (DVec3, DVec3),
    ) -> Self {
        let inverse = scene_from_local.inverse();
        let local_origin = inverse.transform_point3(origin);
        let local_direction = inverse.transform_vector3(direction);
        let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
        let reach = scene_from_local.transform_point3(center).abs()
            + absolute(scene_from_local, half)
            + origin.abs();
        let sum = absolute(&inverse, reach) + local_origin.abs() + center.abs() + half;
        let ray = Ray::new(local_origin.as_vec3(), local_direction.as_vec3());
        Self {
            prepared: PreparedRay::new(&ray),
            padding: sum / f64::from(1 << 20),
            origin: local_origin,
            inverse: local_direction.to_array().map(invert).into(),
        }
    }

    /// Returns the distance at which the ray enters a box, or `None` if it misses the box between
    /// two distances.
    pub(super) fn enters(
        &self,
        (low, high): (DVec3, DVec3),
        (t_min, t_max): (f32, f32),
    ) -> Option<f64> {
        let a = (low - self.padding - self.origin) * self.inverse;
        let b = (high + self.padding - self.origin) * self.inverse;
        let near = a.min(b).max_element().max(f64::from(t_min));
        let far = a.max(b).min_element().min(f64::from(t_max));
        (near <= far + 1e-6 * far.abs()).then_some(near)
    }
}

/// The inverse of a direction's component, which is finite also for 0.
fn invert(component: f64) -> f64 {
    const SMALLEST: f64 = 1e-200;
    if component.abs() < SMALLEST {
        (1.0 / SMALLEST).copysign(component)
    } else {
        1.0 / component
    }
}
