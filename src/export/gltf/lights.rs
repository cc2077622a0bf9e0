//! Maps lights to `KHR_lights_punctual`, and cameras to glTF's.
//!
//! A light of intensity 1 lights a white surface that faces it to white, as in Inventor: its
//! illuminance is π. Inventor multiplies what a screen shows, so an intensity is converted to
//! linear light as a color is: one of 0.5 makes white a gray of 0.5, which has a fifth of the
//! light. A light whose intensity Inventor does not reduce by the inverse square of the distance
//! gets the intensity that is right at the center of the scene.

use ivcam_inventor::pose::{Projection, ViewportMapping};
use ivcam_render::scene::model::{self, Feature, LightShape, SceneLight};
use serde_json::{Value, json};

use super::schema::{Camera, Orthographic, Perspective};
use crate::export::clipping::SceneSphere;
use crate::export::color;
use crate::export::losses::Losses;

/// Returns the entry of a light, and adds what it cannot say.
pub(super) fn light(light: &SceneLight, around: SceneSphere, losses: &mut Losses) -> Value {
    let (linear, factor) = color::light_color(light);
    let name = &light.name;
    if light.shape == LightShape::Directional {
        return json!({
            "name": name, "type": "directional", "color": linear,
            "intensity": factor * color::illuminance(light, 1.0),
        });
    }
    if !light.linear {
        let uses = (1, light.states_attenuation);
        losses.feature_stated(Feature::LightFalloff, &light.place, uses);
    }
    let distance = light.position.distance(around.center);
    let distance = distance.max(0.1 * around.radius);
    let candela = factor * color::illuminance(light, distance) * distance * distance;
    let mut value = json!({
        "name": name, "type": "point", "color": linear, "intensity": candela,
    });
    if light.radius.is_finite() && light.radius > 0.0 {
        value["range"] = json!(light.radius);
    }
    if let LightShape::Spot {
        inner,
        outer,
        exponent,
    } = light.shape
    {
        let falls = match exponent {
            Some(exponent) => exponent > 0.0,
            None => inner < outer && !light.linear,
        };
        if falls || outer > std::f32::consts::FRAC_PI_2 {
            losses.feature(Feature::SpotFalloff, &light.place, 1);
        }
        let outer = f64::from(outer).clamp(1e-3, std::f64::consts::FRAC_PI_2);
        let inner = f64::from(inner).clamp(0.0, 0.9999 * outer);
        value["type"] = json!("spot");
        value["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
    }
    value
}

/// Returns the entry of a camera with the distances of its near and far plane.
pub(super) fn camera(camera: &model::SceneCamera, [nearest, zfar]: [f64; 2]) -> Camera {
    let pose = &camera.pose;
    let name = camera.name.clone();
    match pose.projection {
        Projection::Perspective { height_angle } => Camera {
            name,
            kind: "perspective",
            perspective: Some(Perspective {
                aspect_ratio: match pose.viewport_mapping {
                    ViewportMapping::AdjustCamera => None,
                    _ => Some(pose.aspect_ratio).filter(|a| *a > 0.0),
                },
                yfov: height_angle.clamp(1e-4, 3.1),
                znear: nearest.max(1e-4 * zfar),
                zfar,
            }),
            orthographic: None,
        },
        Projection::Orthographic { height } => {
            let half = if height.abs() > 0.0 {
                0.5 * height.abs()
            } else {
                1.0
            };
            Camera {
                name,
                kind: "orthographic",
                perspective: None,
                orthographic: Some(Orthographic {
                    xmag: half * pose.view_aspect(),
                    ymag: half,
                    znear: nearest.max(0.0),
                    zfar,
                }),
            }
        }
    }
}
