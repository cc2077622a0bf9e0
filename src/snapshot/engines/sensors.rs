//! What VRML97's time sensors and interpolators, and Inventor's moving nodes, give at a time.

use std::collections::HashMap;

use glam::{DQuat, Vec3};

use super::convert::rotation_of;
use super::outputs::Outputs;
use crate::grammar::value::{Seconds, Value};
use crate::iv::value::Rotation;
use crate::iv::{NodeId, NodeRef};

/// Outputs of a node of one of these classes; `None` for another.
pub fn outputs(
    node: NodeRef<'_>,
    class: &str,
    time: f64,
    inputs: &HashMap<(NodeId, &'static str), Value>,
) -> Option<Outputs> {
    if class == "TimeSensor" {
        return Some(time_sensor(node, time));
    }
    if class == "Rotor" || class == "Pendulum" || class == "Shuttle" {
        return Some(mover(node, class, time));
    }
    if !class.ends_with("Interpolator") {
        return None;
    }
    let fraction = match inputs.get(&(node.id, "set_fraction")) {
        Some(Value::Float(fraction)) => *fraction,
        _ => return Some(Vec::new()), // no event has come in
    };
    let value = interpolate(node, class, fraction);
    Some(value.map(|v| ("value_changed", v)).into_iter().collect())
}

/// A sensor that loops runs from its `startTime`. One that does not runs once, if the file gives
/// it a start after 0 (0 is long ago in VRML97's time), and keeps its last fraction.
fn time_sensor(node: NodeRef<'_>, time: f64) -> Outputs {
    let seconds = |name| node.read::<Seconds>(name).unwrap_or(0.0);
    let (start, stop) = (seconds("startTime"), seconds("stopTime"));
    let cycle = node
        .read::<Seconds>("cycleInterval")
        .filter(|c| *c > 0.0)
        .unwrap_or(1.0);
    let loops = node.read::<bool>("loop").unwrap_or(false);
    let enabled = node.read::<bool>("enabled").unwrap_or(true);
    if !enabled || !(time >= start) || !(loops || start > 0.0) {
        return vec![("isActive", Value::Bool(false))];
    }
    let stopped = stop > start && time >= stop;
    let now = if stopped { stop } else { time };
    let cycles = (now - start) / cycle;
    let ended = !loops && cycles >= 1.0;
    let fraction = if ended { 1.0 } else { cycles - cycles.floor() };
    vec![
        ("isActive", Value::Bool(!stopped && !ended)),
        ("fraction_changed", Value::Float(fraction as f32)),
        ("time", Value::Double(now)),
        ("cycleTime", Value::Double(start + cycle * cycles.floor())),
    ]
}

/// Where a fraction lies among keys: the key before, and the share of the way to the next.
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

fn interpolate(node: NodeRef<'_>, class: &str, fraction: f32) -> Option<Value> {
    let keys = node.read::<[f32]>("key")?;
    let (at, share) = locate(keys, fraction)?;
    let vectors = || node.read::<[Vec3]>("keyValue");
    Some(match class {
        "ScalarInterpolator" => {
            let values = node.read::<[f32]>("keyValue")?;
            let (a, b) = (*values.get(at)?, *values.get(at + 1).or(values.get(at))?);
            Value::Float((f64::from(a) + share * f64::from(b - a)) as f32)
        }
        "PositionInterpolator" => {
            let (a, b) = pair(vectors()?, at)?;
            Value::Vec3(a.lerp(b, share as f32))
        }
        "ColorInterpolator" => {
            let (a, b) = pair(vectors()?, at)?;
            Value::Vec3(to_rgb(to_hsv(a), to_hsv(b), share as f32))
        }
        "OrientationInterpolator" => {
            let (a, b) = pair(node.read::<[Rotation]>("keyValue")?, at)?;
            Value::Rotation(between(a, b, share))
        }
        "CoordinateInterpolator" | "NormalInterpolator" => {
            let values = vectors()?;
            let each = values.len() / keys.len();
            let set = |i: usize| values.get(i * each..(i + 1) * each);
            let (a, b) = (set(at)?, set(at + 1).or(set(at))?);
            let mix = a.iter().zip(b).map(|(a, b)| a.lerp(*b, share as f32));
            let normals = class == "NormalInterpolator";
            let mix = mix.map(|v| if normals { v.normalize_or_zero() } else { v });
            Value::Vec3s(mix.collect())
        }
        _ => return None,
    })
}

fn pair<T: Copy>(values: &[T], at: usize) -> Option<(T, T)> {
    let a = *values.get(at)?;
    Some((a, values.get(at + 1).copied().unwrap_or(a)))
}

/// The shorter way between two rotations.
pub fn between(a: Rotation, b: Rotation, share: f64) -> Rotation {
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

/// Hue in sixths of a turn, saturation, value; the standard interpolates colors in them.
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

/// The color a share of the way between two, the short way round; gray has no hue of its own.
fn to_rgb(a: Vec3, b: Vec3, share: f32) -> Vec3 {
    let (from, to) = match (a.y == 0.0, b.y == 0.0) {
        (true, false) => (b.x, b.x),
        (false, true) => (a.x, a.x),
        _ => (a.x, b.x),
    };
    let way = (to - from + 9.0).rem_euclid(6.0) - 3.0;
    let hue = (from + share * way).rem_euclid(6.0);
    let rest = a.lerp(b, share);
    let (saturation, value) = (rest.y, rest.z);
    let channel = |n: f32| {
        let k = (n + hue).rem_euclid(6.0);
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    Vec3::new(channel(5.0), channel(3.0), channel(1.0))
}

/// The field that a moving node changes, for whoever is connected to it.
fn mover(node: NodeRef<'_>, class: &str, time: f64) -> Outputs {
    if !node.read::<bool>("on").unwrap_or(true) {
        return Vec::new();
    }
    let cycles = f64::from(node.read::<f32>("speed").unwrap_or(1.0)) * time;
    let swing = 0.5 - 0.5 * libm::cos(std::f64::consts::TAU * cycles);
    let turn = |name| node.read::<Rotation>(name).unwrap_or(Rotation::IDENTITY);
    let place = |name| node.read::<Vec3>(name).unwrap_or(Vec3::ZERO);
    match class {
        "Rotor" => {
            let start = turn("rotation");
            let angle = start.angle + (std::f64::consts::TAU * cycles) as f32;
            vec![("rotation", Value::Rotation(Rotation { angle, ..start }))]
        }
        "Pendulum" => {
            let rotation = between(turn("rotation0"), turn("rotation1"), swing);
            vec![("rotation", Value::Rotation(rotation))]
        }
        _ => {
            let place = place("translation0").lerp(place("translation1"), swing as f32);
            vec![("translation", Value::Vec3(place))]
        }
    }
}
