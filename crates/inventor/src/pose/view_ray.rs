//! The rays of a camera's view: from a place in the picture into the world.

use glam::{DMat4, DVec2, DVec3};

use super::camera_pose::CameraPose;
use super::projection::{Projection, ViewportMapping};

/// The extent of a camera's view in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewExtent {
    /// Half of the picture's width and height: at distance 1 for a perspective camera, at any
    /// distance for an orthographic one.
    pub half: DVec2,
    /// The middle of the picture, from the camera's axis, measured as `half`.
    pub center: DVec2,
    /// Half of the width and height of the view, where those of the picture are 1.
    pub frame: DVec2,
}

/// A ray in the world, in meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRay {
    /// Where the ray starts.
    pub origin: DVec3,
    /// The direction, of length 1 in world space.
    pub direction: DVec3,
}

impl ViewRay {
    /// Returns the ray in another space, where the direction may have another length.
    #[must_use]
    pub fn transformed(&self, matrix: &DMat4) -> Self {
        Self {
            origin: matrix.transform_point3(self.origin),
            direction: matrix.transform_vector3(self.direction),
        }
    }

    /// Returns the point at a distance along the ray.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + distance * self.direction
    }
}

impl CameraPose {
    /// Returns the extent of the view in a picture of an aspect ratio, width over height.
    ///
    /// If the aspect ratio is not that of the camera, Inventor's `viewportMapping` decides:
    /// `ADJUST_CAMERA` keeps the height angle on the shorter side, the `CROP_` values leave a part
    /// of the picture black, and `LEAVE_ALONE` stretches the picture. The view of X3D's
    /// `OrthoViewpoint` is extended.
    pub fn view_extent(&self, aspect: f64) -> ViewExtent {
        let half_height = match self.projection {
            Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
            Projection::Orthographic { height } => 0.5 * height,
        };
        let own = if self.aspect_ratio > 0.0 {
            self.aspect_ratio
        } else {
            1.0
        };
        let (half, frame) = match self.viewport_mapping {
            ViewportMapping::AdjustCamera => {
                let y = if aspect < 1.0 {
                    half_height / aspect
                } else {
                    half_height
                };
                (DVec2::new(aspect * y, y), DVec2::ONE)
            }
            ViewportMapping::ExtendView => {
                let y = half_height * (own / aspect).max(1.0);
                (DVec2::new(aspect * y, y), DVec2::ONE)
            }
            ViewportMapping::LeaveAlone => (DVec2::new(own * half_height, half_height), DVec2::ONE),
            _ if aspect > own => {
                let half = DVec2::new(aspect * half_height, half_height);
                (half, DVec2::new(own / aspect, 1.0))
            }
            _ => {
                let half = DVec2::new(own * half_height, own * half_height / aspect);
                (half, DVec2::new(1.0, aspect / own))
            }
        };
        ViewExtent {
            half,
            center: self.center,
            frame,
        }
    }

    /// Returns the ray of a place in a picture of an aspect ratio, without a lens. The upper left
    /// corner is 0 0, the lower right one is 1 1; places outside the picture have rays too.
    pub fn ray(&self, place: DVec2, aspect: f64) -> ViewRay {
        let view = DVec2::new(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y);
        let ViewExtent { half, center, .. } = self.view_extent(aspect);
        let at = view * half + center;
        let (origin, direction) = match self.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, at.extend(-1.0)),
            Projection::Orthographic { .. } => (at.extend(0.0), DVec3::NEG_Z),
        };
        ViewRay {
            origin: self.position + self.orientation * origin,
            direction: (self.orientation * direction).normalize(),
        }
    }

    /// Returns the ray through a point of the world.
    pub fn ray_through(&self, point: DVec3) -> ViewRay {
        let forward = self.direction();
        match self.projection {
            Projection::Perspective { .. } => ViewRay {
                origin: self.position,
                direction: (point - self.position).normalize_or(forward),
            },
            Projection::Orthographic { .. } => ViewRay {
                origin: point - forward * (point - self.position).dot(forward),
                direction: forward,
            },
        }
    }

    /// Returns the place in a picture of an aspect ratio at which a direction is seen, as
    /// [`Self::ray`] takes it. Returns `None` behind the viewer, and for parallel rays.
    pub fn place_of(&self, direction: DVec3, aspect: f64) -> Option<DVec2> {
        let seen = self.orientation.inverse() * direction;
        if seen.z >= 0.0 || matches!(self.projection, Projection::Orthographic { .. }) {
            return None;
        }
        let ViewExtent { half, center, .. } = self.view_extent(aspect);
        let at = (seen.truncate() / -seen.z - center) / half;
        Some(DVec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y))
    }
}

impl CameraPose {
    /// Returns the place in a picture of an aspect ratio at which a point of the world is seen, as
    /// [`Self::ray`] takes it. Returns `None` behind the viewer.
    pub fn place_of_point(&self, point: DVec3, aspect: f64) -> Option<DVec2> {
        if matches!(self.projection, Projection::Perspective { .. }) {
            return self.place_of(point - self.position, aspect);
        }
        let seen = self.orientation.inverse() * (point - self.position);
        let at = seen.truncate() / self.view_extent(aspect).half;
        Some(DVec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ray_of_a_place_is_seen_at_that_place() {
        let bounds = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(3.0, 1.0, 5.0));
        let side = super::super::ViewDirection::FRONT;
        for aspect in [0.5, 1.0, 1.5] {
            let pose = CameraPose::view_all_from(bounds, aspect, side);
            for place in [
                DVec2::new(0.1, 0.8),
                DVec2::splat(0.5),
                DVec2::new(1.2, -0.3),
            ] {
                let ray = pose.ray(place, aspect);
                let again = pose.place_of(ray.direction, aspect).expect("in front");
                assert!((again - place).length() < 1e-12, "{place} {again}");
                let of_point = pose.place_of_point(ray.at(7.0), aspect).expect("in front");
                assert!((of_point - place).length() < 1e-12, "{place} {of_point}");
                let through = pose.ray_through(ray.at(7.0));
                assert!((through.direction - ray.direction).length() < 1e-12);
            }
        }
    }

    #[test]
    fn the_upper_left_corner_of_the_default_view_is_where_the_standard_puts_it() {
        // An angle of π/4 on the shorter side, 10 m before the plane z = 0.
        let ray = CameraPose::default_viewpoint().ray(DVec2::ZERO, 1.5);
        let at = ray.at(-10.0 / ray.direction.z);
        let half = 10.0 * (std::f64::consts::PI / 8.0).tan();
        assert!(
            (at - DVec3::new(-1.5 * half, half, 0.0)).length() < 1e-5,
            "{at}"
        );
    }
}
