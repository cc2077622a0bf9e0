//! Evaluates Inventor's interpolation engines, and interpolates between rotations.

use glam::DQuat;

use super::convert::rotation_of;
use super::lists::{at, at_or, run};
use super::outputs::Outputs;
use crate::grammar::value::{Rotation, Value};
use crate::grammar::{
    interpolate, interpolate_float, interpolate_rotation, interpolate_vec2f, interpolate_vec3f,
    interpolate_vec4f,
};
use crate::iv::NodeRef;

pub(super) fn floats(node: NodeRef<'_>) -> Outputs {
    let a = node.get(interpolate_float::INPUT0);
    let b = node.get(interpolate_float::INPUT1);
    let t = node.get(interpolate::ALPHA);
    let make = |i| at(a, i) + (at(b, i) - at(a, i)) * t;
    vec![("output", Value::Floats(run([a.len(), b.len()], make)))]
}

pub(super) fn vec2s(node: NodeRef<'_>) -> Outputs {
    let a = node.get(interpolate_vec2f::INPUT0);
    let b = node.get(interpolate_vec2f::INPUT1);
    let t = node.get(interpolate::ALPHA);
    let make = |i| at(a, i).lerp(at(b, i), t);
    vec![("output", Value::Vec2s(run([a.len(), b.len()], make)))]
}

pub(super) fn vec3s(node: NodeRef<'_>) -> Outputs {
    let a = node.get(interpolate_vec3f::INPUT0);
    let b = node.get(interpolate_vec3f::INPUT1);
    let t = node.get(interpolate::ALPHA);
    let make = |i| at(a, i).lerp(at(b, i), t);
    vec![("output", Value::Vec3s(run([a.len(), b.len()], make)))]
}

pub(super) fn vec4s(node: NodeRef<'_>) -> Outputs {
    let a = node.get(interpolate_vec4f::INPUT0);
    let b = node.get(interpolate_vec4f::INPUT1);
    let t = node.get(interpolate::ALPHA);
    let make = |i| at(a, i).lerp(at(b, i), t);
    vec![("output", Value::Vec4s(run([a.len(), b.len()], make)))]
}

pub(super) fn rotations(node: NodeRef<'_>) -> Outputs {
    let a = node.get(interpolate_rotation::INPUT0);
    let b = node.get(interpolate_rotation::INPUT1);
    let t = f64::from(node.get(interpolate::ALPHA));
    let identity = Rotation::IDENTITY;
    let make = |i| between(at_or(a, i, identity), at_or(b, i, identity), t);
    vec![("output", Value::Rotations(run([a.len(), b.len()], make)))]
}

/// Interpolates between two rotations along the shorter arc (slerp). `share` is from 0 to 1.
pub(super) fn between(a: Rotation, b: Rotation, share: f64) -> Rotation {
    let (a, mut b) = (a.to_quat().as_dquat(), b.to_quat().as_dquat());
    let mut cosine = a.dot(b);
    if cosine < 0.0 {
        (b, cosine) = (-b, -cosine);
    }
    let angle = libm::acos(cosine.min(1.0));
    let mixed = if angle < 1e-6 {
        a * (1.0 - share) + b * share
    } else {
        (a * libm::sin((1.0 - share) * angle) + b * libm::sin(share * angle))
            * (1.0 / libm::sin(angle))
    };
    rotation_of(if mixed.length_squared() > 0.0 {
        mixed.normalize()
    } else {
        DQuat::IDENTITY
    })
}
