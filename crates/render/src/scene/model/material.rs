//! The material of a shape, in Inventor's terms.

use glam::{Affine2, Vec3};

use ivcam_inventor::traversal::state::PhysicalElement;
pub use ivcam_inventor::traversal::state::TextureModel;

use super::image::Image;

/// The material of a shape. Colors are those of the file, from 0 to 1, as a screen shows them.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The ambient color.
    pub ambient: Vec3,
    /// The ambient light of Inventor's environment that the surface is in, color times intensity.
    pub ambient_light: Vec3,
    /// The diffuse color. A mesh with colors replaces it.
    pub diffuse: Vec3,
    /// The specular color.
    pub specular: Vec3,
    /// The emissive color.
    pub emissive: Vec3,
    /// The specular exponent divided by 128.
    pub shininess: f32,
    /// The transparency from 0 to 1. A mesh with colors replaces it.
    pub transparency: f32,
    /// The physical material, if it is one. The other values are then those of Phong's model.
    pub physical: Option<Physical>,
    /// Whether the diffuse color is shown without lighting.
    pub unlit: bool,
    /// Whether the backs of faces are visible.
    pub double_sided: bool,
    /// The texture, if there is one.
    pub texture: Option<Texture>,
}

/// How a surface reflects light by X3D's `PhysicalMaterial`, which is glTF's model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physical {
    /// How much of a metal the surface is, from 0 to 1.
    pub metallic: f32,
    /// The roughness from 0 to 1, whose square is the α of GGX.
    pub roughness: f32,
    /// The reflectance at normal incidence of the part that is no metal, in linear light.
    pub dielectric: Vec3,
    /// The largest reflectance of that part at grazing angles, from 0 to 1.
    pub grazing: f32,
}

/// The texture of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The index of its picture in [`Model::images`].
    ///
    /// [`Model::images`]: super::Model::images
    pub image: usize,
    /// How the texture changes the color.
    pub model: TextureModel,
    /// The color for [`TextureModel::Blend`].
    pub blend_color: Vec3,
    /// Whether it repeats along its width and along its height; otherwise its edge is extended.
    pub repeat: [bool; 2],
    /// Whether it is interpolated between texels.
    pub smooth: bool,
    /// The matrix that is applied to texture coordinates.
    pub matrix: Affine2,
}

impl Texture {
    /// Whether the texture's color is shown in place of the material's, and not times it.
    pub fn replaces_color(&self, image: &Image) -> bool {
        match self.model {
            TextureModel::Diffuse => image.has_color(),
            TextureModel::Decal => !image.has_alpha(),
            TextureModel::Replace => true,
            _ => false,
        }
    }

    /// Whether the texture's alpha counts in place of the material's opacity, and not times it.
    pub fn replaces_opacity(&self, image: &Image) -> bool {
        matches!(self.model, TextureModel::Diffuse | TextureModel::Replace) && image.has_alpha()
    }
}

impl Material {
    /// The largest part of ambient light that formats without ambient light lose without a word:
    /// that of Inventor's defaults, 0.2 of 0.2.
    pub const USUAL_AMBIENT: f32 = 0.0401;

    /// The share of the base color in the diffuse color, in linear light: 1 unless it is a metal's.
    pub fn diffuse_share(&self) -> f32 {
        let metallic = self.physical.map_or(0.0, |own| own.metallic);
        PhysicalElement::diffuse_share(metallic)
    }

    /// The ambient light that the surface reflects.
    pub fn ambient_part(&self) -> Vec3 {
        self.ambient * self.ambient_light
    }

    /// Whether an ambient light, color times intensity, changes the surface by half a level of 255
    /// or more.
    pub fn reflects_ambient_light(&self, light: Vec3) -> bool {
        !self.unlit && (self.ambient * light).max_element() >= 0.5 / 255.0
    }

    /// The numbers of the material as bits, which are equal for equal materials.
    pub(super) fn key(&self) -> Vec<u32> {
        let mut key = Vec::with_capacity(32);
        let ambient = [self.ambient, self.ambient_light];
        let others = [self.diffuse, self.specular, self.emissive];
        for color in ambient.into_iter().chain(others) {
            key.extend(color.to_array().map(f32::to_bits));
        }
        key.extend([self.shininess, self.transparency].map(f32::to_bits));
        key.extend([self.unlit, self.double_sided].map(u32::from));
        if let Some(own) = self.physical {
            key.extend([own.metallic, own.roughness, own.grazing].map(f32::to_bits));
            key.extend(own.dielectric.to_array().map(f32::to_bits));
        }
        if let Some(texture) = &self.texture {
            key.push(texture.image as u32);
            key.push(texture.model as u32);
            key.extend(texture.blend_color.to_array().map(f32::to_bits));
            key.extend(texture.repeat.map(u32::from));
            key.push(u32::from(texture.smooth));
            key.extend(texture.matrix.to_cols_array().map(f32::to_bits));
        }
        key
    }
}
