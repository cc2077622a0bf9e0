//! Evaluates engines that compose vectors, rotations and matrices from their parts, or decompose
//! them.
//!
//! Fields with several values are computed value by value. A shorter field repeats its last value.

use glam::{DQuat, DVec3, Mat4, Vec2, Vec3, Vec4};

use super::convert::rotation_of;
use super::lists::{at, at_or, run};
use super::matrix::{Parts, compose, decompose};
use super::outputs::Outputs;
use crate::grammar::value::{Rotation, Value};
use crate::grammar::{
    compose_matrix, compose_rotation, compose_rotation_from_to, compose_vec2f, compose_vec3f,
    compose_vec4f, decompose_matrix, decompose_rotation, decompose_vec2f, decompose_vec3f,
    decompose_vec4f, transform_vec3f,
};
use crate::iv::NodeRef;

pub(super) fn vec2(node: NodeRef<'_>) -> Outputs {
    let (x, y) = (node.get(compose_vec2f::X), node.get(compose_vec2f::Y));
    let make = |i| Vec2::new(at(x, i), at(y, i));
    vec![("vector", Value::Vec2s(run([x.len(), y.len()], make)))]
}

pub(super) fn vec3(node: NodeRef<'_>) -> Outputs {
    let fields = [compose_vec3f::X, compose_vec3f::Y, compose_vec3f::Z];
    let [x, y, z] = fields.map(|field| node.get(field));
    let make = |i| Vec3::new(at(x, i), at(y, i), at(z, i));
    let vectors = run([x.len(), y.len(), z.len()], make);
    vec![("vector", Value::Vec3s(vectors))]
}

pub(super) fn vec4(node: NodeRef<'_>) -> Outputs {
    let (x, y) = (node.get(compose_vec4f::X), node.get(compose_vec4f::Y));
    let (z, w) = (node.get(compose_vec4f::Z), node.get(compose_vec4f::W));
    let make = |i| Vec4::new(at(x, i), at(y, i), at(z, i), at(w, i));
    let vectors = run([x.len(), y.len(), z.len(), w.len()], make);
    vec![("vector", Value::Vec4s(vectors))]
}

pub(super) fn parts_of_vec2(node: NodeRef<'_>) -> Outputs {
    let v = node.get(decompose_vec2f::VECTOR);
    vec![("x", components(v, |v| v.x)), ("y", components(v, |v| v.y))]
}

pub(super) fn parts_of_vec3(node: NodeRef<'_>) -> Outputs {
    let v = node.get(decompose_vec3f::VECTOR);
    vec![
        ("x", components(v, |v| v.x)),
        ("y", components(v, |v| v.y)),
        ("z", components(v, |v| v.z)),
    ]
}

pub(super) fn parts_of_vec4(node: NodeRef<'_>) -> Outputs {
    let v = node.get(decompose_vec4f::VECTOR);
    vec![
        ("x", components(v, |v| v.x)),
        ("y", components(v, |v| v.y)),
        ("z", components(v, |v| v.z)),
        ("w", components(v, |v| v.w)),
    ]
}

fn components<T>(values: &[T], part: impl Fn(&T) -> f32) -> Value {
    Value::Floats(values.iter().map(part).collect())
}

pub(super) fn rotation(node: NodeRef<'_>) -> Outputs {
    let axis = node.get(compose_rotation::AXIS);
    let angle = node.get(compose_rotation::ANGLE);
    let make = |i| Rotation::new(at_or(axis, i, Vec3::Z), at(angle, i));
    let rotations = run([axis.len(), angle.len()], make);
    vec![("rotation", Value::Rotations(rotations))]
}

pub(super) fn rotation_from_to(node: NodeRef<'_>) -> Outputs {
    let from = node.get(compose_rotation_from_to::FROM);
    let to = node.get(compose_rotation_from_to::TO);
    let make = |i| from_to(at_or(from, i, Vec3::Z), at_or(to, i, Vec3::Z));
    let rotations = run([from.len(), to.len()], make);
    vec![("rotation", Value::Rotations(rotations))]
}

pub(super) fn parts_of_rotation(node: NodeRef<'_>) -> Outputs {
    let turns = node.get(decompose_rotation::ROTATION);
    let unit = |r: &Rotation| r.axis.try_normalize().unwrap_or(Vec3::Z);
    let angles = turns.iter().map(|r| r.angle).collect();
    vec![
        ("axis", Value::Vec3s(turns.iter().map(unit).collect())),
        ("angle", Value::Floats(angles)),
    ]
}

/// Returns the shortest rotation that takes one direction to another.
fn from_to(from: Vec3, to: Vec3) -> Rotation {
    let (a, b) = (
        from.as_dvec3().normalize_or_zero(),
        to.as_dvec3().normalize_or_zero(),
    );
    let axis = a.cross(b);
    let angle = libm::atan2(axis.length(), a.dot(b));
    let axis = axis.try_normalize().unwrap_or_else(|| {
        if a == DVec3::ZERO {
            DVec3::Z
        } else {
            a.any_orthonormal_vector()
        }
    });
    Rotation::new(axis.as_vec3(), angle as f32)
}

pub(super) fn matrix(node: NodeRef<'_>) -> Outputs {
    let translation = node.get(compose_matrix::TRANSLATION);
    let scale = node.get(compose_matrix::SCALE_FACTOR);
    let center = node.get(compose_matrix::CENTER);
    let rotation = node.get(compose_matrix::ROTATION);
    let along = node.get(compose_matrix::SCALE_ORIENTATION);
    let quat =
        |r: &[Rotation], i| -> DQuat { at_or(r, i, Rotation::IDENTITY).to_quat().as_dquat() };
    let make = |i| {
        let parts = Parts {
            translation: at(translation, i).as_dvec3(),
            rotation: quat(rotation, i),
            scale: at_or(scale, i, Vec3::ONE).as_dvec3(),
            scale_orientation: quat(along, i),
        };
        compose(&parts, at(center, i).as_dvec3()).as_mat4()
    };
    let lengths = [
        translation.len(),
        rotation.len(),
        scale.len(),
        along.len(),
        center.len(),
    ];
    vec![("matrix", Value::Matrices(run(lengths, make)))]
}

pub(super) fn parts_of_matrix(node: NodeRef<'_>) -> Outputs {
    let matrices = node.get(decompose_matrix::MATRIX);
    let center = node.get(decompose_matrix::CENTER);
    let parts: Vec<Parts> = matrices
        .iter()
        .enumerate()
        .map(|(i, m)| decompose(m.as_dmat4(), at(center, i).as_dvec3()))
        .collect();
    let vectors =
        |f: fn(&Parts) -> DVec3| Value::Vec3s(parts.iter().map(|p| f(p).as_vec3()).collect());
    let turns = |f: fn(&Parts) -> DQuat| {
        Value::Rotations(parts.iter().map(|p| rotation_of(f(p))).collect())
    };
    vec![
        ("translation", vectors(|p| p.translation)),
        ("rotation", turns(|p| p.rotation)),
        ("scaleFactor", vectors(|p| p.scale)),
        ("scaleOrientation", turns(|p| p.scale_orientation)),
    ]
}

pub(super) fn transformed(node: NodeRef<'_>) -> Outputs {
    let v = node.get(transform_vec3f::VECTOR);
    let m = node.get(transform_vec3f::MATRIX);
    let matrix = |i| at_or(m, i, Mat4::IDENTITY).as_dmat4();
    let lengths = [v.len(), m.len()];
    let point = |i| matrix(i).project_point3(at(v, i).as_dvec3()).as_vec3();
    let direction = |i| -> DVec3 { matrix(i).transform_vector3(at(v, i).as_dvec3()) };
    let unit = |i| direction(i).normalize_or_zero().as_vec3();
    vec![
        ("point", Value::Vec3s(run(lengths, point))),
        (
            "direction",
            Value::Vec3s(run(lengths, |i| direction(i).as_vec3())),
        ),
        ("normalDirection", Value::Vec3s(run(lengths, unit))),
    ]
}
