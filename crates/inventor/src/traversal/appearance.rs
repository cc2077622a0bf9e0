//! The VRML97 `Shape`, which draws a geometry with an appearance.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};

use super::frame::WalkFrame;
use super::property;
use super::role::{self, Role};
use super::state::{
    Diffuse, Language, List, MaterialElement, State, TextureCoordinates, TextureElement,
    TextureModel,
};
use super::visitor::Visitor;
use super::walk::Walk;
use crate::grammar::{
    Field, appearance, image_texture, texture_transform, vrml97_material, vrml97_shape,
};
use crate::iv::NodeRef;

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
    // A shape without a material is white and unlit (VRML97, 6.3 and 4.14).
    state.base_color = material.is_none();
    state.material = material.map_or(
        MaterialElement {
            diffuse: Diffuse::Colors(List::One(Vec3::ONE)),
            ..MaterialElement::DEFAULT
        },
        material_element,
    );
    state.texture = node(appearance::TEXTURE).map(|texture| TextureElement {
        node: texture,
        model: TextureModel::Diffuse,
        blend_color: Vec3::ZERO,
        repeat_s: texture.get(image_texture::REPEAT_S),
        repeat_t: texture.get(image_texture::REPEAT_T),
        repeat_r: true,
        quality: 0.5,
    });
    state.further_textures = Arc::default();
    state.texture_matrix =
        node(appearance::TEXTURE_TRANSFORM).map_or(Mat4::IDENTITY, texture_transform);
    state.texture_coordinates = TextureCoordinates::Default;
}

fn material_element(node: NodeRef<'_>) -> MaterialElement<'static> {
    let diffuse = node.get(vrml97_material::DIFFUSE_COLOR);
    MaterialElement {
        ambient_intensity: Some(node.get(vrml97_material::AMBIENT_INTENSITY)),
        ambient: MaterialElement::DEFAULT.ambient,
        diffuse: Diffuse::Colors(List::One(diffuse)),
        specular: node.get(vrml97_material::SPECULAR_COLOR),
        emissive: node.get(vrml97_material::EMISSIVE_COLOR),
        shininess: node.get(vrml97_material::SHININESS),
        transparency: List::One(node.get(vrml97_material::TRANSPARENCY)),
        refraction: 1.0,
    }
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
