//! Converts values between field types, as Inventor's field converters do.

use std::fmt::Write;

use glam::{DMat4, DQuat, DVec3, Mat4, Vec2, Vec3, Vec4};

use super::matrix;
use crate::grammar::FieldType as F;
use crate::grammar::value::{Plane, Rotation};
use crate::iv::Value;

/// Converts a value to a type. A single value becomes a list of one, and a list gives its first
/// value. Returns `None` if there is no conversion.
pub fn to_type(value: &Value, kind: F) -> Option<Value> {
    if same_shape(value, kind) {
        return Some(value.clone());
    }
    match (value, kind) {
        (Value::Trigger, F::SFTrigger) => return Some(Value::Trigger),
        (_, F::SFTrigger) => return Some(Value::Trigger),
        (Value::Node(n), F::MFNode) => return Some(Value::Nodes(n.iter().copied().collect())),
        (Value::Nodes(n), F::SFNode | F::SFPath | F::SFEngine) => {
            return Some(Value::Node(n.first().copied()));
        }
        (Value::String(s), F::MFString | F::MFName) => {
            return Some(Value::Strings(vec![s.to_string()]));
        }
        (Value::Strings(s), F::SFString | F::SFName) => {
            return Some(Value::String(s.first()?.as_str().into()));
        }
        (Value::Image(_) | Value::Node(_) | Value::Nodes(_), _) => return None,
        (_, F::SFImage | F::SFImage3) => return None,
        _ => {}
    }
    let (numbers, width) = numbers(value)?;
    if matches!(kind, F::SFString | F::SFName | F::MFString | F::MFName) {
        return Some(text(&numbers, width, kind));
    }
    from_numbers(&rewidth(value, numbers, width, kind)?, kind)
}

/// Returns whether a value has the variant of a type.
fn same_shape(value: &Value, kind: F) -> bool {
    std::mem::discriminant(value) == std::mem::discriminant(&Value::empty(kind))
}

/// Returns the numbers of a value, and the number of them in one element.
pub fn numbers(value: &Value) -> Option<(Vec<f64>, usize)> {
    fn all<T: Copy, const N: usize>(v: &[T], f: impl Fn(T) -> [f64; N]) -> (Vec<f64>, usize) {
        (v.iter().flat_map(|&x| f(x)).collect(), N)
    }
    let rotation = |r: Rotation| {
        let a = r.axis.as_dvec3();
        [a.x, a.y, a.z, f64::from(r.angle)]
    };
    let plane = |p: Plane| {
        let n = p.normal.as_dvec3();
        [n.x, n.y, n.z, f64::from(p.distance)]
    };
    Some(match value {
        Value::Bool(b) => (vec![f64::from(u8::from(*b))], 1),
        Value::Int(i) => (vec![f64::from(*i)], 1),
        Value::UInt(i) => (vec![f64::from(*i)], 1),
        Value::Float(f) => (vec![f64::from(*f)], 1),
        Value::Double(f) => (vec![*f], 1),
        Value::Vec2(v) => all(&[*v], |v| v.as_dvec2().to_array()),
        Value::Vec3(v) => all(&[*v], |v| v.as_dvec3().to_array()),
        Value::Vec4(v) => all(&[*v], |v| v.as_dvec4().to_array()),
        Value::Rotation(r) => all(&[*r], rotation),
        Value::Matrix(m) => all(&[**m], |m| m.as_dmat4().to_cols_array()),
        Value::Plane(p) => all(&[*p], plane),
        Value::Bools(v) => all(v, |b| [f64::from(u8::from(b))]),
        Value::Ints(v) => all(v, |i| [f64::from(i)]),
        Value::UInts(v) => all(v, |i| [f64::from(i)]),
        Value::Floats(v) => all(v, |f| [f64::from(f)]),
        Value::Doubles(v) => all(v, |f| [f]),
        Value::Vec2s(v) => all(v, |v| v.as_dvec2().to_array()),
        Value::Vec3s(v) => all(v, |v| v.as_dvec3().to_array()),
        Value::Vec4s(v) => all(v, |v| v.as_dvec4().to_array()),
        Value::Rotations(v) => all(v, rotation),
        Value::Matrices(v) => all(v, |m| m.as_dmat4().to_cols_array()),
        Value::Planes(v) => all(v, plane),
        Value::String(s) => (parse(s), 1),
        Value::Strings(s) => (s.iter().flat_map(|s| parse(s)).collect(), 1),
        Value::Image(_) | Value::Node(_) | Value::Nodes(_) | Value::Trigger => return None,
    })
}

/// Returns the numbers in a text, up to the first word that is not a number.
fn parse(text: &str) -> Vec<f64> {
    match text.trim() {
        "TRUE" => vec![1.0],
        "FALSE" => vec![0.0],
        numbers => numbers
            .split([' ', ',', '\t', '\n'])
            .filter(|w| !w.is_empty())
            .map_while(|w| w.parse().ok())
            .collect(),
    }
}

/// Formats numbers as strings, one for each element.
fn text(numbers: &[f64], width: usize, kind: F) -> Value {
    let mut strings = numbers.chunks(width).map(|chunk| {
        let mut out = String::new();
        for (i, n) in chunk.iter().enumerate() {
            let gap = if i == 0 { "" } else { " " };
            let _ = write!(out, "{gap}{}", *n as f32);
        }
        out
    });
    if kind.is_multiple() {
        Value::Strings(strings.collect())
    } else {
        Value::String(strings.next().unwrap_or_default().into())
    }
}

/// Converts numbers to the width of another type. Rotations and matrices are converted to each
/// other, and numbers from text have any width. In other cases the widths must agree.
fn rewidth(value: &Value, numbers: Vec<f64>, width: usize, kind: F) -> Option<Vec<f64>> {
    let wanted = kind.width();
    let is_text = matches!(value, Value::String(_) | Value::Strings(_));
    let plain_doubles = matches!(value, Value::Doubles(_) | Value::Ints(_));
    if width == wanted || ((is_text || plain_doubles) && numbers.len() >= wanted) {
        return Some(numbers);
    }
    match (width, wanted) {
        (4, 16) if matches!(value, Value::Rotation(_) | Value::Rotations(_)) => {
            let turns = numbers.chunks_exact(4).map(|n| {
                let r = Rotation::new(
                    Vec3::new(n[0] as f32, n[1] as f32, n[2] as f32),
                    n[3] as f32,
                );
                DMat4::from_quat(r.to_quat().as_dquat()).to_cols_array()
            });
            Some(turns.flatten().collect())
        }
        (16, 4) if matches!(kind, F::SFRotation | F::MFRotation) => {
            let turns = numbers.chunks_exact(16).map(|n| {
                let m = DMat4::from_cols_array(&std::array::from_fn(|i| n[i]));
                let r = rotation_of(matrix::decompose(m, DVec3::ZERO).rotation);
                [r.axis.x, r.axis.y, r.axis.z, r.angle].map(f64::from)
            });
            Some(turns.flatten().collect())
        }
        _ => None,
    }
}

/// Returns the axis and angle of a unit quaternion.
pub(super) fn rotation_of(q: DQuat) -> Rotation {
    let v = DVec3::new(q.x, q.y, q.z);
    match v.try_normalize() {
        Some(axis) => Rotation::new(axis.as_vec3(), (2.0 * libm::atan2(v.length(), q.w)) as f32),
        None => Rotation::IDENTITY,
    }
}

/// Creates a value from its numbers, or `None` if there are too few for a single value.
pub fn from_numbers(n: &[f64], kind: F) -> Option<Value> {
    let width = kind.width();
    if !kind.is_multiple() && n.len() < width {
        return None;
    }
    let f = |i: usize| n[i] as f32;
    let vec2 = |n: &[f64]| Vec2::new(n[0] as f32, n[1] as f32);
    let vec3 = |n: &[f64]| Vec3::new(n[0] as f32, n[1] as f32, n[2] as f32);
    let vec4 = |n: &[f64]| Vec4::new(n[0] as f32, n[1] as f32, n[2] as f32, n[3] as f32);
    let rotation = |n: &[f64]| Rotation::new(vec3(n), n[3] as f32);
    let plane = |n: &[f64]| Plane {
        normal: vec3(n),
        distance: n[3] as f32,
    };
    let matrix = |n: &[f64]| Mat4::from_cols_array(&std::array::from_fn(|i| n[i] as f32));
    let each = n.chunks_exact(width);
    Some(match kind {
        F::SFBool => Value::Bool(n[0] != 0.0),
        F::SFInt32 | F::SFShort | F::SFEnum | F::SFBitMask => Value::Int(n[0] as i32),
        F::SFUInt32 | F::SFUShort => Value::UInt(n[0] as u32),
        F::SFFloat => Value::Float(f(0)),
        F::SFDouble | F::SFTime => Value::Double(n[0]),
        F::SFVec2f => Value::Vec2(vec2(n)),
        F::SFVec3f | F::SFColor => Value::Vec3(vec3(n)),
        F::SFVec4f => Value::Vec4(vec4(n)),
        F::SFRotation => Value::Rotation(rotation(n)),
        F::SFMatrix => Value::Matrix(Box::new(matrix(n))),
        F::SFPlane => Value::Plane(plane(n)),
        F::SFVec3d => Value::Doubles(n[..3].to_vec()),
        F::SFVec2s | F::SFVec2i32 | F::SFVec3i32 | F::SFVec4i32 => {
            Value::Ints(n[..width].iter().map(|&x| x as i32).collect())
        }
        F::MFBool => Value::Bools(n.iter().map(|&x| x != 0.0).collect()),
        F::MFInt32 | F::MFShort | F::MFEnum | F::MFVec2i32 | F::MFVec3i32 | F::MFVec4i32 => {
            Value::Ints(n.iter().map(|&x| x as i32).collect())
        }
        F::MFUInt32 | F::MFUShort => Value::UInts(n.iter().map(|&x| x as u32).collect()),
        F::MFFloat => Value::Floats(n.iter().map(|&x| x as f32).collect()),
        F::MFDouble | F::MFTime | F::MFVec3d => Value::Doubles(n.to_vec()),
        F::MFVec2f => Value::Vec2s(each.map(vec2).collect()),
        F::MFVec3f | F::MFColor => Value::Vec3s(each.map(vec3).collect()),
        F::MFVec4f => Value::Vec4s(each.map(vec4).collect()),
        F::MFRotation => Value::Rotations(each.map(rotation).collect()),
        F::MFMatrix => Value::Matrices(each.map(matrix).collect()),
        F::MFPlane => Value::Planes(each.map(plane).collect()),
        F::SFString | F::SFName | F::MFString | F::MFName => return None,
        F::SFImage | F::SFImage3 | F::SFNode | F::SFPath | F::SFEngine => return None,
        F::SFTrigger | F::MFNode => return None,
    })
}
