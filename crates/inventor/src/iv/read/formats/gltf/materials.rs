//! Materials and textures of glTF as X3D's `PhysicalMaterial`, `UnlitMaterial` and `ImageTexture`.

use std::collections::HashMap;

use glam::{Affine2, Mat2, Vec2, Vec3};
use ivcam_base::diag::{Result, Span};

use super::reader::GltfReader;
use super::schema::{Image, Material, TextureInfo};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    Field, NodeRefValue, appearance, class, image_texture, ior_material_extension,
    physical_material as physical, specular_material_extension, texture_properties, unlit_material,
};
use crate::iv::data_uri;

/// The nodes of materials and textures that were added.
#[derive(Default)]
pub(super) struct MaterialNodes {
    /// The appearances, by the material and whether it is for lines and points.
    appearances: HashMap<(Option<usize>, bool), NodeId>,
    textures: HashMap<usize, Option<NodeId>>,
}

/// How the texture of a material's color reads its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TexturePlace {
    /// The number of the set of coordinates.
    pub(super) set: usize,
    /// The transform of the coordinates, before they are turned upside down.
    pub(super) transform: Affine2,
}

impl TexturePlace {
    fn of(info: &TextureInfo) -> Self {
        let own = info.extensions.transform.clone().unwrap_or_default();
        // The rotation of `KHR_texture_transform` is counterclockwise as seen in a picture whose v
        // runs down.
        let (sin, cos) = (libm::sinf(own.rotation), libm::cosf(own.rotation));
        let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let matrix = rotation * Mat2::from_diagonal(Vec2::from_array(own.scale));
        Self {
            set: own.tex_coord.unwrap_or(info.tex_coord),
            transform: Affine2::from_mat2_translation(matrix, Vec2::from_array(own.offset)),
        }
    }

    /// Returns texture coordinates as X3D has them, whose t runs up.
    pub(super) fn apply(&self, at: Vec2) -> Vec2 {
        let at = self.transform.transform_point2(at);
        Vec2::new(at.x, 1.0 - at.y)
    }
}

impl GltfReader<'_, '_, '_> {
    /// Returns how the texture of a material's color reads its coordinates, if it has one.
    pub(super) fn texture_place(&self, material: Option<usize>) -> Option<TexturePlace> {
        let material = self.root.materials.get(material?)?;
        let info = material
            .pbr_metallic_roughness
            .base_color_texture
            .as_ref()?;
        Some(TexturePlace::of(info))
    }

    /// Returns the factor of the color of a material.
    pub(super) fn color_factor(&self, material: Option<usize>) -> [f32; 4] {
        let material = material.and_then(|index| self.root.materials.get(index));
        let mut factor = material.map_or([1.0; 4], |m| m.pbr_metallic_roughness.base_color_factor);
        factor[3] = match material {
            Some(material) => 1.0 - transparency(material),
            None => 1.0,
        };
        factor
    }

    /// Returns whether the backs of faces with a material are visible.
    pub(super) fn is_double_sided(&self, material: Option<usize>) -> bool {
        let material = material.and_then(|index| self.root.materials.get(index));
        material.is_some_and(|material| material.double_sided)
    }

    /// Returns whether a material is lit, as the one of primitives without a material is.
    pub(super) fn is_lit(&self, material: Option<usize>) -> bool {
        let material = material.and_then(|index| self.root.materials.get(index));
        material.is_none_or(|material| material.extensions.unlit.is_none())
    }

    /// Returns the appearance of faces, or of lines and points, with a material.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn appearance(&mut self, index: Option<usize>, is_face: bool) -> Result<NodeId> {
        let index = index.filter(|index| {
            let exists = *index < self.root.materials.len();
            if !exists {
                self.builder
                    .damage(Span::at(0), format!("the material {index} does not exist"));
            }
            exists
        });
        if let Some(&node) = self.materials.appearances.get(&(index, is_face)) {
            return Ok(node);
        }
        let usual = Material::default();
        let root = self.root;
        let material = index.map_or(&usual, |index| &root.materials[index]);
        let node = self.add_appearance(material, is_face)?;
        if is_face {
            self.builder.name(node, &material.name);
        }
        self.materials.appearances.insert((index, is_face), node);
        Ok(node)
    }

    fn add_appearance(&mut self, material: &Material, is_face: bool) -> Result<NodeId> {
        let node = self.builder.node(class::APPEARANCE, Span::default())?;
        let own = match material.extensions.unlit.is_some() || !is_face {
            true => self.unlit(material)?,
            false => self.physical(material)?,
        };
        self.builder
            .set(node, appearance::MATERIAL, Value::Node(Some(own)));
        let mode = match &*material.alpha_mode {
            "MASK" => "MASK",
            "BLEND" => "BLEND",
            _ => "OPAQUE",
        };
        self.builder
            .set(node, appearance::ALPHA_MODE, Value::String(mode.into()));
        if mode == "MASK" {
            let cutoff = Value::Float(material.alpha_cutoff.unwrap_or(0.5));
            self.builder.set(node, appearance::ALPHA_CUTOFF, cutoff);
        }
        Ok(node)
    }

    fn unlit(&mut self, material: &Material) -> Result<NodeId> {
        let node = self.builder.node(class::UNLIT_MATERIAL, Span::default())?;
        let factor = material.pbr_metallic_roughness.base_color_factor;
        let color = Value::Vec3(Vec3::from_slice(&factor[..3]));
        self.builder
            .set(node, unlit_material::EMISSIVE_COLOR, color);
        let transparency = Value::Float(transparency(material));
        self.builder
            .set(node, unlit_material::TRANSPARENCY, transparency);
        let texture = material.pbr_metallic_roughness.base_color_texture.as_ref();
        self.texture(node, unlit_material::EMISSIVE_TEXTURE, texture)?;
        Ok(node)
    }

    fn physical(&mut self, material: &Material) -> Result<NodeId> {
        let node = self
            .builder
            .node(class::PHYSICAL_MATERIAL, Span::default())?;
        let own = &material.pbr_metallic_roughness;
        let strength = material.extensions.emissive_strength.as_ref();
        let strength = strength.map_or(1.0, |extension| extension.emissive_strength);
        let emissive = Vec3::from_array(material.emissive_factor) * strength;
        let base = Vec3::from_slice(&own.base_color_factor[..3]);
        self.builder
            .set(node, physical::BASE_COLOR, Value::Vec3(base));
        self.builder
            .set(node, physical::EMISSIVE_COLOR, Value::Vec3(emissive));
        self.builder
            .set(node, physical::METALLIC, Value::Float(own.metallic_factor));
        self.builder.set(
            node,
            physical::ROUGHNESS,
            Value::Float(own.roughness_factor),
        );
        let transparency = Value::Float(transparency(material));
        self.builder.set(node, physical::TRANSPARENCY, transparency);
        for (field, texture) in [
            (physical::BASE_TEXTURE, &own.base_color_texture),
            (
                physical::METALLIC_ROUGHNESS_TEXTURE,
                &own.metallic_roughness_texture,
            ),
            (physical::NORMAL_TEXTURE, &material.normal_texture),
            (physical::OCCLUSION_TEXTURE, &material.occlusion_texture),
            (physical::EMISSIVE_TEXTURE, &material.emissive_texture),
        ] {
            self.texture(node, field, texture.as_ref())?;
        }
        let mut extensions = Vec::new();
        if let Some(specular) = &material.extensions.specular {
            let added = self
                .builder
                .node(class::SPECULAR_MATERIAL_EXTENSION, Span::default())?;
            let strength = Value::Float(specular.specular_factor);
            let color = Value::Vec3(Vec3::from_array(specular.specular_color_factor));
            self.builder.set(
                added,
                specular_material_extension::SPECULAR_STRENGTH,
                strength,
            );
            self.builder
                .set(added, specular_material_extension::SPECULAR_COLOR, color);
            extensions.push(added);
            if specular.specular_texture.is_some() || specular.specular_color_texture.is_some() {
                let message = "textures of `KHR_materials_specular` are not drawn";
                self.builder.warn(Span::at(0), message);
            }
        }
        if let Some(ior) = &material.extensions.ior {
            let added = self
                .builder
                .node(class::IOR_MATERIAL_EXTENSION, Span::default())?;
            let index = Value::Float(ior.ior);
            self.builder
                .set(added, ior_material_extension::INDEX_OF_REFRACTION, index);
            extensions.push(added);
        }
        if !extensions.is_empty() {
            self.builder
                .set(node, physical::EXTENSIONS, Value::Nodes(extensions));
        }
        Ok(node)
    }

    /// Sets a field of a material to a texture, if there is one.
    fn texture(
        &mut self,
        material: NodeId,
        field: Field<NodeRefValue>,
        info: Option<&TextureInfo>,
    ) -> Result<()> {
        let Some(info) = info else {
            return Ok(());
        };
        let node = match self.materials.textures.get(&info.index) {
            Some(&node) => node,
            None => {
                let node = self.add_texture(info.index)?;
                self.materials.textures.insert(info.index, node);
                node
            }
        };
        if node.is_some() {
            self.builder.set(material, field, Value::Node(node));
        }
        Ok(())
    }

    /// Adds the node of a texture, unless its picture is missing.
    fn add_texture(&mut self, index: usize) -> Result<Option<NodeId>> {
        let root = self.root;
        let texture = root.textures.get(index);
        let image = texture.and_then(|texture| root.images.get(texture.source?));
        let url = match image {
            Some(image) => self.url(image)?,
            None => Err(format!("the texture {index} has no picture that is read")),
        };
        let url = match url {
            Ok(url) => url,
            Err(message) => {
                let help = "surfaces are drawn without it";
                self.builder.damage(Span::at(0), message).help(help);
                return Ok(None);
            }
        };
        let urls = Value::Strings(vec![url]);
        let node = self.builder.with(
            class::IMAGE_TEXTURE,
            image_texture::URL,
            urls,
            Span::default(),
        )?;
        let sampler = texture.and_then(|texture| root.samplers.get(texture.sampler?));
        let Some(sampler) = sampler else {
            return Ok(Some(node));
        };
        for (wrap, field) in [
            (sampler.wrap_s, image_texture::REPEAT_S),
            (sampler.wrap_t, image_texture::REPEAT_T),
        ] {
            match wrap {
                Some(33071) => self.builder.set(node, field, Value::Bool(false)),
                Some(33648) => {
                    let message = "textures that are mirrored at each repetition are repeated as \
                                   they are";
                    self.builder.warn(Span::at(0), message);
                }
                _ => {}
            }
        }
        if sampler.mag_filter == Some(9728) {
            let nearest = Value::String("NEAREST_PIXEL".into());
            let filter = texture_properties::MAGNIFICATION_FILTER;
            let class = class::TEXTURE_PROPERTIES;
            let properties = self.builder.with(class, filter, nearest, Span::default())?;
            let properties = Value::Node(Some(properties));
            self.builder
                .set(node, image_texture::TEXTURE_PROPERTIES, properties);
        }
        Ok(Some(node))
    }

    /// Returns the URL of a picture. One in a buffer becomes a URI with its bytes.
    fn url(&mut self, image: &Image) -> Result<std::result::Result<String, String>> {
        if let Some(uri) = &image.uri {
            return Ok(Ok(match data_uri::is_data(uri) {
                true => uri.clone(),
                false => String::from_utf8_lossy(&data_uri::percent(uri.as_bytes())).into_owned(),
            }));
        }
        let Some(view) = image.buffer_view else {
            return Ok(Err("a picture has neither a URI nor a buffer view".into()));
        };
        let (bytes, _) = match self.buffers.view(self.root, view) {
            Ok(view) => view,
            Err(message) => return Ok(Err(message)),
        };
        self.builder.asm.spend_read(bytes.len(), 0)?;
        let kind = image.mime_type.as_deref().unwrap_or("image/png");
        Ok(Ok(data_uri::encoded(kind, bytes)))
    }
}

/// Returns the transparency of the factor of a material's color.
fn transparency(material: &Material) -> f32 {
    let alpha = material.pbr_metallic_roughness.base_color_factor[3];
    match &*material.alpha_mode {
        "BLEND" | "MASK" => 1.0 - alpha.clamp(0.0, 1.0),
        _ => 0.0,
    }
}
