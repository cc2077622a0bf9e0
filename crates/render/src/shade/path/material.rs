//! The material at a point: Inventor's values as emission and scattering.

use glam::Vec3;

use super::bsdf::{Reflectance, conserving};
use super::microfacets::Microfacets;
use super::options::PathSettings;
use crate::scene::{PhysicalSurface, PlainSurface, Point, Surface, sound_color};

/// The α of a physical material below which it is a mirror. A lobe of this α is a thousandth of a
/// radian wide.
const MIRROR_ALPHA: f32 = 1e-3;

/// The material at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScatteringMaterial {
    /// The radiance of the opaque part.
    pub emission: Vec3,
    /// The scattering of the opaque part; `None` if the shape is unlit.
    pub reflectance: Option<Reflectance>,
    /// Whether the layer is a mirror, whatever its microfacets.
    pub is_mirror: bool,
}

impl ScatteringMaterial {
    /// The radiance of the opaque part of a surface at a point.
    pub(super) fn emission_of(point: &Point<'_>, settings: &PathSettings<'_>) -> Vec3 {
        let surface = point.surface;
        if surface.base_color {
            return sound_color(point.textured(point.diffuse));
        }
        let emissive = point.textured(surface.emissive) - point.textured(Vec3::ZERO);
        sound_color(emissive * settings.own.emission)
    }

    /// The material of a point. A texture replaces or changes the diffuse color, the specular color
    /// and the emission by OpenGL's rules; what it paints over a surface is lit as the surface is.
    pub(super) fn of(point: &Point<'_>, settings: &PathSettings<'_>) -> Self {
        let surface = point.surface;
        let emission = Self::emission_of(point, settings);
        if surface.base_color {
            return Self {
                emission,
                reflectance: None,
                is_mirror: false,
            };
        }
        if let Some(physical) = surface.physical {
            let color = point.textured(point.diffuse);
            return Self {
                emission,
                reflectance: Some(physical_reflectance(physical, color)),
                is_mirror: physical.alpha < MIRROR_ALPHA,
            };
        }
        let black = point.textured(Vec3::ZERO);
        let linear = |color: Vec3| point.textured(color) - black;
        let mirror = surface.mirror();
        let is_mirror = settings
            .mirrors
            .is_some_and(|least| mirror.max_element() >= least && mirror != Vec3::ZERO);
        let specular = if is_mirror { mirror } else { surface.specular };
        let (diffuse, specular) = conserving(
            point.textured(point.diffuse).min(Vec3::ONE),
            linear(specular),
        );
        Self {
            emission,
            reflectance: Some(Reflectance {
                diffuse,
                specular,
                grazing: 1.0,
                facets: match is_mirror {
                    true => Microfacets { alpha: 0.0 },
                    false => Microfacets::of_exponent(surface.exponent()),
                },
            }),
            is_mirror,
        }
    }
}

/// The scattering of a physical material of a diffuse color. The matte part gets only the light
/// that the layer lets through, so the two need no scaling: what absorbs nothing sends back all
/// light.
fn physical_reflectance(physical: PhysicalSurface, color: Vec3) -> Reflectance {
    let (diffuse, specular) = physical.reflectances(color);
    let sound = |reflectance: Vec3| sound_color(reflectance).min(Vec3::ONE);
    Reflectance {
        diffuse: sound(diffuse),
        specular: sound(specular),
        grazing: physical.most_reflected(),
        facets: Microfacets {
            alpha: physical.alpha,
        },
    }
}

/// A surface, with its material if that is the same everywhere.
#[derive(Clone, Copy, Debug)]
pub(in crate::shade) struct PathSurface {
    /// What points of the surface need of it, and its material.
    pub(super) plain: Option<(PlainSurface, ScatteringMaterial)>,
}

impl PathSurface {
    pub(in crate::shade) fn of(surface: &Surface, settings: &PathSettings<'_>) -> Self {
        let plain = PlainSurface::of(surface).map(|plain| {
            let point = PlainSurface::any_point(surface);
            (plain, ScatteringMaterial::of(&point, settings))
        });
        Self { plain }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The default material of glTF, if it is no metal, absorbs nothing.
    #[test]
    fn a_white_physical_material_is_all_white_below_its_layer() {
        let white = PhysicalSurface {
            metallic: 0.0,
            alpha: 0.25,
            dielectric: Vec3::splat(0.04),
            grazing: 1.0,
        };
        let own = physical_reflectance(white, Vec3::ONE);
        assert_eq!([own.diffuse, own.specular], [Vec3::ONE, Vec3::splat(0.04)]);
    }
}
