//! Conversion of colors from a screen's values to linear light.

use glam::Vec3;
use ivcam_render::scene::ColorCoding;
use ivcam_render::scene::model::{LightShape, SceneLight};

/// Returns the linear light of a value from 0 to 1, by the curve of sRGB (IEC 61966-2-1). Values
/// outside continue the curve's ends.
pub(super) fn linear(value: f32) -> f32 {
    ColorCoding::Display.light_of(value)
}

/// Returns the illuminance of a light at a distance in meters: π if it lights white to white.
/// Levels are limited to 0 … 1e12, because the linear light of larger ones exceeds 32-bit numbers.
pub(super) fn illuminance(light: &SceneLight, distance: f64) -> f64 {
    let illuminance = match (light.linear, light.shape) {
        (true, LightShape::Directional) => f64::from(light.intensity),
        (true, _) => f64::from(light.intensity) / (distance * distance),
        (false, _) => f64::from(linear(light.level_at(distance).clamp(0.0, 1e12))),
    };
    std::f64::consts::PI * illuminance
}

/// Returns the linear color of a light, at most 1, and the factor of its intensity: what the color
/// is above 1. Levels are limited to 0 … 1000, so that the product is a 32-bit number.
pub(super) fn light_color(light: &SceneLight) -> ([f32; 3], f64) {
    let color = linear3(light.color.clamp(Vec3::ZERO, Vec3::splat(1000.0)));
    let most = color.into_iter().fold(1.0, f32::max);
    (color.map(|c| c / most), f64::from(most))
}

/// Returns the linear light of a color.
pub(super) fn linear3(color: Vec3) -> [f32; 3] {
    color.to_array().map(linear)
}

/// Returns the base color, in linear light, of a diffuse color with a share of it
/// ([`Material::diffuse_share`]). That of a metal is at most 1.
///
/// [`Material::diffuse_share`]: ivcam_render::scene::model::Material::diffuse_share
pub(super) fn base_color(diffuse: [f32; 3], share: f32) -> [f32; 3] {
    let most = if share < 1.0 { 1.0 } else { f32::INFINITY };
    diffuse.map(|c| (linear(c) / share).min(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_has_the_values_of_the_standard() {
        for (value, light) in [
            (0.0, 0.0),
            (0.04, 0.003_095_975),
            (0.5, 0.214_041_1),
            (1.0, 1.0),
        ] {
            assert!((linear(value) - light).abs() < 1e-6, "{value}");
        }
    }
}
