//! The strength of a light as VRML97 and X3D have it, in levels of a screen.

use glam::Vec3;
use ivcam_render::scene::model::{Feature, LightShape, SceneLight};

use crate::export::losses::Losses;
use crate::export::target::Target;

/// The distance from a light, as a fraction of the scene's radius, from which on its level is right
/// where its divisor is below 1.
const NEAREST: f64 = 0.01;

/// The strength of a light.
pub(super) struct LightLevels {
    /// The color, at most 1.
    pub color: Vec3,
    /// The intensity. X3D 4 has no upper limit, and VRML97 that of 1.
    pub intensity: f32,
    /// The constant, linear and quadratic coefficient of the divisor, which is at least 1 in both
    /// formats (VRML97, 6.32).
    pub attenuation: Vec3,
}

impl LightLevels {
    /// Returns the strength of a light in a scene of a radius in meters. A color above 1 and a
    /// divisor below 1, which Inventor has, become a larger intensity. `losses` receives what
    /// VRML97 has no range for.
    pub(super) fn of(light: &SceneLight, radius: f64, target: Target, losses: &mut Losses) -> Self {
        let brightest = light.color.max_element().max(1.0);
        let intensity = light.intensity * brightest;
        let wanted = gain(light, radius);
        let gain = match target {
            Target::X3d => wanted,
            _ => wanted.min(1.0 / intensity).max(1.0),
        };
        if gain < wanted {
            let text = "the light is weaker near it, where it is stronger than 1";
            losses.add(Feature::LightFalloff.code(), text, light.place.clone(), 1);
        }
        if target != Target::X3d && intensity > 1.0 {
            let text = "the light is stronger than 1, to which a viewer may limit it";
            losses.add("light-range", text, light.place.clone(), 1);
        }
        let [quadratic, linear, constant] = (gain * light.attenuation).to_array();
        Self {
            color: light.color / brightest,
            intensity: gain * intensity,
            attenuation: Vec3::new(constant, linear, quadratic),
        }
    }
}

/// Returns the factor of intensity and divisor that makes the divisor at least 1.
fn gain(light: &SceneLight, radius: f64) -> f32 {
    let distance = NEAREST * radius;
    let [quadratic, linear, constant] = light.attenuation.as_dvec3().to_array();
    let divisor = (constant + distance * (linear + distance * quadratic)) as f32;
    let is_raised = light.shape != LightShape::Directional && light.least_divisor < 1.0;
    match is_raised && (1e-6..1.0).contains(&divisor) {
        true => 1.0 / divisor,
        false => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_inventor::iv::{Document, Limits, NoFiles};
    use ivcam_render::scene::model::{Model, ModelOptions};

    use super::*;
    use crate::export::{ExportOptions, convert};

    /// The light of a scene in a format, with the codes of what it loses.
    fn light(text: &str, target: Option<Target>) -> (SceneLight, Vec<String>) {
        let read = |text: &str| {
            let bytes = text.as_bytes().to_vec();
            Document::read("a", bytes, Arc::new(NoFiles), &Limits::default()).unwrap()
        };
        let mut document = read(text);
        let mut codes = Vec::new();
        if let Some(target) = target {
            let converted = convert(&document, target, &ExportOptions::default()).unwrap();
            codes.extend(converted.losses.iter().map(|loss| loss.code.clone()));
            document = read(&String::from_utf8(converted.bytes).unwrap());
        }
        let model = Model::at(&document, 0.0, &ModelOptions::default());
        (model.lights[0].clone(), codes)
    }

    #[test]
    fn lights_keep_their_levels_or_lose_them_with_a_word() {
        let inventor = |attenuation: &str, light: &str| {
            format!(
                "#Inventor V2.1 ascii\nEnvironment {{ ambientIntensity 0 attenuation {attenuation} }}
                 PointLight {{ location 0 0 3 {light} }} Cube {{ }}"
            )
        };
        for (attenuation, fields, of_vrml97) in [
            ("0.01 0.1 0.5", "", &["light-falloff"][..]),
            ("0.01 0.1 0.5", "intensity 0.5", &[]),
            ("0 0.5 0", "intensity 0.25", &["light-falloff"]),
            ("0 0 1", "color 3 2 0.5 intensity 0.25", &[]),
            ("0 0 1", "color 3 2 0.5", &["light-range"]),
        ] {
            let text = inventor(attenuation, fields);
            let (original, _) = light(&text, None);
            for (target, expected) in [(Target::X3d, &[][..]), (Target::Vrml97, of_vrml97)] {
                let (written, codes) = light(&text, Some(target));
                assert_eq!(codes, expected, "{target:?}: {text}");
                assert!(written.color.max_element() <= 1.0);
                for distance in [0.1, 1.0, 10.0] {
                    let [a, b] = [&original, &written].map(|l| l.level_at(distance) * l.color);
                    let is_same = (a - b).abs().max_element() <= 1e-5 * a.max_element();
                    let is_lost = codes.contains(&"light-falloff".to_owned());
                    assert!(is_same || is_lost, "{target:?} at {distance}: {a} {b}");
                }
            }
        }
    }
}
