//! A camera without an aperture.

use glam::{DQuat, DVec2, DVec3};

use super::rays::CameraRay;
use crate::pose::{CameraPose, Projection, ViewportMapping};

/// A camera without an aperture: the scene's own camera, as Inventor renders it.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    pub(super) world_from_camera: DQuat,
    projection: Projection,
    /// Half of the view's width and height: at distance 1 for a perspective camera, at any distance
    /// for an orthographic one.
    half: DVec2,
    /// Half of the width and height of the view, where those of the picture are 1. The picture is
    /// black outside the view.
    frame: DVec2,
    /// The distance in meters at which the rays of an orthographic camera start.
    near: f64,
    pub(super) eye: DVec3,
}

impl Pinhole {
    /// The camera of a pose at the scene's origin, for a picture of an aspect ratio.
    ///
    /// If the aspect ratio is not that of the camera, Inventor's `viewportMapping` decides:
    /// `ADJUST_CAMERA` keeps the height angle on the shorter side, the `CROP_` values leave a part
    /// of the picture black, and `LEAVE_ALONE` stretches the picture.
    pub fn new(pose: &CameraPose, aspect: f64) -> Self {
        let half_height = match pose.projection {
            Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
            Projection::Orthographic { height } => 0.5 * height,
        };
        let own = if pose.aspect_ratio > 0.0 {
            pose.aspect_ratio
        } else {
            1.0
        };
        let (half, frame) = match pose.viewport_mapping {
            ViewportMapping::AdjustCamera => {
                let y = if aspect < 1.0 {
                    half_height / aspect
                } else {
                    half_height
                };
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
        let near = match pose.projection {
            Projection::Perspective { .. } => 0.0,
            Projection::Orthographic { .. } => pose.near,
        };
        Self {
            world_from_camera: pose.orientation,
            projection: pose.projection,
            half,
            frame,
            near,
            eye: DVec3::ZERO,
        }
    }

    /// The ray of a point of the picture from 0 to 1; none outside the view.
    pub(super) fn ray(&self, x: f64, y: f64) -> Option<CameraRay> {
        let view = DVec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y);
        if view.x.abs() > self.frame.x || view.y.abs() > self.frame.y {
            return None;
        }
        let at = view * self.half;
        let (origin, direction) = match self.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, DVec3::new(at.x, at.y, -1.0)),
            Projection::Orthographic { .. } => (at.extend(-self.near), DVec3::NEG_Z),
        };
        Some(CameraRay {
            origin: self.eye + self.world_from_camera * origin,
            direction: (self.world_from_camera * direction).normalize(),
            weight: 1.0,
        })
    }
}
