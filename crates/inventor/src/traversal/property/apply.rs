//! Applies a property node to the state, by a table of classes.

use std::sync::OnceLock;

use glam::DMat4;

use super::environment::{clip_plane, environment, local_fog, shadow_style, x3d_clip_plane};
use super::geometry::{
    complexity, coordinate3, coordinate4, draw_style, font, font_style, normal, normal_binding,
    polygon_offset, profile, profile_coordinate2, profile_coordinate3, shape_hints,
    vertex_property,
};
use super::material::{base_color, light_model, material, material_binding, packed_color};
use super::texture;
use super::transform;
use crate::grammar::{CLASSES, Class, ClassId, class};
use crate::iv::NodeRef;
use crate::traversal::geo;
use crate::traversal::state::State;

/// How a property changes the state.
#[derive(Clone, Copy)]
enum PropertyAction {
    /// Sets elements of the state.
    Elements(for<'a> fn(&mut State<'a>, NodeRef<'a>)),
    /// Sets elements of texture unit 0. If another unit is current it does nothing, because only
    /// unit 0 is drawn.
    Texture(for<'a> fn(&mut State<'a>, NodeRef<'a>)),
    /// Multiplies the matrix.
    Matrix(fn(NodeRef<'_>) -> DMat4),
    /// Multiplies the matrix by one that depends on the time in seconds.
    Motion(fn(NodeRef<'_>, f64) -> DMat4),
}

use PropertyAction::{Elements, Matrix, Motion, Texture};

/// The actions by class. A class that is not listed has the action of its nearest listed base
/// class.
const ACTIONS: &[(ClassId, PropertyAction)] = &[
    (class::MATERIAL, Elements(material)),
    (class::BASE_COLOR, Elements(base_color)),
    (class::PACKED_COLOR, Elements(packed_color)),
    (class::MATERIAL_BINDING, Elements(material_binding)),
    (class::LIGHT_MODEL, Elements(light_model)),
    (class::NORMAL, Elements(normal)),
    (class::NORMAL_BINDING, Elements(normal_binding)),
    (class::COORDINATE3, Elements(coordinate3)),
    (class::COORDINATE4, Elements(coordinate4)),
    (class::GEO_ORIGIN, Elements(geo::origin)),
    (class::GEO_COORDINATE, Elements(geo::coordinate)),
    (class::VERTEX_PROPERTY, Elements(vertex_property)),
    (class::SHAPE_HINTS, Elements(shape_hints)),
    (class::COMPLEXITY, Elements(complexity)),
    (class::DRAW_STYLE, Elements(draw_style)),
    (class::POLYGON_OFFSET, Elements(polygon_offset)),
    (class::FONT, Elements(font)),
    (class::FONT_STYLE, Elements(font_style)),
    (class::PROFILE, Elements(profile)),
    (class::PROFILE_COORDINATE2, Elements(profile_coordinate2)),
    (class::PROFILE_COORDINATE3, Elements(profile_coordinate3)),
    (class::ENVIRONMENT, Elements(environment)),
    (class::LOCAL_FOG, Elements(local_fog)),
    (class::VRML97_LOCAL_FOG, Elements(local_fog)),
    (class::CLIP_PLANE, Elements(clip_plane)),
    (class::X3D_CLIP_PLANE, Elements(x3d_clip_plane)),
    (class::SHADOW_STYLE, Elements(shadow_style)),
    (class::TEXTURE_UNIT, Elements(texture::unit)),
    (class::TEXTURE2, Texture(texture::texture)),
    (class::TEXTURE3, Texture(texture::texture)),
    (class::TEXTURE2_TRANSFORM, Texture(texture::transform2)),
    (class::TEXTURE3_TRANSFORM, Texture(texture::transform3)),
    (class::TEXTURE_MATRIX_TRANSFORM, Texture(texture::matrix)),
    (class::TEXTURE_COORDINATE2, Texture(texture::coordinate2)),
    (class::TEXTURE_COORDINATE3, Texture(texture::coordinate3)),
    (class::TEXTURE_COORDINATE_BINDING, Texture(texture::binding)),
    (class::TEXTURE_COORDINATE_DEFAULT, Texture(texture::default)),
    (
        class::TEXTURE_COORDINATE_ENVIRONMENT,
        Texture(texture::environment),
    ),
    (class::TEXTURE_COORDINATE_PLANE, Texture(texture::plane)),
    (class::TEXTURE_COORDINATE_OBJECT, Texture(texture::object)),
    (class::TEXTURE_COORDINATE_SPHERE, Texture(texture::sphere)),
    (
        class::TEXTURE_COORDINATE_CYLINDER,
        Texture(texture::cylinder),
    ),
    (class::TEXTURE_COORDINATE_CUBE, Texture(texture::cube)),
    (class::TRANSFORM, Matrix(transform::inventor_transform)),
    (class::MATRIX_TRANSFORM, Matrix(transform::matrix_transform)),
    (class::TRANSLATION, Matrix(transform::translation)),
    (class::SCALE, Matrix(transform::scale)),
    (class::ROTATION, Matrix(transform::rotation)),
    (class::ROTATION_XYZ, Matrix(transform::rotation_xyz)),
    (class::ROTOR, Motion(transform::rotor)),
    (class::PENDULUM, Motion(transform::pendulum)),
    (class::SHUTTLE, Motion(transform::shuttle)),
    (class::RESET_TRANSFORM, Elements(transform::reset)),
    (class::UNITS, Elements(transform::units)),
    (class::ANTI_SQUISH, Elements(transform::anti_squish)),
    // This node scales the handles of draggers, which are drawn only if a snapshot adds them.
    (class::SURROUND_SCALE, Elements(|_, _| {})),
];

/// Applies a property node to the state, at a time in seconds. Returns whether the node's class has
/// an action.
pub(crate) fn apply<'a>(state: &mut State<'a>, node: NodeRef<'a>, time: f64) -> bool {
    let Some(action) = node.known_class().and_then(action_of) else {
        return false;
    };
    match action {
        Elements(set) => set(state, node),
        Texture(set) => state.in_unit(|state| set(state, node)),
        Matrix(matrix) => state.multiply(matrix(node)),
        Motion(matrix) => state.multiply(matrix(node, time)),
    }
    true
}

/// Returns the action of a class, from a table that is built once.
fn action_of(class: &Class) -> Option<PropertyAction> {
    static TABLE: OnceLock<Vec<Option<PropertyAction>>> = OnceLock::new();
    let listed = |class: &Class| ACTIONS.iter().find(|(id, _)| *id == class.id);
    let find = |class: &Class| class.lineage().find_map(listed).map(|(_, action)| *action);
    TABLE.get_or_init(|| CLASSES.iter().map(find).collect())[usize::from(class.id.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grammar::{Role, Treatment};

    #[test]
    fn every_property_of_the_catalogue_has_an_action() {
        for class in CLASSES {
            if class.role == Role::Property && class.treatment != Treatment::Abstract {
                assert!(action_of(class).is_some(), "{} has no action", class.name);
            }
        }
        for (id, _) in ACTIONS {
            assert_eq!(id.get().role, Role::Property, "{}", id.get().name);
        }
    }
}
