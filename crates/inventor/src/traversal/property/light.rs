//! The lights of all languages, in world space.

use glam::{DVec3, Vec3};

use crate::grammar::{
    Class, Role, class, directional_light, light, metadata_boolean, point_light, spot_light,
    vrml_light, vrml97_point_light, vrml97_spot_light,
};
use crate::iv::{LINEAR_LIGHT, NodeRef};
use crate::traversal::state::{LightElement, LightKind, State};

/// How far a light shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::traversal) enum LightReach {
    /// On the shapes that follow it, up to the end of the separator: Inventor's lights.
    Following,
    /// On the siblings of the node and all that is below them, also on those before it: VRML97's
    /// `DirectionalLight` (4.6.6, 6.16), and lights of X3D whose field `global` is `FALSE`.
    Group,
    /// On the whole scene within its radius: VRML97's `PointLight` and `SpotLight` (4.6.6), and
    /// lights of X3D whose field `global` is `TRUE`.
    Scene,
}

/// Returns how far a node shines, or `None` if it is not a light.
pub(in crate::traversal) fn reach(node: NodeRef<'_>) -> Option<LightReach> {
    let class = node.known_class().filter(|c| c.role == Role::Light)?;
    Some(match class.id {
        _ if !class.is_vrml97() => LightReach::Following,
        _ if node.get(vrml_light::GLOBAL) => LightReach::Scene,
        _ => LightReach::Group,
    })
}

/// Returns a light in world space, or `None` if it is off.
pub(in crate::traversal) fn light<'a>(
    state: &State<'a>,
    node: NodeRef<'a>,
) -> Option<LightElement> {
    let class = node.known_class()?;
    if !node.get(light::ON) {
        return None;
    }
    let is_vrml97 = class.is_vrml97();
    let world = state.world_from_object;
    let direction = world.transform_vector3(node.get(directional_light::DIRECTION).as_dvec3());
    let mut light = LightElement {
        kind: kind(node, class),
        color: node.get(light::COLOR),
        intensity: node.get(light::INTENSITY),
        ambient: 0.0,
        position: world.transform_point3(node.get(point_light::LOCATION).as_dvec3()),
        direction: direction.try_normalize().unwrap_or(DVec3::NEG_Z),
        attenuation: state.environment.attenuation,
        least_divisor: 0.0,
        radius: f32::INFINITY,
        linear: false,
        node: node.id,
    };
    if is_vrml97 {
        // VRML97 has the constant, linear and quadratic coefficients in each light. Inventor has
        // them in the reverse order in the `Environment`.
        let a = node.get(vrml97_point_light::ATTENUATION);
        light.linear = node.get_node(vrml_light::METADATA).is_some_and(says_linear);
        // The distance is measured in the light's space (4.14.4, table 4.7), and scales act on the
        // radius (6.35). On a light of glTF they act by its position only (`KHR_lights_punctual`).
        let scale = libm::cbrt(world.determinant().abs()) as f32;
        let scale = if scale > 0.0 && !light.linear {
            scale
        } else {
            1.0
        };
        light.attenuation = Vec3::new(a.z / (scale * scale), a.y / scale, a.x);
        if light.linear
            && let LightKind::Beam {
                beam_width: inner,
                cut_off: outer,
            } = light.kind
        {
            light.kind = LightKind::Cone { inner, outer };
        }
        light.least_divisor = if light.linear { 0.0 } else { 1.0 };
        light.ambient = node.get(vrml97_point_light::AMBIENT_INTENSITY);
        light.radius = node.get(vrml97_point_light::RADIUS) * scale;
    }
    Some(light)
}

/// Whether a metadata node of a light says that its numbers are light ([`LINEAR_LIGHT`]).
fn says_linear(node: NodeRef<'_>) -> bool {
    let is_named = node.get(metadata_boolean::NAME) == LINEAR_LIGHT;
    is_named && node.class_id() == Some(class::METADATA_BOOLEAN) && {
        let value = node.get(metadata_boolean::VALUE);
        value.first().copied().unwrap_or(false)
    }
}

/// Returns the kind of a light, with its cone.
fn kind(node: NodeRef<'_>, class: &Class) -> LightKind {
    let is_either = |inventor, vrml97| class.descends_from(inventor) || class.id == vrml97;
    if is_either(class::DIRECTIONAL_LIGHT, class::VRML97_DIRECTIONAL_LIGHT) {
        LightKind::Directional
    } else if !is_either(class::SPOT_LIGHT, class::VRML97_SPOT_LIGHT) {
        LightKind::Point
    } else if class.is_vrml97() {
        LightKind::Beam {
            beam_width: node.get(vrml97_spot_light::BEAM_WIDTH),
            cut_off: node.get(vrml97_spot_light::CUT_OFF_ANGLE),
        }
    } else {
        LightKind::Spot {
            drop_off: node.get(spot_light::DROP_OFF_RATE),
            cut_off: node.get(spot_light::CUT_OFF_ANGLE),
        }
    }
}
