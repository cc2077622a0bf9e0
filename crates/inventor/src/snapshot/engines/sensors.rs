//! Evaluates VRML97's interpolators.

use glam::Vec3;

use super::interpolate::between;
use crate::grammar::value::Value;
use crate::grammar::{
    ClassId, class, orientation_interpolator, position_interpolator, scalar_interpolator,
    vrml_interpolator,
};
use crate::iv::NodeRef;

/// Finds a fraction among the keys. Returns the index of the key before it, and its relative
/// position between that key and the next, from 0 to 1.
fn locate(keys: &[f32], fraction: f32) -> Option<(usize, f64)> {
    if keys.is_empty() || fraction.is_nan() {
        return None;
    }
    let next = keys.partition_point(|&k| k <= fraction);
    if next == 0 {
        return Some((0, 0.0));
    }
    if next == keys.len() {
        return Some((next - 1, 0.0));
    }
    let (a, b) = (f64::from(keys[next - 1]), f64::from(keys[next]));
    Some((next - 1, (f64::from(fraction) - a) / (b - a)))
}

/// Returns the value of an interpolator at a fraction, or `None` if it has no keys.
pub(crate) fn interpolate(node: NodeRef<'_>, class: ClassId, fraction: f32) -> Option<Value> {
    let keys = node.get(vrml_interpolator::KEY);
    let (at, share) = locate(keys, fraction)?;
    let vectors = node.get(position_interpolator::KEY_VALUE);
    Some(match class {
        class::SCALAR_INTERPOLATOR => {
            let values = node.get(scalar_interpolator::KEY_VALUE);
            let (a, b) = (*values.get(at)?, *values.get(at + 1).or(values.get(at))?);
            Value::Float((f64::from(a) + share * f64::from(b - a)) as f32)
        }
        class::POSITION_INTERPOLATOR => {
            let (a, b) = pair(vectors, at)?;
            Value::Vec3(a.lerp(b, share as f32))
        }
        class::COLOR_INTERPOLATOR => {
            let (a, b) = pair(vectors, at)?;
            Value::Vec3(to_rgb(to_hsv(a), to_hsv(b), share as f32))
        }
        class::ORIENTATION_INTERPOLATOR => {
            let (a, b) = pair(node.get(orientation_interpolator::KEY_VALUE), at)?;
            Value::Rotation(between(a, b, share))
        }
        class::COORDINATE_INTERPOLATOR | class::NORMAL_INTERPOLATOR => {
            let each = vectors.len() / keys.len();
            let set = |i: usize| vectors.get(i * each..(i + 1) * each);
            let (a, b) = (set(at)?, set(at + 1).or(set(at))?);
            let mix = a.iter().zip(b).map(|(a, b)| a.lerp(*b, share as f32));
            let normals = class == class::NORMAL_INTERPOLATOR;
            let mix = mix.map(|v| if normals { v.normalize_or_zero() } else { v });
            Value::Vec3s(mix.collect())
        }
        _ => return None,
    })
}

/// Returns a value and the next one. The last value is its own successor.
fn pair<T: Copy>(values: &[T], at: usize) -> Option<(T, T)> {
    let a = *values.get(at)?;
    Some((a, values.get(at + 1).copied().unwrap_or(a)))
}

/// Converts a color to hue (in sixths of a turn), saturation and value, in which VRML97
/// interpolates.
fn to_hsv(c: Vec3) -> Vec3 {
    let (high, low) = (c.max_element(), c.min_element());
    let range = high - low;
    let hue = if range == 0.0 {
        0.0
    } else if high == c.x {
        ((c.y - c.z) / range).rem_euclid(6.0)
    } else if high == c.y {
        (c.z - c.x) / range + 2.0
    } else {
        (c.x - c.y) / range + 4.0
    };
    Vec3::new(hue, if high > 0.0 { range / high } else { 0.0 }, high)
}

/// Interpolates between two colors in hue, saturation and value, along the shorter arc of hues.
/// Returns RGB. Gray has the hue of the other color.
fn to_rgb(a: Vec3, b: Vec3, share: f32) -> Vec3 {
    let (from, to) = match (a.y == 0.0, b.y == 0.0) {
        (true, false) => (b.x, b.x),
        (false, true) => (a.x, a.x),
        _ => (a.x, b.x),
    };
    let arc = (to - from + 9.0).rem_euclid(6.0) - 3.0;
    let hue = (from + share * arc).rem_euclid(6.0);
    let rest = a.lerp(b, share);
    let (saturation, value) = (rest.y, rest.z);
    let channel = |n: f32| {
        let k = (n + hue).rem_euclid(6.0);
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    Vec3::new(channel(5.0), channel(3.0), channel(1.0))
}
