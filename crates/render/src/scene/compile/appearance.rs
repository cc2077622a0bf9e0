//! Compiles the surface of a shape: material, texture and lights.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec3, DVec4, Mat4, Vec3, Vec4};
use ivcam_inventor::iv::{NodeId, NodeRef};
use ivcam_inventor::traversal::state::{
    AlphaMode, DrawStyle, DrawStyleElement, Language, LightElement, State, TextureCoordinates,
    TextureElement, TextureModel,
};

use super::scene_builder::SceneBuilder;
use crate::scene::looks::{
    CornerNormals, FurtherTexture, Light, LightTree, Mapping, MaterialColors, PhysicalSurface,
    Repeat, Surface, Texture, TextureFiles, TextureUse, usual_filter,
};
use crate::scene::options::{ColorCoding, TextureFilter};

/// The lights and textures that shapes share.
#[derive(Debug, Default)]
pub(super) struct Shared {
    /// The sets of lights.
    pub lights: LightTree,
    /// The textures that were decoded, by node, the bits of the opacity below which they are
    /// transparent, and the meaning of their colors; `None` if that failed.
    pub decoded: HashMap<(NodeId, u32, ColorCoding), Option<Arc<Texture>>>,
    /// The textures by file.
    pub files: TextureFiles,
}

impl SceneBuilder {
    /// Returns the surface of a shape that begins.
    pub(super) fn surface(&mut self, node: NodeRef<'_>, state: &State<'_>) -> Surface {
        let state = &state.with_factors(self.factors(node, state));
        let m = &state.material;
        let of_file = self.options.colors;
        let colors = of_file.for_element(m.is_linear);
        let mut environment = state.environment;
        environment.fog_color = of_file.light(environment.fog_color);
        let far = self
            .options
            .camera
            .as_ref()
            .filter(|c| c.has_far && c.far > 0.0);
        if let (Some(camera), true) = (far, environment.visibility <= 0.0) {
            environment.visibility = camera.far as f32; // as SGI's reference page of `Environment`
        }
        let texture = state.texture.and_then(|element| {
            let coordinates = state.texture_coordinates;
            self.texture_use(element, colors, state.texture_matrix, coordinates)
        });
        let further_textures = self.further_textures(state);
        let mut material = MaterialColors::of(state);
        let further = further_textures.iter().map(|further| &further.texture);
        let has_alpha = texture.iter().chain(further).any(TextureUse::has_alpha);
        let alpha = match m.alpha {
            AlphaMode::Mask(_) if has_alpha || material.has_opacities() => m.alpha,
            _ => {
                material = material.into_seen(m.alpha);
                AlphaMode::Blend
            }
        };
        let origin = self.scene.origin;
        let compile = |light: &LightElement| Light::new(light, origin, of_file);
        let before = self.shared.lights.bytes();
        let lights = self.shared.lights.set(&state.lights, compile);
        self.memory.count(self.shared.lights.bytes() - before);
        let surface = Surface {
            class: node.known_class().map_or("", |c| c.name),
            ambient: colors.light(m.ambient),
            ambient_intensity: m.ambient_intensity,
            diffuse: material
                .diffuse
                .into_iter()
                .map(|c| colors.light(c))
                .collect(),
            specular: colors.light(m.specular),
            emissive: colors.light(material.emissive),
            shininess: m.shininess,
            transparency: material.transparency,
            alpha,
            refraction: m.refraction,
            physical: PhysicalSurface::of(m),
            base_color: state.is_unlit(),
            local_viewer: state.language == Language::Vrml97,
            two_sided: state.hints.two_sided(),
            culls: state.hints.culls(),
            counterclockwise: state.hints.counterclockwise(),
            layer: layer(&state.drawing),
            casts_shadow: state.casts_shadow,
            on_top: state.on_top,
            environment,
            lights,
            texture,
            further_textures,
            clip: state
                .clip_planes
                .iter()
                .map(|(n, d)| (n.as_vec3(), (d - n.dot(self.scene.origin)) as f32))
                .collect(),
            first: self.scene.triangles.len() as u32,
            normals: CornerNormals::default(),
            materials: Vec::new(),
            coordinates: Vec::new(),
            thirds: Vec::new(),
            center: Vec3::ZERO,
        };
        self.scene.census.transparent |= !surface.is_opaque();
        surface
    }

    /// Returns the textures of the units after the first.
    fn further_textures(&mut self, state: &State<'_>) -> Vec<FurtherTexture> {
        let colors = self.options.colors.for_element(state.material.is_linear);
        let units = state.further_textures.iter();
        units
            .filter_map(|unit| {
                let texture =
                    self.texture_use(unit.texture?, colors, unit.matrix, unit.coordinates)?;
                Some(FurtherTexture {
                    unit: unit.unit,
                    texture,
                    coordinates: Vec::new(),
                })
            })
            .collect()
    }

    /// Returns a texture of a shape with a meaning of its colors, which is decoded at its first
    /// use.
    fn texture_use(
        &mut self,
        element: TextureElement<'_>,
        colors: ColorCoding,
        matrix: Mat4,
        coordinates: TextureCoordinates<'_>,
    ) -> Option<TextureUse> {
        if !self.options.needs.textures {
            self.scene.census.textures_left_out += 1;
            return None;
        }
        if element.quality <= 0.0 {
            return None; // quality 0 turns textures off in Inventor
        }
        let alpha = match element.alpha {
            AlphaMode::Mask(_) => AlphaMode::Blend, // the surface compares the product of all opacities
            other => other,
        };
        let texture = self.decoded(element.node, alpha, colors)?;
        Some(TextureUse {
            model: element.model,
            blend_color: colors.light(element.blend_color),
            repeat: Repeat {
                s: element.repeat_s,
                t: element.repeat_t,
                r: element.repeat_r,
            },
            filter: self.filter(&element, &texture),
            texture,
            matrix,
            mapping: self.mapping(coordinates),
        })
    }

    /// Returns the texture of a node, which is decoded at its first use, with one meaning of its
    /// opacity and of its colors.
    fn decoded(
        &mut self,
        node: NodeRef<'_>,
        alpha: AlphaMode,
        colors: ColorCoding,
    ) -> Option<Arc<Texture>> {
        let key = (node.id, alpha.least_opacity().to_bits(), colors);
        if let Some(known) = self.shared.decoded.get(&key) {
            return known.clone();
        }
        let read = (self.shared.files).of_node(node, colors, &mut self.memory);
        let decoded = read.unwrap_or_else(|diagnostic| {
            self.reports.add(*diagnostic);
            None
        });
        let decoded = match decoded {
            Some(texture) if alpha != AlphaMode::Blend && texture.has_alpha() => {
                let taken = self.memory.take("a texture without alpha", texture.bytes());
                taken.is_ok().then(|| Arc::new(texture.with_alpha(alpha)))
            }
            decoded => decoded,
        };
        self.scene.census.textures += u64::from(decoded.is_some());
        self.shared.decoded.insert(key, decoded.clone());
        decoded
    }

    /// Returns the factors of roughness and metal of a physical material that a texture states: the
    /// means of their squares and of their values.
    fn factors(&mut self, node: NodeRef<'_>, state: &State<'_>) -> Option<[f32; 2]> {
        let id = state.material.physical?.factors?;
        if !self.options.needs.textures {
            return None;
        }
        let colors = self.options.colors.for_element(state.material.is_linear);
        let texture = self.decoded(node.document.node(id), AlphaMode::Opaque, colors)?;
        Some(texture.metallic_roughness())
    }

    /// Returns the filter of a texture.
    fn filter(&self, element: &TextureElement<'_>, texture: &Texture) -> TextureFilter {
        let usual = || usual_filter(element, texture);
        self.options.texture_filter.unwrap_or_else(usual)
    }

    /// Returns the source of texture coordinates.
    fn mapping(&self, coordinates: TextureCoordinates<'_>) -> Mapping {
        match coordinates {
            TextureCoordinates::Plane { s, t } => {
                let row = |v: Vec3| self.plane(v.as_dvec3().extend(0.0));
                Mapping::Plane {
                    s: row(s),
                    t: row(t),
                }
            }
            TextureCoordinates::Object { s, t } => Mapping::Plane {
                s: self.plane(s.as_dvec4()),
                t: self.plane(t.as_dvec4()),
            },
            TextureCoordinates::Environment => {
                let turn = self
                    .picture
                    .camera
                    .as_ref()
                    .map_or(glam::DQuat::IDENTITY, |c| c.orientation);
                Mapping::Environment {
                    right: (turn * DVec3::X).as_vec3(),
                    up: (turn * DVec3::Y).as_vec3(),
                }
            }
            _ => Mapping::Stored,
        }
    }

    /// Converts a linear function of object space to one of the scene.
    fn plane(&self, v: DVec4) -> Vec4 {
        let object = self.placement.scene_from_object.inverse();
        let normal = object.matrix3.transpose() * v.truncate();
        let distance = v.truncate().dot(object.translation) + v.w;
        normal.extend(distance).as_vec4()
    }

    /// Replaces the texture of the current shape by one that is not interpolated.
    pub(super) fn replace_texture(&mut self, texture: Texture) {
        self.spoiled |= self.is_recording;
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        surface.further_textures.clear();
        surface.texture = Some(TextureUse {
            texture: Arc::new(texture),
            model: TextureModel::Modulate,
            blend_color: Vec3::ZERO,
            repeat: Repeat::NONE,
            filter: TextureFilter::Nearest,
            matrix: Mat4::IDENTITY,
            mapping: Mapping::Stored,
        });
        self.shape.uses.coordinates = true;
        self.scene.census.transparent = true;
    }
}

/// Returns the layer of a shape: 0 if a polygon offset moves it back, 2 if it moves it forward,
/// else 1.
fn layer(drawing: &DrawStyleElement) -> u8 {
    let style = match drawing.style {
        DrawStyle::Filled => 1,
        DrawStyle::Lines => 2,
        DrawStyle::Points => 4,
        DrawStyle::Invisible => 0,
    };
    match drawing.offset {
        1 if drawing.offset_styles & style != 0 => 0,
        -1 if drawing.offset_styles & style != 0 => 2,
        _ => 1,
    }
}
