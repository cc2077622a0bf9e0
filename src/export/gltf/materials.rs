//! Maps Inventor's materials to glTF's.
//!
//! The diffuse color becomes the base color of a dielectric; `highlight` has the mapping of the
//! specular color and the shininess.

use std::collections::HashMap;

use glam::{Affine2, DMat2, Vec2};
use ivcam_render::scene::model::{self, Model, Texture, TextureModel};
use serde_json::{Map, Value, json};

use super::buffer::BinaryBuffer;
use super::schema::{
    Image, Index, Material, MetallicRoughness, Sampler, Texture as TextureEntry, TextureInfo,
};
use crate::export::appearance::Appearance;
use crate::export::color::{base_color, linear3};
use crate::export::highlight::{reflectance, roughness};

/// The reflectance at normal incidence of a dielectric with the index of refraction 1.5, which the
/// specular color of `KHR_materials_specular` multiplies.
const F0: f32 = 0.04;

/// The filters and the wrapping of textures (5.26).
const NEAREST: u32 = 9728;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;
const CLAMP_TO_EDGE: u32 = 33_071;
const REPEAT: u32 = 10_497;

/// How a primitive uses its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct MaterialUse {
    /// The material of the model.
    pub material: usize,
    /// Whether the mesh has colors.
    pub is_colorful: bool,
    /// Whether some color of the mesh is transparent.
    pub is_transparent: bool,
}

/// The entry of a material, and what a primitive must know about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaterialEntry {
    pub index: Index,
    /// Whether the colors of the mesh are written.
    pub keeps_colors: bool,
    /// The matrix that must be applied to texture coordinates, because the material cannot say it.
    pub matrix: Affine2,
}

/// The materials, textures and pictures of a file.
#[derive(Debug, Default)]
pub(super) struct Materials {
    pub materials: Vec<Material>,
    pub textures: Vec<TextureEntry>,
    pub samplers: Vec<Sampler>,
    pub images: Vec<Image>,
    pub extensions: Vec<&'static str>,
    known: HashMap<MaterialUse, MaterialEntry>,
    /// The pictures of the model that are written as they are.
    shared: HashMap<usize, Index>,
}

impl Materials {
    /// Returns the entry of a material, which is added at its first use.
    pub(super) fn entry(
        &mut self,
        model: &Model,
        used: MaterialUse,
        buffer: &mut BinaryBuffer,
    ) -> MaterialEntry {
        if let Some(entry) = self.known.get(&used) {
            return *entry;
        }
        let material = &model.materials[used.material];
        let texture = material.texture.as_ref();
        let image = texture.map(|t| &model.images[t.image]);
        let look = Appearance::of(material, image, used.is_colorful);
        let keeps_colors = look.keeps_colors && used.is_colorful;
        let placed = texture.map(|texture| {
            let source = self.image(texture, &look, buffer);
            let (transform, matrix) = transform(texture.matrix);
            let index = self.texture(texture, source);
            let mut extensions = Map::new();
            if let Some(transform) = transform {
                extensions.insert(self.extension("KHR_texture_transform"), transform);
            }
            (TextureInfo { index, extensions }, matrix)
        });
        let (info, matrix) = placed.unzip();
        let color = if keeps_colors {
            [1.0; 3]
        } else {
            let color = look.color.clamp(glam::Vec3::ZERO, glam::Vec3::ONE);
            base_color(color.to_array(), material.diffuse_share())
        };
        let opacity = if keeps_colors { 1.0 } else { look.opacity };
        let mut extensions = Map::new();
        let mut emissive = [0.0; 3];
        if look.unlit {
            extensions.insert(self.extension("KHR_materials_unlit"), json!({}));
        } else {
            emissive = self.emissive(material, &mut extensions);
            if let Some(specular) = specular(material) {
                extensions.insert(self.extension("KHR_materials_specular"), specular);
            }
        }
        let is_lit_by_texture = texture.is_some_and(|t| t.model == TextureModel::Modulate);
        let glows = emissive != [0.0; 3];
        let picture = look.image.as_deref();
        let alpha_mode = if opacity < 1.0 || keeps_colors && used.is_transparent {
            Some("BLEND")
        } else {
            match picture {
                Some(image) if image.is_transparent() && image.is_cutout() => Some("MASK"),
                Some(image) if image.is_transparent() => Some("BLEND"),
                _ => None,
            }
        };
        self.materials.push(Material {
            emissive_texture: info.clone().filter(|_| glows && is_lit_by_texture),
            pbr_metallic_roughness: MetallicRoughness {
                base_color_factor: [color[0], color[1], color[2], opacity],
                base_color_texture: info,
                metallic_factor: material.physical.map_or(0.0, |own| own.metallic),
                roughness_factor: roughness(material),
            },
            emissive_factor: glows.then_some(emissive),
            alpha_mode,
            double_sided: material.double_sided,
            extensions,
        });
        let entry = MaterialEntry {
            index: self.materials.len() - 1,
            keeps_colors,
            matrix: matrix.unwrap_or(Affine2::IDENTITY),
        };
        self.known.insert(used, entry);
        entry
    }

    /// Notes that an extension is used, and returns its name.
    fn extension(&mut self, name: &'static str) -> String {
        if !self.extensions.contains(&name) {
            self.extensions.push(name);
        }
        name.to_owned()
    }

    /// Returns the emissive factor. What is above 1 becomes an emissive strength.
    fn emissive(
        &mut self,
        material: &model::Material,
        extensions: &mut Map<String, Value>,
    ) -> [f32; 3] {
        let light = linear3(material.emissive.max(glam::Vec3::ZERO));
        let most = light.into_iter().fold(0.0, f32::max);
        if !most.is_finite() {
            return [0.0; 3];
        }
        if most <= 1.0 {
            return light;
        }
        let strength = json!({ "emissiveStrength": most });
        extensions.insert(self.extension("KHR_materials_emissive_strength"), strength);
        light.map(|v| v / most)
    }

    /// Returns the entry of a texture's picture.
    fn image(
        &mut self,
        texture: &Texture,
        look: &Appearance<'_>,
        buffer: &mut BinaryBuffer,
    ) -> Index {
        let is_shared = matches!(look.image, Some(std::borrow::Cow::Borrowed(_)));
        if let Some(index) = self.shared.get(&texture.image).filter(|_| is_shared) {
            return *index;
        }
        let png = look.image.as_ref().map_or_else(Vec::new, |i| i.png());
        let buffer_view = buffer.view(&png, None);
        self.images.push(Image {
            buffer_view,
            mime_type: "image/png",
        });
        let index = self.images.len() - 1;
        if is_shared {
            self.shared.insert(texture.image, index);
        }
        index
    }

    /// Returns the entry of a texture with its sampler.
    fn texture(&mut self, texture: &Texture, source: Index) -> Index {
        let wrap = |repeats: bool| if repeats { REPEAT } else { CLAMP_TO_EDGE };
        let sampler = Sampler {
            mag_filter: if texture.smooth { LINEAR } else { NEAREST },
            min_filter: if texture.smooth {
                LINEAR_MIPMAP_LINEAR
            } else {
                NEAREST
            },
            wrap_s: wrap(texture.repeat[0]),
            wrap_t: wrap(texture.repeat[1]),
        };
        let sampler = position_of(&mut self.samplers, sampler);
        position_of(&mut self.textures, TextureEntry { sampler, source })
    }
}

/// Returns the index of an entry of a list, to which it is added unless it is there.
fn position_of<T: PartialEq>(list: &mut Vec<T>, entry: T) -> Index {
    let known = list.iter().position(|e| *e == entry);
    known.unwrap_or_else(|| {
        list.push(entry);
        list.len() - 1
    })
}

/// The specular color and factor of `KHR_materials_specular`, unless they are those without it.
fn specular(material: &model::Material) -> Option<Value> {
    let reflectance = reflectance(material);
    let strength = material.physical.map_or(1.0, |own| own.grazing);
    if reflectance == [F0; 3] && strength == 1.0 {
        return None;
    }
    if reflectance == [0.0; 3] || strength == 0.0 {
        return Some(json!({ "specularFactor": 0.0 }));
    }
    let mut specular = json!({
        "specularColorFactor": reflectance.map(|f| f / (F0 * strength)),
    });
    if strength != 1.0 {
        specular["specularFactor"] = json!(strength);
    }
    Some(specular)
}

/// Returns a texture's matrix as the extension `KHR_texture_transform`, and the matrix that remains
/// for the texture coordinates. Only scales and offsets become the extension, because programs
/// disagree about its rotation.
fn transform(matrix: Affine2) -> (Option<Value>, Affine2) {
    if matrix == Affine2::IDENTITY {
        return (None, Affine2::IDENTITY);
    }
    let m = DMat2::from_cols(
        matrix.matrix2.x_axis.as_dvec2(),
        matrix.matrix2.y_axis.as_dvec2(),
    );
    let turned = m.x_axis.y.abs().max(m.y_axis.x.abs());
    let size = m.x_axis.x.abs().max(m.y_axis.y.abs());
    if turned > 1e-6 * size || !matrix.is_finite() {
        return (None, matrix);
    }
    // The texture coordinates in the file are (s, 1 − t).
    let scale = Vec2::new(matrix.matrix2.x_axis.x, matrix.matrix2.y_axis.y);
    let offset = Vec2::new(matrix.translation.x, 1.0 - matrix.translation.y - scale.y);
    if !offset.is_finite() {
        return (None, matrix);
    }
    let value = json!({ "offset": offset.to_array(), "scale": scale.to_array() });
    (Some(value), Affine2::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The extension's matrix, applied to the coordinates in the file, gives the coordinates in the
    /// file of the transformed point.
    #[test]
    fn a_texture_transform_acts_the_same_way_on_flipped_coordinates() {
        let matrix =
            Affine2::from_scale_angle_translation(Vec2::new(2.0, -3.0), 0.0, Vec2::new(0.25, 0.5));
        let (Some(value), rest) = transform(matrix) else {
            panic!("a scale and an offset fit the extension");
        };
        assert_eq!(rest, Affine2::IDENTITY);
        let number = |key: &str, i: usize| value[key][i].as_f64().expect("a number") as f32;
        let at = Vec2::new(0.3, 0.8);
        let flip = |p: Vec2| Vec2::new(p.x, 1.0 - p.y);
        let file = flip(at);
        let seen = Vec2::new(
            number("scale", 0) * file.x + number("offset", 0),
            number("scale", 1) * file.y + number("offset", 1),
        );
        let expected = flip(matrix.transform_point2(at));
        assert!((seen - expected).length() < 1e-6, "{seen} {expected}");
        let (none, rest) = transform(Affine2::from_angle(0.3));
        assert!(none.is_none() && rest == Affine2::from_angle(0.3));
    }
}
