//! What each of Inventor's engines gives out for what its fields hold.
//!
//! Fields of several values are worked through value by value; a shorter one goes on with its
//! last.

use glam::{DQuat, DVec3, Mat4, Vec2, Vec3, Vec4};

use super::calculator;
use super::convert::rotation_of;
use super::lists::{at, at_or, floats, list, run, vectors};
use super::matrix::{self, Parts};
use super::outputs::{Outputs, Pulses};
use super::sensors::between;
use crate::grammar::value::{Choice, Seconds, Value};
use crate::iv::NodeRef;
use crate::iv::value::Rotation;

/// Outputs of an engine; none for a node that is not one. `Err`: what is wrong with it.
/// `fired` tells of the triggers among its fields.
pub fn outputs(
    node: NodeRef<'_>,
    class: &str,
    time: f64,
    fired: &dyn Fn(&str) -> Pulses,
) -> Result<Outputs, String> {
    Ok(match class {
        "Calculator" => calculator::outputs(node)?,
        "ComposeVec2f" => {
            let [x, y] = ["x", "y"].map(|n| floats(node, n));
            let make = |i| Vec2::new(at(x, i), at(y, i));
            vec![("vector", Value::Vec2s(run([x.len(), y.len()], make)))]
        }
        "ComposeVec3f" => {
            let [x, y, z] = ["x", "y", "z"].map(|n| floats(node, n));
            let make = |i| Vec3::new(at(x, i), at(y, i), at(z, i));
            vec![(
                "vector",
                Value::Vec3s(run([x.len(), y.len(), z.len()], make)),
            )]
        }
        "ComposeVec4f" => {
            let [x, y, z, w] = ["x", "y", "z", "w"].map(|n| floats(node, n));
            let make = |i| Vec4::new(at(x, i), at(y, i), at(z, i), at(w, i));
            let lengths = [x.len(), y.len(), z.len(), w.len()];
            vec![("vector", Value::Vec4s(run(lengths, make)))]
        }
        "DecomposeVec2f" => {
            let v = list::<[Vec2], _>(node, "vector");
            vec![("x", components(v, |v| v.x)), ("y", components(v, |v| v.y))]
        }
        "DecomposeVec3f" => {
            let v = vectors(node, "vector");
            vec![
                ("x", components(v, |v| v.x)),
                ("y", components(v, |v| v.y)),
                ("z", components(v, |v| v.z)),
            ]
        }
        "DecomposeVec4f" => {
            let v = list::<[Vec4], _>(node, "vector");
            vec![
                ("x", components(v, |v| v.x)),
                ("y", components(v, |v| v.y)),
                ("z", components(v, |v| v.z)),
                ("w", components(v, |v| v.w)),
            ]
        }
        "ComposeRotation" => {
            let (axis, angle) = (vectors(node, "axis"), floats(node, "angle"));
            let make = |i| Rotation {
                axis: at_or(axis, i, Vec3::Z),
                angle: at(angle, i),
            };
            vec![(
                "rotation",
                Value::Rotations(run([axis.len(), angle.len()], make)),
            )]
        }
        "ComposeRotationFromTo" => {
            let (from, to) = (vectors(node, "from"), vectors(node, "to"));
            let make = |i| from_to(at_or(from, i, Vec3::Z), at_or(to, i, Vec3::Z));
            vec![(
                "rotation",
                Value::Rotations(run([from.len(), to.len()], make)),
            )]
        }
        "DecomposeRotation" => {
            let turns = list::<[Rotation], _>(node, "rotation");
            let unit = |r: &Rotation| r.axis.try_normalize().unwrap_or(Vec3::Z);
            vec![
                ("axis", Value::Vec3s(turns.iter().map(unit).collect())),
                (
                    "angle",
                    Value::Floats(turns.iter().map(|r| r.angle).collect()),
                ),
            ]
        }
        "ComposeMatrix" => compose_matrix(node),
        "DecomposeMatrix" => decompose_matrix(node),
        "TransformVec3f" => transform(node),
        "InterpolateFloat" => {
            let (a, b) = (floats(node, "input0"), floats(node, "input1"));
            let t = alpha(node);
            let make = |i| at(a, i) + (at(b, i) - at(a, i)) * t;
            vec![("output", Value::Floats(run([a.len(), b.len()], make)))]
        }
        "InterpolateVec2f" => {
            let [a, b] = ["input0", "input1"].map(|n| list::<[Vec2], _>(node, n));
            let t = alpha(node);
            let make = |i| at(a, i).lerp(at(b, i), t);
            vec![("output", Value::Vec2s(run([a.len(), b.len()], make)))]
        }
        "InterpolateVec3f" => {
            let [a, b] = ["input0", "input1"].map(|n| vectors(node, n));
            let t = alpha(node);
            let make = |i| at(a, i).lerp(at(b, i), t);
            vec![("output", Value::Vec3s(run([a.len(), b.len()], make)))]
        }
        "InterpolateVec4f" => {
            let [a, b] = ["input0", "input1"].map(|n| list::<[Vec4], _>(node, n));
            let t = alpha(node);
            let make = |i| at(a, i).lerp(at(b, i), t);
            vec![("output", Value::Vec4s(run([a.len(), b.len()], make)))]
        }
        "InterpolateRotation" => {
            let [a, b] = ["input0", "input1"].map(|n| list::<[Rotation], _>(node, n));
            let t = f64::from(alpha(node));
            let still = Rotation::IDENTITY;
            let make = |i| between(at_or(a, i, still), at_or(b, i, still), t);
            vec![("output", Value::Rotations(run([a.len(), b.len()], make)))]
        }
        "BoolOperation" => bool_operation(node),
        "SelectOne" => select_one(node),
        "Gate" => {
            let open = flag(node, "enable", false) || fired("trigger").count > 0;
            let passed = node.value("input").filter(|_| open);
            passed.map(|v| ("output", v.clone())).into_iter().collect()
        }
        "Concatenate" => concatenate(node),
        "ElapsedTime" => {
            let speed = f64::from(node.read::<f32>("speed").unwrap_or(1.0));
            let runs = flag(node, "on", true) && !flag(node, "pause", false);
            let since = time_in(node, time) - fired("reset").last;
            let elapsed = if runs { speed * since } else { 0.0 };
            vec![("timeOut", Value::Double(elapsed))]
        }
        "TimeCounter" => vec![("output", Value::Int(time_counter(node, time)))],
        "Counter" => vec![("output", Value::Int(counter(node, fired("trigger"))))],
        "OneShot" => one_shot(node, time, fired("trigger")),
        "OnOff" => {
            let (on, off) = (fired("on"), fired("off"));
            let turned_on = on.count > 0 && (off.count == 0 || on.last >= off.last);
            let is_on = turned_on != (fired("toggle").count % 2 == 1);
            vec![("isOn", Value::Bool(is_on)), ("isOff", Value::Bool(!is_on))]
        }
        // A `GlobalField`'s clock; its other fields are plain values.
        "GlobalField" if node.value("realTime").is_some() => {
            vec![("realTime", Value::Double(time))]
        }
        _ => Vec::new(),
    })
}

fn flag(node: NodeRef<'_>, name: &str, silent: bool) -> bool {
    node.read::<bool>(name).unwrap_or(silent)
}

fn integer(node: NodeRef<'_>, name: &str, silent: i32) -> i32 {
    node.read::<i32>(name).unwrap_or(silent)
}

fn alpha(node: NodeRef<'_>) -> f32 {
    node.read::<f32>("alpha").unwrap_or(0.0)
}

fn components<T>(values: &[T], part: impl Fn(&T) -> f32) -> Value {
    Value::Floats(values.iter().map(part).collect())
}

/// The turn that takes one direction to another by the shortest way.
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
    Rotation {
        axis: axis.as_vec3(),
        angle: angle as f32,
    }
}

fn compose_matrix(node: NodeRef<'_>) -> Outputs {
    let [translation, scale, center] =
        ["translation", "scaleFactor", "center"].map(|n| vectors(node, n));
    let [rotation, along] =
        ["rotation", "scaleOrientation"].map(|n| list::<[Rotation], _>(node, n));
    let quat =
        |r: &[Rotation], i| -> DQuat { at_or(r, i, Rotation::IDENTITY).to_quat().as_dquat() };
    let make = |i| {
        let parts = Parts {
            translation: at(translation, i).as_dvec3(),
            rotation: quat(rotation, i),
            scale: at_or(scale, i, Vec3::ONE).as_dvec3(),
            scale_orientation: quat(along, i),
        };
        matrix::compose(&parts, at(center, i).as_dvec3()).as_mat4()
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

fn decompose_matrix(node: NodeRef<'_>) -> Outputs {
    let matrices = list::<[Mat4], _>(node, "matrix");
    let center = vectors(node, "center");
    let parts: Vec<Parts> = matrices
        .iter()
        .enumerate()
        .map(|(i, m)| matrix::decompose(m.as_dmat4(), at(center, i).as_dvec3()))
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

fn transform(node: NodeRef<'_>) -> Outputs {
    let v = vectors(node, "vector");
    let m = list::<[Mat4], _>(node, "matrix");
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

fn bool_operation(node: NodeRef<'_>) -> Outputs {
    let [a, b] = ["a", "b"].map(|n| list::<[bool], _>(node, n));
    let operation = list::<[Choice], _>(node, "operation");
    let make = |i| {
        let (a, b) = (at(a, i), at(b, i));
        match at_or(operation, i, 2) {
            0 => false,
            1 => true,
            2 => a,
            3 => !a,
            4 => b,
            5 => !b,
            6 => a || b,
            7 => !a || b,
            8 => a || !b,
            9 => !a || !b,
            10 => a && b,
            11 => !a && b,
            12 => a && !b,
            13 => !a && !b,
            14 => a == b,
            _ => a != b,
        }
    };
    let result = run([a.len(), b.len(), operation.len()], make);
    let inverse = result.iter().map(|r| !r).collect();
    vec![
        ("output", Value::Bools(result)),
        ("inverse", Value::Bools(inverse)),
    ]
}

/// The value of a list at an index, as a single value; the last one past its end.
fn select_one(node: NodeRef<'_>) -> Outputs {
    let index = usize::try_from(integer(node, "index", 0)).unwrap_or(0);
    let chosen = node.value("input").and_then(|input| element(input, index));
    chosen.map(|v| ("output", v)).into_iter().collect()
}

fn element(list: &Value, i: usize) -> Option<Value> {
    fn pick<T: Clone>(v: &[T], i: usize) -> Option<T> {
        v.get(i).or(v.last()).cloned()
    }
    Some(match list {
        Value::Bools(v) => Value::Bool(pick(v, i)?),
        Value::Ints(v) => Value::Int(pick(v, i)?),
        Value::UInts(v) => Value::UInt(pick(v, i)?),
        Value::Floats(v) => Value::Float(pick(v, i)?),
        Value::Doubles(v) => Value::Double(pick(v, i)?),
        Value::Strings(v) => Value::String(pick(v, i)?.into()),
        Value::Vec2s(v) => Value::Vec2(pick(v, i)?),
        Value::Vec3s(v) => Value::Vec3(pick(v, i)?),
        Value::Vec4s(v) => Value::Vec4(pick(v, i)?),
        Value::Rotations(v) => Value::Rotation(pick(v, i)?),
        Value::Matrices(v) => Value::Matrix(Box::new(pick(v, i)?)),
        Value::Planes(v) => Value::Plane(pick(v, i)?),
        Value::Nodes(v) => Value::Node(Some(pick(v, i)?)),
        single => single.clone(),
    })
}

/// `input0` to `input9`, one behind the other.
fn concatenate(node: NodeRef<'_>) -> Outputs {
    let mut all: Option<Value> = None;
    for input in (0..10).filter_map(|i| node.value(&format!("input{i}"))) {
        match &mut all {
            None => all = Some(input.clone()),
            Some(all) => append(all, input),
        }
    }
    all.map(|v| ("output", v)).into_iter().collect()
}

fn append(all: &mut Value, more: &Value) {
    match (all, more) {
        (Value::Bools(a), Value::Bools(b)) => a.extend_from_slice(b),
        (Value::Ints(a), Value::Ints(b)) => a.extend_from_slice(b),
        (Value::UInts(a), Value::UInts(b)) => a.extend_from_slice(b),
        (Value::Floats(a), Value::Floats(b)) => a.extend_from_slice(b),
        (Value::Doubles(a), Value::Doubles(b)) => a.extend_from_slice(b),
        (Value::Strings(a), Value::Strings(b)) => a.extend_from_slice(b),
        (Value::Vec2s(a), Value::Vec2s(b)) => a.extend_from_slice(b),
        (Value::Vec3s(a), Value::Vec3s(b)) => a.extend_from_slice(b),
        (Value::Vec4s(a), Value::Vec4s(b)) => a.extend_from_slice(b),
        (Value::Rotations(a), Value::Rotations(b)) => a.extend_from_slice(b),
        (Value::Matrices(a), Value::Matrices(b)) => a.extend_from_slice(b),
        (Value::Planes(a), Value::Planes(b)) => a.extend_from_slice(b),
        (Value::Nodes(a), Value::Nodes(b)) => a.extend_from_slice(b),
        _ => {} // inputs are of one type
    }
}

/// The connected `timeIn`; without a connection it is the clock, whatever the file wrote there.
fn time_in(node: NodeRef<'_>, time: f64) -> f64 {
    let place = node.class().and_then(|c| c.field("timeIn"));
    let joined =
        node.data().fields.iter().any(|f| {
            f.connection.is_some() && place.is_some_and(|(i, _)| i == usize::from(f.index))
        });
    let stated = node.read::<Seconds>("timeIn");
    stated.filter(|_| joined).unwrap_or(time)
}

/// How many values there are from `min` to `max` by `step`, unless there is no way.
fn counts(node: NodeRef<'_>) -> Option<i64> {
    let span = i64::from(integer(node, "max", 1)) - i64::from(integer(node, "min", 0));
    let step = i64::from(integer(node, "step", 1));
    (step != 0 && span.signum() * step.signum() >= 0).then(|| span / step + 1)
}

fn count_at(node: NodeRef<'_>, place: i64) -> i32 {
    let min = i64::from(integer(node, "min", 0));
    let step = i64::from(integer(node, "step", 1));
    i32::try_from(min + place * step).unwrap_or(i32::MAX)
}

fn cycles(node: NodeRef<'_>, time: f64) -> f64 {
    time_in(node, time) * f64::from(node.read::<f32>("frequency").unwrap_or(1.0))
}

/// Counts from `min` to `max` by `step`, a whole round in 1/frequency seconds; `duty` weighs how
/// long each count lasts.
fn time_counter(node: NodeRef<'_>, time: f64) -> i32 {
    let Some(counts) = counts(node).filter(|_| flag(node, "on", true)) else {
        return count_at(node, 0);
    };
    let cycles = cycles(node, time);
    let phase = cycles - cycles.floor();
    let duty = floats(node, "duty");
    let total: f64 = duty.iter().map(|&d| f64::from(d.max(0.0))).sum();
    let weighted = duty.len() as i64 == counts && counts > 1 && total > 0.0;
    let place = if weighted {
        let mut passed = 0.0;
        let place = duty.iter().position(|&d| {
            passed += f64::from(d.max(0.0)) / total;
            phase < passed
        });
        place.map_or(counts - 1, |p| p as i64)
    } else {
        ((phase * counts as f64) as i64).clamp(0, counts - 1)
    };
    count_at(node, place)
}

/// The whole rounds of a `TimeCounter`: each fires its `syncOut`.
pub fn rounds(node: NodeRef<'_>, time: f64) -> Pulses {
    let cycles = cycles(node, time).floor();
    if !(cycles > 0.0) || !flag(node, "on", true) {
        return Pulses::default();
    }
    Pulses {
        count: cycles as u64,
        last: time_in(node, time) * (cycles / self::cycles(node, time)),
    }
}

/// Steps once a trigger, round and round.
fn counter(node: NodeRef<'_>, trigger: Pulses) -> i32 {
    let place = counts(node).map_or(0, |counts| (trigger.count % counts as u64) as i64);
    count_at(node, place)
}

/// Runs from its last trigger for `duration`; with `HOLD_FINAL` it stays at the end.
fn one_shot(node: NodeRef<'_>, time: f64, trigger: Pulses) -> Outputs {
    const HOLD_FINAL: i32 = 2;
    let duration = node.read::<Seconds>("duration").unwrap_or(1.0);
    let fired = trigger.count > 0 && !flag(node, "disable", false);
    let since = time_in(node, time) - trigger.last;
    let active = fired && since < duration;
    let holds = node.read::<Choice>("flags").unwrap_or(0) & HOLD_FINAL != 0;
    let shown = match (fired, active) {
        (true, true) => since,
        (true, false) if holds => duration,
        _ => 0.0,
    };
    let ramp = if duration > 0.0 {
        shown / duration
    } else {
        0.0
    };
    vec![
        ("timeOut", Value::Double(shown)),
        ("isActive", Value::Bool(active)),
        ("ramp", Value::Float(ramp as f32)),
    ]
}

/// The outputs of a `ComputeBoundingBox`. Inventor's `objectCenter` is the box's center unless an
/// action sets another; here it always is.
pub fn corners((min, max): (DVec3, DVec3)) -> Outputs {
    let vector = |v: DVec3| Value::Vec3(v.as_vec3());
    let center = vector(0.5 * (min + max));
    vec![
        ("min", vector(min)),
        ("max", vector(max)),
        ("boxCenter", center.clone()),
        ("objectCenter", center),
    ]
}
