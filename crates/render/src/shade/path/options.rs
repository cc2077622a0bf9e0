//! The options of path tracing.

use std::sync::Arc;

use glam::Vec3;

use super::environment::EnvironmentLight;
use crate::scene::Light;

/// The options of model `i` that no other model has.
#[derive(Clone, Debug)]
pub struct PathOptions {
    /// The largest number of surfaces that scatter light on its way to the camera: 0 shows only
    /// what shines by itself, 1 only direct light. Default: no limit.
    pub max_depth: Option<u32>,
    /// The largest radiance of one path's indirect light. It darkens the picture. Default: no
    /// limit.
    pub clamp: Option<f32>,
    /// A factor of emissive colors. Default: 1.
    pub emission: f32,
    /// The radius of point and spot lights in meters. Default: 0.
    pub light_radius: f32,
    /// The angle across directional lights, in radians. Default: 0.
    pub sun_angle: f32,
    /// A picture of the light from far away. Default: none.
    pub environment: Option<Arc<EnvironmentLight>>,
    /// A sun, besides the lights of the scene. Default: none.
    pub sun: Option<Light>,
    /// Where the headlight shines from. Default: from the camera, in parallel.
    pub flash: Option<Flash>,
    /// Whether the background lights the scene, in place of the ambient light. Default: only if
    /// nothing else does.
    pub background_lights: bool,
}

/// A lamp beside the lens that is the headlight. It brings the irradiance of the headlight at any
/// distance, from its own direction, and throws shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flash {
    /// The center in the scene's coordinates, in meters.
    pub position: Vec3,
    /// The radius in meters. The flash is a disc that faces what it lights.
    pub radius: f32,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self {
            max_depth: None,
            clamp: None,
            emission: 1.0,
            light_radius: 0.0,
            sun_angle: 0.0,
            environment: None,
            sun: None,
            flash: None,
            background_lights: false,
        }
    }
}

/// The options of path tracing, with those that other models have too.
#[derive(Clone, Copy, Debug)]
pub(in crate::shade) struct PathSettings<'a> {
    pub own: &'a PathOptions,
    /// A light on the camera.
    pub headlight: Option<&'a Light>,
    /// The camera's backward direction.
    pub backward: Vec3,
    /// How far in front of the camera its rays start.
    pub start: f32,
    /// Whether lights at the camera cast shadows.
    pub shadows_at_eye: bool,
    /// The least fraction of light that a mirror reflects; `None` makes no surface a mirror.
    pub mirrors: Option<f32>,
}
