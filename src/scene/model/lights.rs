//! The lights and cameras of a model.

use glam::{DQuat, DVec3, Vec3};

use super::feature::Place;
use crate::pose::CameraPose;
use crate::traversal::state::{LightElement, LightKind};

/// The shape of a light. Angles are in radians from its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// All rays are parallel.
    Directional,
    /// The light shines from a point in all directions.
    Point,
    /// The light shines from a point into a cone.
    Spot {
        /// The angle up to which the intensity is full.
        inner: f32,
        /// The angle at the cone's edge.
        outer: f32,
        /// The exponent of the cosine by which Inventor's spot falls off inside the cone, or `None`
        /// for VRML97's, which falls linearly from the inner to the outer angle.
        exponent: Option<f32>,
    },
}

/// A light that is on, in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// The name after `DEF`, or the class.
    pub name: String,
    /// The light's node in the file.
    pub place: Place,
    /// The shape of the light.
    pub shape: LightShape,
    /// The color, which is multiplied by the intensity.
    pub color: Vec3,
    /// The intensity; 1 is full.
    pub intensity: f32,
    /// The position in meters.
    pub position: DVec3,
    /// The direction of the light or of its axis, of length 1.
    pub direction: DVec3,
    /// The quadratic, linear and constant coefficient of the attenuation 1 / (a₀d² + a₁d + a₂).
    pub attenuation: Vec3,
    /// The distance in meters at which the light ends; infinite for Inventor's lights.
    pub radius: f32,
}

/// A camera or viewpoint of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The name after `DEF`, the description of a viewpoint, or the class.
    pub name: String,
    /// The camera's node in the file.
    pub place: Place,
    /// Where it stands in world space, and how it projects.
    pub pose: CameraPose,
}

/// The place of a camera or of a light at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The position in meters.
    pub position: DVec3,
    /// The rotation from the camera's space to the world, or from −z to the light's direction.
    pub orientation: DQuat,
}

impl Light {
    /// Converts a light of the traversal.
    pub(super) fn of(light: &LightElement, name: String, place: Place) -> Self {
        let shape = match light.kind {
            LightKind::Directional => LightShape::Directional,
            LightKind::Point => LightShape::Point,
            LightKind::Spot { drop_off, cut_off } => {
                let exponent = 128.0 * drop_off.clamp(0.0, 1.0);
                LightShape::Spot {
                    inner: half_angle(exponent).min(cut_off),
                    outer: cut_off,
                    exponent: Some(exponent),
                }
            }
            LightKind::Beam {
                beam_width,
                cut_off,
            } => LightShape::Spot {
                inner: beam_width.min(cut_off),
                outer: cut_off,
                exponent: None,
            },
        };
        Self {
            name,
            place,
            shape,
            color: light.color,
            intensity: light.intensity,
            position: light.position,
            direction: light.direction,
            attenuation: light.attenuation,
            radius: light.radius,
        }
    }
}

impl Light {
    /// The level of white that the light gives a surface that faces it at a distance, in its cone.
    pub fn level_at(&self, distance: f64) -> f32 {
        if self.shape == LightShape::Directional {
            return self.intensity;
        }
        let [quadratic, linear, constant] = self.attenuation.as_dvec3().to_array();
        let divisor = constant + distance * (linear + distance * quadratic);
        let divisor = if divisor > 0.0 { divisor } else { 1.0 };
        (f64::from(self.intensity) / divisor) as f32
    }

    /// The rotation that turns −z to the light's direction.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_rotation_arc(DVec3::NEG_Z, self.direction)
    }
}

/// The angle at which the cosine to the power of an exponent is ½, or a right angle if it is
/// beyond.
fn half_angle(exponent: f32) -> f32 {
    if exponent <= 0.0 {
        return std::f32::consts::FRAC_PI_2;
    }
    libm::acosf(libm::powf(0.5, 1.0 / exponent))
}
