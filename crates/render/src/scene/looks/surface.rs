//! The appearance of a shape, which has one surface.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use ivcam_inventor::traversal::state::{
    AlphaMode, EnvironmentElement, MaterialElement, PhysicalElement, TextureModel,
};

use super::texture::{Repeat, Texture};
use crate::scene::options::TextureFilter;

/// The source of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mapping {
    /// The coordinates of the corners, or those of the quadric.
    Stored,
    /// Linear functions of the position in the scene.
    Plane { s: Vec4, t: Vec4 },
    /// A sphere map, which shows the surroundings in a mirror ball. The fields are the camera's
    /// directions.
    Environment { right: Vec3, up: Vec3 },
}

/// A texture with the settings of a surface.
#[derive(Clone, Debug)]
pub struct TextureUse {
    /// The texture.
    pub(crate) texture: Arc<Texture>,
    /// How the texture changes the color.
    pub model: TextureModel,
    /// The color for [`TextureModel::Blend`].
    pub blend_color: Vec3,
    /// The coordinates along which it repeats.
    pub(crate) repeat: Repeat,
    /// How it is filtered.
    pub(crate) filter: TextureFilter,
    /// The matrix that is applied to texture coordinates.
    pub matrix: Mat4,
    /// The source of texture coordinates.
    pub mapping: Mapping,
}

/// The texture of a `TextureUnit` other than the first.
#[derive(Clone, Debug)]
pub(crate) struct FurtherTexture {
    /// The number of the unit.
    pub(crate) unit: i32,
    /// The texture.
    pub(crate) texture: TextureUse,
    /// Its texture coordinates at each triangle's corners; empty if it has those of the surface.
    pub(crate) coordinates: Vec<[Vec2; 3]>,
}

impl FurtherTexture {
    /// Whether it has coordinates at the corners of triangles.
    pub(crate) fn has_coordinates(&self) -> bool {
        self.texture.mapping == Mapping::Stored
    }
}

impl TextureUse {
    /// Whether the surface is transparent where the texture is.
    pub(crate) fn has_alpha(&self) -> bool {
        self.model != TextureModel::Decal && self.texture.has_alpha()
    }
}

/// Returns texture coordinates between those of a triangle's corners.
#[inline(always)]
pub(crate) fn between(corners: &[Vec2; 3], u: f32, v: f32) -> Vec2 {
    corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v
}

/// The normals of triangles' corners. Corners share normals, so each triangle has three indices, or
/// one where every triangle is part of a flat face. This takes a third or a ninth of the memory,
/// and writing memory limits the speed of compiling a large scene.
#[derive(Clone, Debug, Default)]
pub struct CornerNormals {
    list: Vec<Vec3>,
    /// The indices of each triangle's corners; empty if `flat` is not.
    corners: Vec<[u32; 3]>,
    /// The index of each triangle; empty if `corners` is not.
    flat: Vec<u32>,
}

impl CornerNormals {
    /// Whether no triangle has normals.
    pub(crate) fn is_empty(&self) -> bool {
        self.corners.is_empty() && self.flat.is_empty()
    }

    /// The normals of a triangle, or `None` if it has none.
    #[inline]
    pub(crate) fn get(&self, triangle: usize) -> Option<[Vec3; 3]> {
        if let Some(&n) = self.flat.get(triangle) {
            return Some([self.list[n as usize]; 3]);
        }
        let numbers = self.corners.get(triangle)?;
        Some(numbers.map(|n| self.list[n as usize]))
    }

    /// Reserves memory for further triangles, which are parts of flat faces or not, and returns
    /// whether the system has it.
    pub(in crate::scene) fn try_reserve(&mut self, triangles: usize, flat: bool) -> bool {
        match self.flat() {
            Some(list) if flat => list.try_reserve(triangles).is_ok(),
            _ => self.corners().try_reserve(triangles).is_ok(),
        }
    }

    /// Appends the normals of a triangle.
    pub(in crate::scene) fn push(&mut self, normals: [Vec3; 3]) {
        let numbers = normals.map(|normal| {
            // The corners of a flat face have the same normal.
            if self.list.last() != Some(&normal) {
                self.list.push(normal);
            }
            self.list.len() as u32 - 1
        });
        self.corners().push(numbers);
    }

    /// Appends a list of normals, and returns the index of its first one.
    pub(in crate::scene) fn append(&mut self, list: Vec<Vec3>) -> u32 {
        let first = self.list.len() as u32;
        if first == 0 {
            self.list = list;
        } else {
            self.list.extend_from_slice(&list);
        }
        first
    }

    /// The indices of the normals of each triangle.
    pub(in crate::scene) fn corners(&mut self) -> &mut Vec<[u32; 3]> {
        if !self.flat.is_empty() {
            self.corners = self.flat.iter().map(|&n| [n; 3]).collect();
            self.flat = Vec::new();
        }
        &mut self.corners
    }

    /// The index of the normal of each triangle, or `None` if some triangles have three.
    pub(in crate::scene) fn flat(&mut self) -> Option<&mut Vec<u32>> {
        self.corners.is_empty().then_some(&mut self.flat)
    }
}

/// The physical material of a surface, whose other values are those of Phong's model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PhysicalSurface {
    /// How much of a metal it is, from 0 to 1.
    pub(crate) metallic: f32,
    /// The α of GGX.
    pub(crate) alpha: f32,
    /// The reflectance at normal incidence of the part that is no metal.
    pub(crate) dielectric: Vec3,
    /// The largest reflectance of that part at grazing angles, from 0 to 1.
    pub(crate) grazing: f32,
}

impl PhysicalSurface {
    /// The physical material of a shape's material.
    pub(crate) fn of(material: &MaterialElement<'_>) -> Option<Self> {
        material.physical.map(|own| Self {
            metallic: own.metallic,
            alpha: own.roughness * own.roughness,
            dielectric: own.dielectric,
            grazing: own.grazing,
        })
    }

    /// Returns the reflectances of the matte part and of the microfacets, from Phong's diffuse
    /// color of the surface.
    pub(crate) fn reflectances(self, diffuse: Vec3) -> (Vec3, Vec3) {
        let base = (diffuse / PhysicalElement::diffuse_share(self.metallic)).min(Vec3::ONE);
        let specular = self.dielectric.lerp(base, self.metallic);
        (base * (1.0 - self.metallic), specular)
    }

    /// The largest reflectance of the microfacets at grazing angles, which is 1 for a metal.
    pub(crate) fn most_reflected(self) -> f32 {
        1.0 - (1.0 - self.grazing) * (1.0 - self.metallic)
    }
}

/// The surface of a shape: values that all its primitives share, and lists of values by triangle.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The name of the shape's class.
    pub class: &'static str,
    /// The ambient color, unless `ambient_intensity` is set.
    pub ambient: Vec3,
    /// The ambient color as a fraction of the diffuse color of each point (VRML 97).
    pub ambient_intensity: Option<f32>,
    /// The diffuse colors, at least one.
    pub diffuse: Vec<Vec3>,
    /// The specular color.
    pub specular: Vec3,
    /// The emissive color.
    pub emissive: Vec3,
    /// The specular exponent divided by 128.
    pub shininess: f32,
    /// The transparencies from 0 to 1, at least one.
    pub transparency: Vec<f32>,
    /// What the opacity of a place means, which is that of the material and of the textures.
    pub alpha: AlphaMode,
    /// The index of refraction of the inside relative to the outside.
    pub refraction: f32,
    /// The physical material, if it is one.
    pub(crate) physical: Option<PhysicalSurface>,
    /// Whether the surface shows its diffuse color without lighting.
    pub base_color: bool,
    /// Whether a highlight depends on the viewer's position, as in VRML97, and not only on the
    /// direction of the view.
    pub local_viewer: bool,
    /// Whether both sides are lit.
    pub two_sided: bool,
    /// Whether back faces are invisible.
    pub culls: bool,
    /// Whether vertices run counterclockwise as seen from outside.
    pub counterclockwise: bool,
    /// The drawing layer. Of several primitives in the same plane, one of the highest layer is
    /// visible, and in one layer the one drawn last.
    pub layer: u8,
    /// Whether the surface casts shadows.
    pub casts_shadow: bool,
    /// Whether the surface is drawn over everything else, because it is below an `Annotation`.
    pub on_top: bool,
    /// Ambient light and fog.
    pub environment: EnvironmentElement,
    /// The number of its set of lights.
    pub lights: u32,
    /// The texture, if there is one.
    pub texture: Option<TextureUse>,
    /// The textures of further units, in their order.
    pub(crate) further_textures: Vec<FurtherTexture>,
    /// The clip planes, as normal and distance. Points with p·normal ≥ distance are visible.
    pub clip: Vec<(Vec3, f32)>,
    /// The number of the surface's first triangle.
    pub first: u32,
    /// The normals of each triangle's corners; empty if every face is flat.
    pub normals: CornerNormals,
    /// The material indices of each triangle's corners; empty if all are 0.
    pub materials: Vec<[u32; 3]>,
    /// The texture coordinates of each triangle's corners; empty without a texture.
    pub coordinates: Vec<[Vec2; 3]>,
    /// The texture coordinates r of each triangle's corners, for 3D textures only.
    pub thirds: Vec<[f32; 3]>,
    /// The center of its bounding box, by which transparent surfaces are sorted.
    pub center: Vec3,
}

impl Surface {
    /// Whether another surface without a texture and clip planes looks the same, whatever its
    /// triangles.
    pub(in crate::scene) fn has_look_of(&self, other: &Self) -> bool {
        let colors = |s: &Self| (s.ambient, s.ambient_intensity, s.specular, s.emissive);
        let numbers = |s: &Self| (s.shininess, s.refraction, s.environment, s.lights, s.layer);
        let opacity = |s: &Self| (s.transparency.clone(), s.alpha);
        let sides = |s: &Self| (s.two_sided, s.culls, s.counterclockwise);
        let kinds = |s: &Self| (s.class, s.base_color, s.casts_shadow, s.on_top);
        let is_plain = |s: &Self| s.textures().next().is_none() && s.clip.is_empty();
        is_plain(self)
            && is_plain(other)
            && colors(self) == colors(other)
            && numbers(self) == numbers(other)
            && sides(self) == sides(other)
            && kinds(self) == kinds(other)
            && self.physical == other.physical
            && self.diffuse == other.diffuse
            && opacity(self) == opacity(other)
    }

    /// The textures, in the order of their units.
    pub(crate) fn textures(&self) -> impl Iterator<Item = &TextureUse> {
        let further = self.further_textures.iter().map(|further| &further.texture);
        self.texture.iter().chain(further)
    }

    /// The diffuse color at an index. An index past the end gives the last one.
    pub(crate) fn diffuse_at(&self, index: u32) -> Vec3 {
        let last = self.diffuse.len() - 1;
        self.diffuse[(index as usize).min(last)]
    }

    /// The exponent of the cosine between normal and halfway vector, for highlights.
    pub(crate) fn exponent(&self) -> f32 {
        128.0 * self.shininess.clamp(0.0, 1.0)
    }

    /// The transparency at an index. An index past the end gives the last one.
    pub(crate) fn transparency_at(&self, index: u32) -> f32 {
        let last = self.transparency.len() - 1;
        self.transparency[(index as usize).min(last)]
    }

    /// The largest diffuse color that is not cut. Lit colors above 1 are cut after lighting, as in
    /// OpenGL, and unlit ones at once.
    pub(crate) fn diffuse_limit(&self) -> f32 {
        if self.base_color { 1.0 } else { f32::MAX }
    }

    /// The ambient color where the diffuse color is `diffuse`.
    pub(crate) fn ambient_at(&self, diffuse: Vec3) -> Vec3 {
        self.ambient_intensity.map_or(self.ambient, |a| a * diffuse)
    }

    /// The fraction of light that is reflected as by a mirror where the surface is opaque.
    pub(crate) fn mirror(&self) -> Vec3 {
        match self.base_color {
            true => Vec3::ZERO,
            false => self.specular * self.shininess.clamp(0.0, 1.0),
        }
    }

    /// The light without any light source, emissive and ambient, where the diffuse color is
    /// `diffuse`.
    pub(crate) fn glow(&self, diffuse: Vec3) -> Vec3 {
        self.emissive + self.ambient_at(diffuse) * self.environment.ambient
    }

    /// The diffuse color of a triangle, interpolated with the weights of a hit.
    #[inline(always)]
    pub(crate) fn diffuse_between(&self, triangle: usize, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.materials_of(triangle);
        let first = self.diffuse_at(a);
        if a == b && b == c {
            return first;
        }
        first * (1.0 - u - v) + self.diffuse_at(b) * u + self.diffuse_at(c) * v
    }

    /// The transparency of a triangle, interpolated with the weights of a hit.
    #[inline(always)]
    pub(crate) fn transparency_between(&self, triangle: usize, u: f32, v: f32) -> f32 {
        let [a, b, c] = self.materials_of(triangle);
        let first = self.transparency_at(a);
        if a == b && b == c {
            return first;
        }
        first * (1.0 - u - v) + self.transparency_at(b) * u + self.transparency_at(c) * v
    }

    /// The texture coordinates of a triangle, interpolated with the weights of a hit.
    #[inline(always)]
    pub(crate) fn coordinates_between(&self, triangle: usize, u: f32, v: f32) -> Vec3 {
        let weights = [1.0 - u - v, u, v];
        let plain = self
            .coordinates
            .get(triangle)
            .map_or(Vec2::ZERO, |c| between(c, u, v));
        let third = self.thirds.get(triangle).map_or(0.0, |c| {
            c[0] * weights[0] + c[1] * weights[1] + c[2] * weights[2]
        });
        plain.extend(third)
    }

    /// The fraction of light that the surface transmits toward others; NaN if it differs from place
    /// to place.
    pub(in crate::scene) fn transmittance(&self) -> f32 {
        let first = self.transparency_at(0);
        if !self.casts_shadow {
            1.0
        } else if !self.clip.is_empty()
            || self.textures().any(TextureUse::has_alpha)
            || self.transparency.iter().any(|t| *t != first)
        {
            f32::NAN
        } else {
            first
        }
    }

    /// Whether the surface is opaque everywhere.
    pub(crate) fn is_opaque(&self) -> bool {
        self.transparency.iter().all(|t| *t == 0.0) && !self.textures().any(TextureUse::has_alpha)
    }

    /// Whether the surface is the boundary of glass, which turns the light that it lets through.
    pub(crate) fn bends_light(&self) -> bool {
        self.refraction != 1.0 && !self.is_opaque()
    }

    /// The material indices of a triangle's corners.
    pub(crate) fn materials_of(&self, triangle: usize) -> [u32; 3] {
        self.materials.get(triangle).copied().unwrap_or([0; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_faces_keep_their_normals_when_others_follow() {
        let mut normals = CornerNormals::default();
        let first = normals.append(vec![Vec3::X, Vec3::Y]);
        normals
            .flat()
            .expect("no corners yet")
            .extend([first + 1, first]);
        let faces = [[Vec3::Y; 3], [Vec3::X; 3]];
        assert_eq!([0, 1].map(|i| normals.get(i)), faces.map(Some));
        assert_eq!(normals.get(2), None);

        let round = [Vec3::X, Vec3::Y, Vec3::Z];
        normals.push(round);
        assert!(normals.flat().is_none());
        assert_eq!([0, 1].map(|i| normals.get(i)), faces.map(Some));
        assert_eq!(normals.get(2), Some(round));
    }
}
