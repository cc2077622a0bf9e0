//! A camera without an aperture.

use glam::{DQuat, DVec2, DVec3};

use super::rays::CameraRay;
use crate::pose::{CameraPose, Projection, ViewportMapping};

/// A camera of no aperture: the scene's own, as Inventor renders it.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    pub(super) world_from_camera: DQuat,
    projection: Projection,
    /// Half the view's width and height at distance 1 (perspective) or anywhere (orthographic).
    half: DVec2,
    /// The part of the picture that is the view: −1 to 1 on each axis. Outside is black, where
    /// the camera crops the viewport.
    frame: DVec2,
    near: f64,
    pub(super) eye: DVec3,
}

impl Pinhole {
    /// Inventor's rules for a picture of another shape than the camera (`viewportMapping`):
    /// `ADJUST_CAMERA` keeps the whole height angle on the shorter side, the `CROP_` ones leave a
    /// part of the picture black, `LEAVE_ALONE` stretches.
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
