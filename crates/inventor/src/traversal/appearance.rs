//! The VRML97 `Shape`, which draws a geometry with an appearance.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};

use super::frame::WalkFrame;
use super::property;
use super::role::{self, Role};
use super::state::{
    AlphaMode, Diffuse, Language, List, MaterialElement, PhysicalElement, State,
    TextureCoordinates, TextureElement, TextureModel,
};
use super::visitor::Visitor;
use super::walk::Walk;
use crate::grammar::value::Text;
use crate::grammar::{
    Field, appearance, class, image_texture, ior_material_extension, multi_texture,
    multi_texture_transform, physical_material, specular_material_extension, texture_properties,
    texture_transform, unlit_material, vrml97_material, vrml97_shape,
};
use crate::iv::{NodeRef, display_color};

impl<'a, V: Visitor<'a>> Walk<'a, '_, V> {
    /// Begins a `Shape`; [`Walk::geometry`] follows.
    pub(super) fn appearance(&mut self, node: NodeRef<'a>) {
        self.keep_state();
        self.stack.push(WalkFrame::Geometry { shape: node });
        self.state.language = Language::Vrml97;
    }

    /// Replaces material and texture by those of the appearance, then draws the geometry.
    pub(super) fn geometry(&mut self, shape: NodeRef<'a>) {
        set_appearance(&mut self.state, shape.get_node(vrml97_shape::APPEARANCE));
        let Some(geometry) = shape.get_node(vrml97_shape::GEOMETRY) else {
            return;
        };
        self.visits += 1;
        let role = role::role(geometry);
        self.visitor.node(geometry, role);
        match role {
            Role::Shape => self.visitor.shape(geometry, &self.state),
            Role::Kept | Role::Held => {}
            _ => self.enter_once(geometry, role), // the body of a prototype
        }
    }
}

fn set_appearance<'a>(state: &mut State<'a>, appearance: Option<NodeRef<'a>>) {
    let node = |field| appearance.and_then(|a| a.get_node(field));
    let material = node(appearance::MATERIAL);
    let is_unlit = material.is_some_and(|m| m.class_id() == Some(class::UNLIT_MATERIAL));
    // A shape without a material is white and unlit (VRML97, 6.3 and 4.14).
    state.base_color = material.is_none() || is_unlit;
    state.material = material.map_or(
        MaterialElement {
            diffuse: Diffuse::Colors(List::One(Vec3::ONE)),
            ..MaterialElement::DEFAULT
        },
        material_element,
    );
    let alpha = appearance.map_or(AlphaMode::Blend, alpha_mode);
    state.material.alpha = alpha;
    let is_named = |node: &NodeRef<'_>| node.data().name.is_some();
    let named = [material, appearance].into_iter().flatten().find(is_named);
    state.material_node = named.or(material);
    let own = material.and_then(texture_of_material);
    let texture = own.or_else(|| node(appearance::TEXTURE).map(first_texture));
    let multiplies = own.is_some() || appearance.is_some_and(multiplies);
    state.texture = texture.map(|texture| TextureElement {
        node: texture,
        model: match multiplies {
            true => TextureModel::Material,
            false => TextureModel::Diffuse,
        },
        blend_color: Vec3::ZERO,
        repeat_s: repeats(
            texture,
            image_texture::REPEAT_S,
            texture_properties::BOUNDARY_MODE_S,
        ),
        repeat_t: repeats(
            texture,
            image_texture::REPEAT_T,
            texture_properties::BOUNDARY_MODE_T,
        ),
        repeat_r: true,
        quality: 0.5,
        alpha,
    });
    state.further_textures = Arc::default();
    state.texture_matrix =
        node(appearance::TEXTURE_TRANSFORM).map_or(Mat4::IDENTITY, first_transform);
    state.texture_coordinates = TextureCoordinates::Default;
}

/// Returns whether a texture is repeated in a direction. A boundary mode that is stated takes the
/// place of `repeatS` or `repeatT`.
fn repeats(texture: NodeRef<'_>, repeat: Field<bool>, mode: Field<Text>) -> bool {
    let properties = texture.get_node(image_texture::TEXTURE_PROPERTIES);
    match properties.filter(|properties| properties.states(mode)) {
        Some(properties) => !properties.get(mode).starts_with("CLAMP"),
        None => texture.get(repeat),
    }
}

/// Returns whether textures of the file of a node multiply the color of a material.
fn multiplies(node: NodeRef<'_>) -> bool {
    node.document.multiplying.contains(&node.data().source)
}

/// Returns X3D 4's meaning of the opacity of an appearance.
fn alpha_mode(appearance: NodeRef<'_>) -> AlphaMode {
    match appearance.get(appearance::ALPHA_MODE) {
        "OPAQUE" => AlphaMode::Opaque,
        "MASK" => AlphaMode::Mask(appearance.get(appearance::ALPHA_CUTOFF)),
        _ => AlphaMode::Blend,
    }
}

/// Returns the texture of a material of X3D 4 that multiplies its color.
fn texture_of_material(material: NodeRef<'_>) -> Option<NodeRef<'_>> {
    let field = match material.class_id()? {
        class::VRML97_MATERIAL => vrml97_material::DIFFUSE_TEXTURE,
        class::PHYSICAL_MATERIAL => physical_material::BASE_TEXTURE,
        class::UNLIT_MATERIAL => unlit_material::EMISSIVE_TEXTURE,
        _ => return None,
    };
    material.get_node(field).map(first_texture)
}

/// Returns a texture, or the first of a `MultiTexture`.
pub fn first_texture(texture: NodeRef<'_>) -> NodeRef<'_> {
    let textures = texture.get_nodes(multi_texture::TEXTURE);
    match textures.first() {
        Some(&first) if texture.class_id() == Some(class::MULTI_TEXTURE) => {
            texture.document.node(first)
        }
        _ => texture,
    }
}

/// Returns the matrix of a texture transform, or of the first of a `MultiTextureTransform`.
fn first_transform(node: NodeRef<'_>) -> Mat4 {
    let list = node.get_nodes(multi_texture_transform::TEXTURE_TRANSFORM);
    match list.first() {
        Some(&first) if node.class_id() == Some(class::MULTI_TEXTURE_TRANSFORM) => {
            texture_transform(node.document.node(first))
        }
        _ => texture_transform(node),
    }
}

fn material_element(node: NodeRef<'_>) -> MaterialElement<'static> {
    match node.class_id() {
        Some(class::PHYSICAL_MATERIAL) => return physical_element(node),
        Some(class::UNLIT_MATERIAL) => {
            return MaterialElement {
                diffuse: Diffuse::Colors(List::One(node.get(unlit_material::EMISSIVE_COLOR))),
                transparency: List::One(node.get(unlit_material::TRANSPARENCY)),
                // Lines and points show the emissive color.
                emissive: display_color(node.get(unlit_material::EMISSIVE_COLOR)),
                is_linear: true,
                ..MaterialElement::DEFAULT
            };
        }
        _ => {}
    }
    let diffuse = node.get(vrml97_material::DIFFUSE_COLOR);
    MaterialElement {
        ambient_intensity: Some(node.get(vrml97_material::AMBIENT_INTENSITY)),
        diffuse: Diffuse::Colors(List::One(diffuse)),
        specular: node.get(vrml97_material::SPECULAR_COLOR),
        emissive: node.get(vrml97_material::EMISSIVE_COLOR),
        shininess: node.get(vrml97_material::SHININESS),
        transparency: List::One(node.get(vrml97_material::TRANSPARENCY)),
        ..MaterialElement::DEFAULT
    }
}

/// Returns a physical material, with Phong's values of its highlight.
fn physical_element(node: NodeRef<'_>) -> MaterialElement<'static> {
    let base = node.get(physical_material::BASE_COLOR);
    let metallic = unit(node.get(physical_material::METALLIC));
    let roughness = unit(node.get(physical_material::ROUGHNESS));
    let (dielectric, grazing) = dielectric(node);
    let emissive = match node.get_node(physical_material::EMISSIVE_TEXTURE) {
        // The factor of a texture that is not drawn says nothing.
        Some(_) => Vec3::ZERO,
        None => display_color(node.get(physical_material::EMISSIVE_COLOR)),
    };
    let factors = node.get_node(physical_material::METALLIC_ROUGHNESS_TEXTURE);
    let element = MaterialElement {
        ambient_intensity: Some(0.2),
        diffuse: Diffuse::Colors(List::One(base)),
        emissive,
        transparency: List::One(node.get(physical_material::TRANSPARENCY)),
        physical: Some(PhysicalElement {
            metallic,
            roughness,
            dielectric,
            grazing,
            factors: factors.map(|texture| texture.id),
        }),
        is_linear: true,
        ..MaterialElement::DEFAULT
    };
    element.with_factors(1.0, 1.0)
}

/// Limits a number to 0 … 1. Numbers that are not finite become 1.
fn unit(value: f32) -> f32 {
    match value.is_finite() {
        true => value.clamp(0.0, 1.0),
        false => 1.0,
    }
}

/// Returns the reflectance at normal incidence of the part of a physical material that is no metal,
/// and the largest at grazing angles: 0.04 and 1 without the extensions for it.
fn dielectric(node: NodeRef<'_>) -> (Vec3, f32) {
    let (mut reflectance, mut strength, mut color) = (0.04, 1.0, Vec3::ONE);
    for &id in node.get_nodes(physical_material::EXTENSIONS) {
        let extension = node.document.node(id);
        match extension.class_id() {
            Some(class::IOR_MATERIAL_EXTENSION) => {
                let index = extension.get(ior_material_extension::INDEX_OF_REFRACTION);
                let root = (index - 1.0) / (index + 1.0);
                reflectance = root * root;
            }
            Some(class::SPECULAR_MATERIAL_EXTENSION) => {
                strength = extension.get(specular_material_extension::SPECULAR_STRENGTH);
                color = extension.get(specular_material_extension::SPECULAR_COLOR);
            }
            _ => {}
        }
    }
    // As `KHR_materials_specular`: the strength dims what is at most 1.
    let whole = (reflectance * color).clamp(Vec3::ZERO, Vec3::ONE);
    let all = (strength * whole).clamp(Vec3::ZERO, Vec3::ONE);
    let all = match all.is_finite() {
        true => all,
        false => Vec3::splat(0.04),
    };
    (all, unit(strength))
}

/// Returns the matrix of a VRML97 `TextureTransform`: −c · S · R · c · t, applied to a column
/// vector (VRML97, 6.47).
fn texture_transform(node: NodeRef<'_>) -> Mat4 {
    let pair = |field: Field<Vec2>| node.get(field).extend(0.0);
    let center = pair(texture_transform::CENTER);
    let turn = property::turn_z(node.get(texture_transform::ROTATION));
    let scale = node.get(texture_transform::SCALE).extend(1.0);
    Mat4::from_translation(-center)
        * Mat4::from_scale(scale)
        * Mat4::from_quat(turn)
        * Mat4::from_translation(center + pair(texture_transform::TRANSLATION))
}
