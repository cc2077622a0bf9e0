//! The surface of a shape that is being made into meshes: its material, its colors and its texture.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Affine2, Mat4, Vec2, Vec3, Vec4};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::memory::MemoryBudget;
use ivcam_inventor::iv::{NodeId, NodeRef};
use ivcam_inventor::traversal::state::{
    AlphaMode, State, TextureCoordinates, TextureElement, TextureModel,
};

use super::feature::Feature;
use super::image::Image;
use super::material::{Material, Physical, Texture};
use crate::scene::looks::{self, MaterialColors, TextureFiles};
use crate::scene::options::{ColorCoding, CompileOptions, TextureFilter};

/// The source of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TextureMapping {
    /// The coordinates of the corners.
    Stored,
    /// Linear functions of the position (x, y, z, 1) in object space.
    Linear { s: Vec4, t: Vec4 },
}

/// What the colors of a model's pictures mean: those of the file.
const COLORS: ColorCoding = ColorCoding::Levels;

/// A decoded texture with the number of its picture.
type DecodedImage = (Arc<looks::Texture>, usize);

/// The pictures of a model, each with the texture that it was made from.
#[derive(Debug)]
pub(super) struct Images {
    pub list: Vec<Image>,
    /// The texture of each node and the number of its picture, with the bits of the opacity below
    /// which it is transparent; `None` if it cannot be decoded.
    decoded: HashMap<(NodeId, u32), Option<DecodedImage>>,
    /// The textures by file.
    files: TextureFiles,
    /// The memory that the model may use, with what is in use.
    memory: MemoryBudget,
}

impl Images {
    /// Creates an empty list of pictures for a model with some options.
    pub(super) fn new(options: &CompileOptions) -> Self {
        Self {
            list: Vec::new(),
            decoded: HashMap::new(),
            files: TextureFiles::new(&options.texture_folders),
            memory: MemoryBudget::new(options.memory),
        }
    }

    /// Returns the texture of a node, which is decoded at the first use.
    pub(super) fn of_node(
        &mut self,
        element: &TextureElement<'_>,
        report: &mut dyn FnMut(Box<Diagnostic>),
    ) -> Option<(Arc<looks::Texture>, usize)> {
        let key = (element.node.id, element.alpha.least_opacity().to_bits());
        if !self.decoded.contains_key(&key) {
            let mut read = || -> Result<Option<(Arc<looks::Texture>, usize)>> {
                let read = (self.files).of_node(element.node, COLORS, &mut self.memory)?;
                let Some(texture) = read else {
                    return Ok(None);
                };
                let bytes = 4 * texture.width as u64 * texture.height as u64;
                self.memory.take("a picture of the model", bytes)?;
                let texture = match element.alpha {
                    AlphaMode::Blend => texture,
                    mode if texture.has_alpha() => Arc::new(texture.with_alpha(mode)),
                    _ => texture,
                };
                let image = Image::of(&texture);
                Ok(image.map(|image| (texture, self.add(image))))
            };
            let numbered = read().unwrap_or_else(|diagnostic| {
                report(diagnostic);
                None
            });
            std::mem::take(&mut self.files.notices)
                .into_iter()
                .for_each(&mut *report);
            self.decoded.insert(key, numbered);
        }
        self.decoded.get(&key)?.clone()
    }

    /// Returns the factors of roughness and metal that a texture of a physical material states.
    fn factors(
        &mut self,
        node: NodeRef<'_>,
        state: &State<'_>,
        report: &mut dyn FnMut(Box<Diagnostic>),
    ) -> Option<[f32; 2]> {
        let id = state.material.physical?.factors?;
        let node = node.document.node(id);
        let read = self.files.of_node(node, COLORS, &mut self.memory);
        let texture = read.unwrap_or_else(|diagnostic| {
            report(diagnostic);
            None
        });
        Some(texture?.metallic_roughness())
    }

    /// Returns the number of a picture, which is added unless the list has it.
    pub(super) fn add(&mut self, image: Image) -> usize {
        let known = self.list.iter().position(|i| *i == image);
        known.unwrap_or_else(|| {
            self.list.push(image);
            self.list.len() - 1
        })
    }
}

/// The surface of the current shape.
#[derive(Debug)]
pub(super) struct ModelSurface {
    pub material: Material,
    pub colors: MaterialColors,
    /// The texture as shapes see it, for its size and its depth.
    pub texture: Option<Arc<looks::Texture>>,
    pub mapping: TextureMapping,
}

impl ModelSurface {
    /// Returns the surface of a shape with a state, and the features that it cannot hold.
    pub(super) fn of(
        state: &State<'_>,
        images: &mut Images,
        report: &mut dyn FnMut(Box<Diagnostic>),
        node: NodeRef<'_>,
    ) -> (Self, Vec<Feature>) {
        let mut features = Vec::new();
        let state = &state.with_factors(images.factors(node, state, report));
        let m = &state.material;
        let own = MaterialColors::of(state);
        let opacity = 1.0 - own.transparency[0];
        let colors = own.into_seen(m.alpha);
        let element = state.texture.map(|element| TextureElement {
            alpha: element.alpha.under(opacity),
            ..element
        });
        let found = element
            .as_ref()
            .filter(|element| element.quality > 0.0)
            .and_then(|e| Some((e, images.of_node(e, report)?)));
        let mapping = mapping(&state.texture_coordinates);
        let lost = match &found {
            Some((_, (texture, _))) if texture.is_deep() => Some(Feature::DeepTexture),
            Some(_) if mapping.is_none() => Some(Feature::EnvironmentTexture),
            _ => None,
        };
        features.extend(lost);
        let is_drawn = |texture: &TextureElement<'_>| texture.quality > 0.0;
        let mut further = state
            .further_textures
            .iter()
            .filter_map(|u| u.texture.as_ref());
        features.extend(further.any(is_drawn).then_some(Feature::FurtherTexture));
        let found = found.filter(|_| lost.is_none());
        let diffuse = colors.diffuse[0];
        let light = state.environment.ambient;
        let ambient_light = if light.is_finite() { light } else { Vec3::ZERO };
        let ambient = m.ambient_intensity.map_or(m.ambient, |a| a * diffuse);
        let is_usual = match m.ambient_intensity {
            Some(intensity) => intensity == 0.2 || intensity == 0.0,
            None => (m.ambient * ambient_light).max_element() <= Material::USUAL_AMBIENT,
        };
        if !is_usual && !state.is_unlit() {
            features.push(Feature::AmbientColor);
        }
        let material = Material {
            ambient,
            ambient_light,
            diffuse,
            specular: m.specular,
            emissive: colors.emissive,
            shininess: m.shininess,
            transparency: colors.transparency[0],
            physical: m.physical.map(|own| Physical {
                metallic: own.metallic,
                roughness: own.roughness,
                dielectric: own.dielectric,
                grazing: own.grazing,
            }),
            unlit: state.is_unlit(),
            double_sided: !state.hints.culls(),
            texture: found.as_ref().map(|(element, (texture, image))| Texture {
                image: *image,
                model: element.model,
                blend_color: element.blend_color,
                repeat: [element.repeat_s, element.repeat_t],
                smooth: looks::usual_filter(element, texture) != TextureFilter::Nearest,
                matrix: flat(state.texture_matrix),
            }),
        };
        let surface = Self {
            material,
            colors,
            texture: found.map(|(_, (texture, _))| texture),
            mapping: mapping.unwrap_or(TextureMapping::Stored),
        };
        (surface, features)
    }

    /// Replaces the texture by rasterized text, without interpolation.
    pub(super) fn set_text(&mut self, text: looks::Texture, images: &mut Images) {
        let Some(image) = Image::of(&text) else {
            return;
        };
        self.material.texture = Some(Texture {
            image: images.add(image),
            model: TextureModel::Modulate,
            blend_color: Vec3::ZERO,
            repeat: [false; 2],
            smooth: false,
            matrix: Affine2::IDENTITY,
        });
        self.texture = Some(Arc::new(text));
        self.mapping = TextureMapping::Stored;
    }

    /// Whether corners have different colors.
    pub(super) fn is_colorful(&self) -> bool {
        self.colors.diffuse.len() > 1 || self.colors.transparency.len() > 1
    }

    /// The color and the opacity of a material. An index past the end gives the last one.
    pub(super) fn color(&self, material: u32) -> [f32; 4] {
        let at = |n: usize| (material as usize).min(n - 1);
        let color = self.colors.diffuse[at(self.colors.diffuse.len())];
        let transparency = self.colors.transparency[at(self.colors.transparency.len())];
        color.extend(1.0 - transparency).to_array()
    }

    /// The texture coordinates of a corner that has stored ones and a position in object space.
    pub(super) fn coordinates(&self, stored: Vec2, position: Vec3) -> Vec2 {
        match self.mapping {
            TextureMapping::Stored => stored,
            TextureMapping::Linear { s, t } => {
                let p = position.extend(1.0);
                Vec2::new(s.dot(p), t.dot(p))
            }
        }
    }
}

/// Returns the source of texture coordinates, or `None` if they depend on the camera.
fn mapping(coordinates: &TextureCoordinates<'_>) -> Option<TextureMapping> {
    match *coordinates {
        TextureCoordinates::Environment => None,
        TextureCoordinates::Plane { s, t } => Some(TextureMapping::Linear {
            s: s.extend(0.0),
            t: t.extend(0.0),
        }),
        TextureCoordinates::Object { s, t } => Some(TextureMapping::Linear { s, t }),
        _ => Some(TextureMapping::Stored),
    }
}

/// Returns the part of a texture matrix that acts on s and t.
fn flat(matrix: Mat4) -> Affine2 {
    Affine2::from_cols(
        matrix.x_axis.truncate().truncate(),
        matrix.y_axis.truncate().truncate(),
        matrix.w_axis.truncate().truncate(),
    )
}
