//! The lights, and what of VRML97's lighting Inventor does not have.

use glam::{DVec3, Vec3};
use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_render::scene::model::{Feature, LightShape, Model, SceneLight};

use crate::export::losses::Losses;
use crate::export::nodes::{NodeBuilder, vec3};

/// The attenuation of light that does not weaken, in the order of `Environment`.
const CONSTANT: Vec3 = Vec3::Z;

/// Writes the lights of a model.
pub(super) struct LightWriter<'w> {
    model: &'w Model,
    bounds: Option<(DVec3, DVec3)>,
    /// The attenuation of the last `Environment`.
    attenuation: Vec3,
    nodes: &'w mut NodeBuilder,
    losses: &'w mut Losses,
}

impl<'w> LightWriter<'w> {
    /// Creates a writer for the lights of a model, after an `Environment` without attenuation.
    pub(super) fn new(
        model: &'w Model,
        nodes: &'w mut NodeBuilder,
        losses: &'w mut Losses,
    ) -> Self {
        Self {
            model,
            bounds: model.bounds(),
            attenuation: CONSTANT,
            nodes,
            losses,
        }
    }

    /// Returns the node of a light, after an `Environment` if the attenuation changes.
    pub(super) fn light(&mut self, light: &SceneLight) -> Vec<NodeId> {
        self.report(light);
        let mut made = Vec::new();
        if light.shape != LightShape::Directional {
            made.extend(self.environment(attenuation(light)));
        }
        let mut fields = vec![
            ("color", Value::Vec3(light.color)),
            ("intensity", Value::Float(light.intensity)),
        ];
        if light.shape != LightShape::Point {
            fields.push(("direction", vec3(light.direction)));
        }
        if light.shape != LightShape::Directional {
            fields.push(("location", vec3(light.position)));
        }
        let class = match light.shape {
            LightShape::Directional => "DirectionalLight",
            LightShape::Point => "PointLight",
            LightShape::Spot { outer, .. } => {
                let cut_off = outer.clamp(0.0, std::f32::consts::FRAC_PI_2);
                fields.push(("cutOffAngle", Value::Float(cut_off)));
                fields.push(("dropOffRate", Value::Float(drop_off_rate(light.shape))));
                "SpotLight"
            }
        };
        let id = self.nodes.node(class, fields);
        self.nodes.name(id, &light.name);
        made.push(id);
        made
    }

    /// Returns an `Environment` with an attenuation, unless it is in force.
    fn environment(&mut self, attenuation: Vec3) -> Option<NodeId> {
        let changes = attenuation != self.attenuation;
        self.attenuation = attenuation;
        let mut fields = ambient_fields(self.model);
        fields.push(("attenuation", Value::Vec3(attenuation)));
        changes.then(|| self.nodes.node("Environment", fields))
    }

    /// Adds what a light loses.
    fn report(&mut self, light: &SceneLight) {
        let mut lost = |code: &str, text: &str, stated: bool| {
            let place = light.place.clone();
            self.losses.add_stated(code, text, place, (1, stated));
        };
        if light.ambient > 0.0 && light.shape != LightShape::Directional {
            lost(
                "light-ambient",
                "the light's ambient part is left out",
                true,
            );
        }
        if light.shape == LightShape::Directional {
            return;
        }
        if self.bounds.is_some_and(|bounds| ends_within(light, bounds)) {
            let text = "the light shines beyond its radius";
            lost("light-radius", text, light.states_radius);
        }
        if exceeds_full(light) {
            let text = "the light is brighter than full near its place";
            lost(Feature::LightFalloff.code(), text, true);
        }
        if let LightShape::Spot {
            inner,
            outer,
            exponent: None,
        } = light.shape
            && inner < outer
        {
            self.losses.feature(Feature::SpotFalloff, &light.place, 1);
        }
    }
}

/// Returns the fields of an `Environment` with the ambient light of VRML97's directional lights.
/// That of other lights depends on the place. Without these fields Inventor has some ambient light.
pub(super) fn ambient_fields(model: &Model) -> Vec<(&'static str, Value)> {
    let lights = model.lights.iter();
    let everywhere = lights.filter(|light| light.shape == LightShape::Directional);
    let ambient: Vec3 = everywhere.map(|light| light.ambient * light.color).sum();
    let level = ambient.max_element();
    let color = if level > 0.0 {
        ambient / level
    } else {
        Vec3::ONE
    };
    vec![
        ("ambientIntensity", Value::Float(level.clamp(0.0, 1.0))),
        ("ambientColor", Value::Vec3(color)),
    ]
}

/// Whether a part of a box is beyond a light's radius.
fn ends_within(light: &SceneLight, (min, max): (DVec3, DVec3)) -> bool {
    let farthest = (light.position - min)
        .abs()
        .max((light.position - max).abs());
    farthest.length() > f64::from(light.radius)
}

/// Whether Inventor's attenuation makes a light brighter than its intensity, where VRML97's divisor
/// is at least 1. Only lights of VRML97 have a finite radius.
fn exceeds_full(light: &SceneLight) -> bool {
    let a = light.attenuation;
    light.radius.is_finite() && a.z < 1.0 && (a.x != 0.0 || a.y != 0.0)
}

/// Returns the attenuation in the order of `Environment`. A divisor that is constant in VRML97 is
/// at least 1.
fn attenuation(light: &SceneLight) -> Vec3 {
    let a = light.attenuation;
    match a.x == 0.0 && a.y == 0.0 && light.radius.is_finite() {
        true => CONSTANT * a.z.max(1.0),
        false => a,
    }
}

/// Returns Inventor's `dropOffRate`, the exponent of the cosine divided by 128. For a beam of
/// VRML97 that falls off, both have half the intensity at the same angle.
fn drop_off_rate(shape: LightShape) -> f32 {
    let exponent = match shape {
        LightShape::Spot {
            exponent: Some(exponent),
            ..
        } => exponent,
        LightShape::Spot { inner, outer, .. } if inner < outer => {
            let half = 0.5 * (f64::from(inner) + f64::from(outer));
            let cosine = libm::cos(half.min(1.57));
            (libm::log(0.5) / libm::log(cosine).min(-1e-12)) as f32
        }
        _ => 0.0,
    };
    (exponent / 128.0).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beam_has_half_the_intensity_at_the_same_angle() {
        let beam = |inner, outer| LightShape::Spot {
            inner,
            outer,
            exponent: None,
        };
        let exponent = 128.0 * drop_off_rate(beam(0.2, 0.6));
        assert!((libm::powf(libm::cosf(0.4), exponent) - 0.5).abs() < 1e-5);
        assert_eq!(drop_off_rate(beam(1.5, 0.7)), 0.0);
        assert_eq!(drop_off_rate(beam(0.0, 0.01)), 1.0);
    }
}
