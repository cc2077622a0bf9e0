//! Projects points to the picture, in pixels, for sizes that Inventor measures there.

use glam::{DVec2, DVec3};
use ivcam_inventor::pose::{CameraPose, Projection};

/// The distance of the corner of a picture twice as wide as high from its middle, in half heights.
const CORNER: f64 = 2.236_067_977_499_79;

/// How much coarser than elsewhere things may be that the picture does not show directly.
const UNSEEN: f64 = 4.0;

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

    /// Returns the size in meters that covers a pixel at least, for what is inside a box of world
    /// space and is seen at a right angle.
    ///
    /// Away from the axis a picture in perspective is magnified by 1 / cos² of the angle, up to the
    /// corner of a picture twice as wide as high. Behind a plane mirror things are as far away as
    /// the light travels, which is no less than the distance of the box. What the picture can only
    /// show in mirrors, or as shadows, may be [`UNSEEN`] times as coarse.
    pub(super) fn finest_pixel(&self, (min, max): (DVec3, DVec3)) -> f64 {
        let forward = self.camera.direction();
        let (middle, reach) = (0.5 * (min + max), 0.5 * (max - min));
        let from_eye = middle - self.camera.position;
        let (distance, radius) = (from_eye.length(), reach.length());
        match self.camera.projection {
            Projection::Orthographic { height } => {
                let aside = from_eye.reject_from_normalized(forward).length() - radius;
                let is_seen = aside <= 0.5 * height * CORNER;
                height.abs() / self.rows * if is_seen { 1.0 } else { UNSEEN }
            }
            Projection::Perspective { height_angle } => {
                let half = libm::tan(0.5 * height_angle).abs();
                let corner = half * CORNER + self.camera.center.length();
                let nearest = from_eye.abs() - reach;
                let nearest = nearest.max(DVec3::ZERO).length();
                // An equidistant fish-eye, which sees more than others, shows angles up to the
                // corner's tangent.
                let sine = (radius / distance).min(1.0);
                let angle = from_eye.angle_between(forward) - libm::asin(sine);
                let scale = if radius < distance && angle > corner {
                    UNSEEN * nearest
                } else {
                    let depth = from_eye.dot(forward) - reach.dot(forward.abs());
                    let farthest = (from_eye.abs() + reach).length();
                    let straight = depth.max(0.0) * depth / farthest;
                    straight.max(nearest / (1.0 + corner * corner))
                };
                scale * 2.0 * half / self.rows
            }
        }
    }

    /// Returns a point's position in pixels to the right of and above the picture's center, or
    /// `None` behind the camera.
    pub(super) fn project(&self, world: DVec3) -> Option<DVec2> {
        let pixel = self.pixel_at(world)?;
        let local = self.camera.orientation.conjugate() * (world - self.camera.position);
        Some((local.truncate() + local.z * self.camera.center) / pixel)
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

    #[test]
    fn the_finest_pixel_of_a_box_is_no_larger_than_those_in_it() {
        for height_angle in [0.3, 0.8, 1.6] {
            let camera = CameraPose {
                position: DVec3::new(1.0, 2.0, 10.0),
                projection: Projection::Perspective { height_angle },
                ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
            };
            let screen = Screen {
                camera: &camera,
                rows: 100.0,
            };
            for k in 0..200 {
                let at = |n: usize, step: f64| ((k * n) as f64 * step).sin();
                let depth = 3.0 + 2.0 * at(3, 0.7);
                let half = depth * libm::tan(0.5 * height_angle);
                let aside = DVec3::new(1.8 * half * at(1, 1.1), 0.9 * half * at(2, 0.9), -depth);
                let point = camera.position + aside;
                let reach = DVec3::new(0.3, 0.2, 0.4) * at(5, 0.3).abs();
                let finest = screen.finest_pixel((point - reach, point + reach));
                let ray = aside.normalize();
                let moved = (0..32).map(|i| {
                    let turn = glam::DQuat::from_axis_angle(ray, 0.1 * f64::from(i));
                    let step = 1e-6 * (turn * ray.any_orthonormal_vector());
                    let from = screen.project(point).unwrap();
                    screen.project(point + step).unwrap().distance(from) / 1e-6
                });
                let pixel = 1.0 / moved.fold(0.0, f64::max);
                assert!(finest < 1.001 * pixel, "{finest} {pixel} at {aside}");
                // A small box has nearly the pixels of its middle.
                let exact = screen.finest_pixel((point, point));
                assert!(exact > 0.99 * pixel, "{exact} {pixel} at {aside}");
            }
        }
    }

    #[test]
    fn behind_the_camera_pixels_are_coarser_but_grow_with_the_distance() {
        let camera = CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0);
        let screen = Screen {
            camera: &camera,
            rows: 100.0,
        };
        let at = |z: f64| {
            let point = camera.position + DVec3::new(0.0, 0.0, z);
            screen.finest_pixel((point, point))
        };
        assert!((at(2.0) / at(-2.0) - UNSEEN).abs() < 1e-9);
        assert!((at(4.0) / at(2.0) - 2.0).abs() < 1e-9);
        let around = camera.position;
        assert_eq!(screen.finest_pixel((around - 1.0, around + 1.0)), 0.0);
    }
}
