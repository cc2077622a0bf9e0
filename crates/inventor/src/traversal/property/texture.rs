//! Textures, their coordinates and their transforms.

use glam::{Mat4, Vec2};

use super::transform::{transform, turn_z};
use crate::grammar::value::Choice;
use crate::grammar::{
    Field, texture, texture_coordinate_binding, texture_coordinate_object,
    texture_coordinate_plane, texture_coordinate2, texture_coordinate3, texture_matrix_transform,
    texture_unit, texture2, texture2_transform, texture3, texture3_transform,
};
use crate::iv::NodeRef;
use crate::traversal::state::{
    AlphaMode, State, TextureCoordinates, TextureElement, TextureModel, Wrapping,
};

/// Applies a `TextureUnit`.
pub(super) fn unit<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.texture_unit = node.acting_or_default(texture_unit::UNIT);
}

/// Applies a `Texture2` or `Texture3`.
pub(super) fn texture<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let repeats = |field: Field<Choice>| node.acting(field) != Some(texture::WRAP_S_CLAMP);
    state.texture = Some(TextureElement {
        node,
        model: match node.acting(texture2::MODEL) {
            Some(texture2::MODEL_DECAL) => TextureModel::Decal,
            Some(texture2::MODEL_BLEND) => TextureModel::Blend,
            Some(texture2::MODEL_REPLACE) => TextureModel::Replace,
            _ => TextureModel::Modulate,
        },
        blend_color: node.acting_or_default(texture::BLEND_COLOR),
        repeat_s: repeats(texture::WRAP_S),
        repeat_t: repeats(texture::WRAP_T),
        repeat_r: repeats(texture3::WRAP_R),
        alpha: AlphaMode::Blend,
        quality: state.complexity.texture_quality,
    });
}

/// Applies a `Texture2Transform`: the matrix −c · S · R · c · t, for row vectors.
pub(super) fn transform2<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let pair = |field: Field<Vec2>| node.acting_or_default(field).extend(0.0);
    let center = pair(texture2_transform::CENTER);
    let scale = node.acting_or_default(texture2_transform::SCALE_FACTOR);
    let angle = node.acting_or_default(texture2_transform::ROTATION);
    let translation = pair(texture2_transform::TRANSLATION);
    state.texture_matrix *= Mat4::from_translation(translation + center)
        * Mat4::from_quat(turn_z(angle))
        * Mat4::from_scale(scale.extend(1.0))
        * Mat4::from_translation(-center);
}

/// Applies a `Texture3Transform`.
pub(super) fn transform3<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.texture_matrix *= transform(node, texture3_transform::SCALE_FACTOR).as_mat4();
}

/// Applies a `TextureMatrixTransform`.
pub(super) fn matrix<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.texture_matrix *= node.acting_or_default(texture_matrix_transform::MATRIX);
}

/// Applies a `TextureCoordinate2`; an empty one changes nothing.
pub(super) fn coordinate2<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let points = node.acting(texture_coordinate2::POINT);
    if let Some(p) = points.filter(|p| !p.is_empty()) {
        state.texture_coordinates = TextureCoordinates::Two(p);
    }
}

/// Applies a `TextureCoordinate3`; an empty one changes nothing.
pub(super) fn coordinate3<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let points = node.acting(texture_coordinate3::POINT);
    if let Some(p) = points.filter(|p| !p.is_empty()) {
        state.texture_coordinates = TextureCoordinates::Three(p);
    }
}

/// Applies a `TextureCoordinateBinding`.
pub(super) fn binding<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let value = node.acting(texture_coordinate_binding::VALUE);
    state.texture_indexed = value != Some(texture_coordinate_binding::VALUE_PER_VERTEX);
}

/// Applies a `TextureCoordinateDefault`.
pub(super) fn default<'a>(state: &mut State<'a>, _: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Default;
}

/// Applies a `TextureCoordinateEnvironment`.
pub(super) fn environment<'a>(state: &mut State<'a>, _: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Environment;
}

/// Applies a `TextureCoordinatePlane`.
pub(super) fn plane<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Plane {
        s: node.acting_or_default(texture_coordinate_plane::DIRECTION_S),
        t: node.acting_or_default(texture_coordinate_plane::DIRECTION_T),
    };
}

/// Applies a `TextureCoordinateObject`.
pub(super) fn object<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Object {
        s: node.acting_or_default(texture_coordinate_object::FACTOR_S),
        t: node.acting_or_default(texture_coordinate_object::FACTOR_T),
    };
}

/// Applies a `TextureCoordinateSphere`.
pub(super) fn sphere<'a>(state: &mut State<'a>, _: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Wrapped(Wrapping::Sphere);
}

/// Applies a `TextureCoordinateCylinder`.
pub(super) fn cylinder<'a>(state: &mut State<'a>, _: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Wrapped(Wrapping::Cylinder);
}

/// Applies a `TextureCoordinateCube`.
pub(super) fn cube<'a>(state: &mut State<'a>, _: NodeRef<'a>) {
    state.texture_coordinates = TextureCoordinates::Wrapped(Wrapping::Cube);
}
