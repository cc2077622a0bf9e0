//! Transformations, which multiply the matrix of the nodes that follow.

use std::f64::consts::TAU;

use glam::{DMat3, DMat4, DVec3, Quat, Vec3};

use crate::grammar::value::Rotation;
use crate::grammar::{
    Field, anti_squish, matrix_transform, pendulum, reset_transform, rotation, rotation_xyz, rotor,
    scale, shuttle, transform, translation, units,
};
use crate::iv::NodeRef;
use crate::pose::{diagonal, quat, rotation_of};
use crate::traversal::state::State;

/// Returns the matrix of Inventor's `Transform`.
pub(super) fn inventor_transform(node: NodeRef<'_>) -> DMat4 {
    transform(node, transform::SCALE_FACTOR)
}

/// Returns the matrix of a `Transform` of Inventor or VRML97, which name the scale field
/// differently. It scales along the axes of `scaleOrientation`, rotates about the center, and
/// translates.
pub(in crate::traversal) fn transform(node: NodeRef<'_>, scale: Field<Vec3>) -> DMat4 {
    let vector = |field: Field<Vec3>| node.acting_or_default(field).as_dvec3();
    let turn = |field: Field<Rotation>| DMat4::from_quat(quat(node.acting_or_default(field)));
    let center = vector(transform::CENTER);
    let along = quat(node.acting_or_default(transform::SCALE_ORIENTATION));
    DMat4::from_translation(vector(transform::TRANSLATION) + center)
        * turn(transform::ROTATION)
        * DMat4::from_quat(along)
        * DMat4::from_scale(vector(scale))
        * DMat4::from_quat(along.conjugate())
        * DMat4::from_translation(-center)
}

/// Returns the matrix of a `MatrixTransform`, or the identity if it is not finite. Its last number
/// divides all coordinates, as in OpenGL.
pub(super) fn matrix_transform(node: NodeRef<'_>) -> DMat4 {
    let matrix = node.acting_or_default(matrix_transform::MATRIX).as_dmat4();
    let divided = matrix * matrix.w_axis.w.recip();
    if divided.is_finite() {
        divided
    } else if matrix.is_finite() {
        matrix
    } else {
        DMat4::IDENTITY
    }
}

/// Returns the matrix of a `Translation`.
pub(super) fn translation(node: NodeRef<'_>) -> DMat4 {
    DMat4::from_translation(node.acting_or_default(translation::TRANSLATION).as_dvec3())
}

/// Returns the matrix of a `Scale`.
pub(super) fn scale(node: NodeRef<'_>) -> DMat4 {
    DMat4::from_scale(node.acting_or_default(scale::SCALE_FACTOR).as_dvec3())
}

/// Returns the matrix of a `Rotation`.
pub(super) fn rotation(node: NodeRef<'_>) -> DMat4 {
    DMat4::from_quat(quat(node.acting_or_default(rotation::ROTATION)))
}

/// Returns the matrix of a `RotationXYZ`. Ignoring the axis has no effect, because no other axis is
/// in force (Coin).
pub(super) fn rotation_xyz(node: NodeRef<'_>) -> DMat4 {
    let axis = match node.get(rotation_xyz::AXIS) {
        rotation_xyz::AXIS_Y => Vec3::Y,
        rotation_xyz::AXIS_Z => Vec3::Z,
        _ => Vec3::X,
    };
    let angle = node.acting_or_default(rotation_xyz::ANGLE);
    DMat4::from_quat(quat(Rotation { axis, angle }))
}

/// Returns the matrix of a `Rotor`, which turns once in 1/speed seconds from the angle in the file.
pub(super) fn rotor(node: NodeRef<'_>, time: f64) -> DMat4 {
    let start = node.acting_or_default(rotor::ROTATION);
    let speed = f64::from(node.get(rotor::SPEED));
    let turned = if node.get(rotor::ON) {
        TAU * speed * time
    } else {
        0.0
    };
    let angle = start.angle + turned as f32;
    DMat4::from_quat(quat(Rotation { angle, ..start }))
}

/// Returns the matrix of a `Pendulum`, which swings back and forth in 1/speed seconds, slowly at
/// the ends. The ends are inputs of an engine, so their ignore flags have no effect.
pub(super) fn pendulum(node: NodeRef<'_>, time: f64) -> DMat4 {
    let speed = f64::from(node.get(pendulum::SPEED));
    let share = if node.get(pendulum::ON) {
        swing(speed * time)
    } else {
        0.0
    };
    let end = |field: Field<Rotation>| quat(node.get(field));
    let (a, b) = (end(pendulum::ROTATION0), end(pendulum::ROTATION1));
    DMat4::from_quat(a.slerp(b, share))
}

/// Returns the matrix of a `Shuttle`, which moves along a line as a [`pendulum`] turns.
pub(super) fn shuttle(node: NodeRef<'_>, time: f64) -> DMat4 {
    let speed = f64::from(node.get(shuttle::SPEED));
    let share = if node.get(shuttle::ON) {
        swing(speed * time)
    } else {
        0.0
    };
    let end = |field: Field<Vec3>| node.get(field).as_dvec3();
    let (a, b) = (end(shuttle::TRANSLATION0), end(shuttle::TRANSLATION1));
    DMat4::from_translation(a.lerp(b, share))
}

/// The position between the ends, from 0 to 1, after a number of cycles.
fn swing(cycles: f64) -> f64 {
    0.5 - 0.5 * libm::cos(std::f64::consts::TAU * cycles)
}

/// Applies a `ResetTransform`.
pub(super) fn reset<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    // If the field is ignored, nothing is reset.
    let what = node.acting(reset_transform::WHAT_TO_RESET).unwrap_or(0);
    if what & reset_transform::WHAT_TO_RESET_TRANSFORM != 0 {
        state.world_from_object = DMat4::IDENTITY;
    }
}

/// Applies a `Units`, relative to the unit in force.
pub(super) fn units<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let Some(unit) = meters(node.acting_or_default(units::UNITS)) else {
        return;
    };
    state.multiply(DMat4::from_scale(DVec3::splat(unit / state.unit)));
    state.unit = unit;
}

/// Returns the length of one of Inventor's units, in meters.
fn meters(unit: i32) -> Option<f64> {
    Some(match unit {
        units::UNITS_METERS => 1.0,
        units::UNITS_CENTIMETERS => 0.01,
        units::UNITS_MILLIMETERS => 0.001,
        units::UNITS_MICROMETERS | units::UNITS_MICRONS => 1e-6,
        units::UNITS_NANOMETERS => 1e-9,
        units::UNITS_ANGSTROMS => 1e-10,
        units::UNITS_KILOMETERS => 1000.0,
        units::UNITS_FEET => 0.3048,
        units::UNITS_INCHES => 0.0254,
        units::UNITS_POINTS => 0.0254 / 72.0,
        units::UNITS_YARDS => 0.9144,
        units::UNITS_MILES => 1609.344,
        units::UNITS_NAUTICAL_MILES => 1852.0,
        _ => return None,
    })
}

/// Applies an `AntiSquish`, which makes the scale in force the same along every axis. `X`, `Y` and
/// `Z` are the principal stretches near these axes, as in SGI's library and Coin.
pub(super) fn anti_squish<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let matrix = state.world_from_object;
    let turn = rotation_of(matrix);
    let stretch = DMat4::from_quat(turn.conjugate()) * matrix;
    let (principal, _) = diagonal(DMat3::from_mat4(stretch));
    let scale = match node.acting_or_default(anti_squish::SIZING) {
        anti_squish::SIZING_X => principal.x,
        anti_squish::SIZING_Y => principal.y,
        anti_squish::SIZING_Z => principal.z,
        anti_squish::SIZING_BIGGEST_DIMENSION => principal.max_element(),
        anti_squish::SIZING_SMALLEST_DIMENSION => principal.min_element(),
        anti_squish::SIZING_LONGEST_DIAGONAL => longest_diagonal(stretch),
        _ => principal.element_sum() / 3.0,
    };
    let origin = matrix.transform_point3(DVec3::ZERO);
    state.world_from_object = DMat4::from_translation(origin)
        * DMat4::from_quat(turn)
        * DMat4::from_scale(DVec3::splat(scale));
}

/// Returns the length of the longest of the four half diagonals (±1, ±1, ±1) after stretching. As
/// in Coin, it is not divided by the length √3 before stretching.
fn longest_diagonal(stretch: DMat4) -> f64 {
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let lengths = corners.map(|(y, z)| stretch.transform_vector3(DVec3::new(1.0, y, z)).length());
    lengths.into_iter().fold(0.0, f64::max)
}

/// Returns the rotation of the texture plane by an angle in radians.
pub(in crate::traversal) fn turn_z(angle: f32) -> Quat {
    let axis = Vec3::Z;
    Rotation { axis, angle }.to_quat()
}
