//! Inventor's highlights in terms of microfacets.
//!
//! Inventor's highlight kₛ cosⁿ, where n is 128 times the shininess, becomes a GGX lobe of the same
//! width and height: α² = 2 / (n + 2) and F₀ = 4 α² kₛ.

use glam::Vec3;
use ivcam_render::scene::model::Material;

use super::color::linear3;

/// The exponent n of Inventor's highlight.
fn exponent(material: &Material) -> f32 {
    let shininess = material.shininess;
    if shininess.is_finite() {
        128.0 * shininess.clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// The perceptual roughness √α of a highlight, or that of a physical material.
pub(super) fn roughness(material: &Material) -> f32 {
    if let Some(own) = material.physical {
        return own.roughness;
    }
    libm::powf(2.0 / (exponent(material) + 2.0), 0.25)
}

/// The reflectance F₀ at normal incidence, at most 1, in linear light; of a physical material that
/// of its part that is no metal.
pub(super) fn reflectance(material: &Material) -> [f32; 3] {
    if let Some(own) = material.physical {
        return own.dielectric.to_array();
    }
    let color = material.specular.clamp(Vec3::ZERO, Vec3::ONE);
    let height = 8.0 / (exponent(material) + 2.0);
    linear3(color).map(|k| (height * k).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The GGX lobe D G F of a surface that is lit and seen along its normal, times π for a light
    /// that makes white of white.
    #[test]
    fn the_peak_of_the_highlight_is_the_specular_color() {
        let material = Material {
            ambient: Vec3::ZERO,
            ambient_light: Vec3::ZERO,
            diffuse: Vec3::ZERO,
            specular: Vec3::splat(0.5),
            emissive: Vec3::ZERO,
            shininess: 0.4,
            transparency: 0.0,
            physical: None,
            unlit: false,
            double_sided: false,
            texture: None,
        };
        let alpha = f64::from(roughness(&material)).powi(2);
        let density = 1.0 / (std::f64::consts::PI * alpha * alpha);
        let peak = density * f64::from(reflectance(&material)[0]) / 4.0 * std::f64::consts::PI;
        assert!(
            (peak - f64::from(linear3(material.specular)[0])).abs() < 1e-6,
            "{peak}"
        );
    }
}
