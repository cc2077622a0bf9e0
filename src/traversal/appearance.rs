//! VRML 97's `Shape`: an appearance, and the geometry that is drawn with it.

use glam::{Mat4, Vec3};

use super::frame::Frame;
use super::property;
use super::role::{self, Role};
use super::state::{self, State};
use super::visitor::Visitor;
use super::walk::Walk;
use crate::iv::{NodeRef, nodes_in};

impl<'a, V: Visitor<'a>> Walk<'a, '_, V> {
    pub(super) fn appearance(&mut self, node: NodeRef<'a>) {
        self.keep_state();
        self.stack.push(Frame::Geometry { shape: node });
        self.state.vrml97 = true;
    }

    /// VRML 97's Shape: the appearance replaces material and texture, then the geometry is drawn.
    pub(super) fn geometry(&mut self, shape: NodeRef<'a>) {
        appearance97(&mut self.state, shape.node_in("appearance"));
        for id in nodes_in(shape, "geometry") {
            let geometry = self.document.node(*id);
            self.visits += 1;
            let role = role::role(geometry);
            self.visitor.node(geometry, role);
            if role == Role::Shape {
                self.visitor.shape(geometry, &self.state);
            } else if role != Role::Kept {
                self.enter(geometry, role); // a PROTO's body
            }
        }
    }
}

/// A VRML 97 `Appearance`. No material: unlit white (the specification, 6.3 and 4.14).
fn appearance97<'a>(state: &mut State<'a>, appearance: Option<NodeRef<'a>>) {
    use state::{Diffuse, List, MaterialElement, TextureElement, TextureModel};
    let material = appearance.and_then(|a| a.node_in("material"));
    state.texture = None;
    state.texture_matrix = Mat4::IDENTITY;
    state.texture_coordinates = state::TextureCoordinates::Default;
    match material {
        None => {
            state.base_color = true;
            state.material = MaterialElement {
                diffuse: Diffuse::Colors(List::One(Vec3::ONE)),
                ..MaterialElement::DEFAULT
            };
        }
        Some(m) => {
            state.base_color = false;
            let color = |name: &str, default: Vec3| m.read::<Vec3>(name).unwrap_or(default);
            let number = |name: &str, default: f32| m.read::<f32>(name).unwrap_or(default);
            let diffuse = color("diffuseColor", Vec3::splat(0.8));
            state.material = MaterialElement {
                ambient: diffuse * number("ambientIntensity", 0.2),
                diffuse: Diffuse::Colors(List::One(diffuse)),
                specular: color("specularColor", Vec3::ZERO),
                emissive: color("emissiveColor", Vec3::ZERO),
                shininess: number("shininess", 0.2),
                transparency: List::One(number("transparency", 0.0)),
                refraction: 1.0,
            };
        }
    }
    let Some(appearance) = appearance else {
        return;
    };
    if let Some(texture) = appearance.node_in("texture") {
        state.texture = Some(TextureElement {
            node: texture,
            model: TextureModel::Modulate,
            blend_color: Vec3::ZERO,
            repeat_s: texture.read::<bool>("repeatS").unwrap_or(true),
            repeat_t: texture.read::<bool>("repeatT").unwrap_or(true),
            repeat_r: true,
            quality: 0.5,
        });
    }
    if let Some(transform) = appearance.node_in("textureTransform") {
        state.texture_matrix = texture_transform97(transform);
    }
}

/// VRML 97's texture transform: p' = −c S R c t applied to p, 6.47 of the specification.
fn texture_transform97(node: NodeRef<'_>) -> Mat4 {
    let pair = |name: &str, default: f32| {
        node.read::<glam::Vec2>(name)
            .unwrap_or(glam::Vec2::splat(default))
    };
    let center = pair("center", 0.0).extend(0.0);
    let turn = property::turn_z(node.read::<f32>("rotation").unwrap_or(0.0));
    Mat4::from_translation(-center)
        * Mat4::from_scale(pair("scale", 1.0).extend(1.0))
        * Mat4::from_quat(turn)
        * Mat4::from_translation(center + pair("translation", 0.0).extend(0.0))
}
