//! Projects points to the picture, in pixels, for sizes that Inventor measures there.

use glam::{DVec2, DVec3};

use crate::pose::{CameraPose, Projection};

/// The picture of a camera.
pub(super) struct Screen<'a> {
    /// The camera.
    pub camera: &'a CameraPose,
    /// The height of the picture in pixels.
    pub rows: f64,
}

impl Screen<'_> {
    /// Returns the size of a pixel in meters at a point of world space, or `None` behind the
    /// camera.
    pub(super) fn pixel_at(&self, world: DVec3) -> Option<f64> {
        let pixel = match self.camera.projection {
            Projection::Perspective { height_angle } => {
                let depth = (world - self.camera.position).dot(self.camera.direction());
                depth * 2.0 * libm::tan(0.5 * height_angle) / self.rows
            }
            Projection::Orthographic { height } => height / self.rows,
        };
        (pixel > 0.0 && pixel.is_finite()).then_some(pixel)
    }

    /// Returns a point's position in pixels to the right of and above the picture's center, or
    /// `None` behind the camera.
    pub(super) fn project(&self, world: DVec3) -> Option<DVec2> {
        let pixel = self.pixel_at(world)?;
        let local = self.camera.orientation.conjugate() * (world - self.camera.position);
        Some(local.truncate() / pixel)
    }

    /// Returns the area of the rectangle around a box in square pixels. It is infinite if a corner
    /// is behind the camera.
    pub(super) fn area(&self, (min, max): (DVec3, DVec3)) -> f64 {
        let mut low = DVec2::splat(f64::INFINITY);
        let mut high = DVec2::splat(f64::NEG_INFINITY);
        for i in 0..8 {
            let corner = DVec3::new(
                if i & 1 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 4 == 0 { min.z } else { max.z },
            );
            let Some(at) = self.project(corner) else {
                return f64::INFINITY;
            };
            (low, high) = (low.min(at), high.max(at));
        }
        (high - low).element_product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_seen_from_the_front_has_the_area_of_its_face() {
        let camera = CameraPose {
            position: DVec3::new(0.0, 0.0, 10.0),
            projection: Projection::Orthographic { height: 8.0 },
            ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
        };
        let screen = Screen {
            camera: &camera,
            rows: 80.0,
        };
        let area = screen.area((DVec3::splat(-1.0), DVec3::splat(1.0)));
        assert!((area - 400.0).abs() < 1e-9);
    }
}
