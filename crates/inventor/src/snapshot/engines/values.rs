//! Evaluates engines that select, gate and concatenate values, and Boolean operations.

use super::lists::{at, at_or, run};
use super::outputs::{Outputs, Pulses};
use crate::grammar::value::{Trigger, Value};
use crate::grammar::{Field, bool_operation as op, gate, select_one};
use crate::iv::NodeRef;

pub(super) fn bool_operation(node: NodeRef<'_>) -> Outputs {
    let (a, b) = (node.get(op::A), node.get(op::B));
    let operation = node.get(op::OPERATION);
    let make = |i| {
        let (a, b) = (at(a, i), at(b, i));
        match at_or(operation, i, op::OPERATION_A) {
            op::OPERATION_CLEAR => false,
            op::OPERATION_SET => true,
            op::OPERATION_A => a,
            op::OPERATION_NOT_A => !a,
            op::OPERATION_B => b,
            op::OPERATION_NOT_B => !b,
            op::OPERATION_A_OR_B => a || b,
            op::OPERATION_NOT_A_OR_B => !a || b,
            op::OPERATION_A_OR_NOT_B => a || !b,
            op::OPERATION_NOT_A_OR_NOT_B => !a || !b,
            op::OPERATION_A_AND_B => a && b,
            op::OPERATION_NOT_A_AND_B => !a && b,
            op::OPERATION_A_AND_NOT_B => a && !b,
            op::OPERATION_NOT_A_AND_NOT_B => !a && !b,
            op::OPERATION_A_EQUALS_B => a == b,
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

/// Computes a `Gate`, which passes its input on while it is enabled or after a trigger.
pub(super) fn gate(node: NodeRef<'_>, fired: &dyn Fn(Field<Trigger>) -> Pulses) -> Outputs {
    let open = node.get(gate::ENABLE) || fired(gate::TRIGGER).count > 0;
    let passed = node.value("input").filter(|_| open);
    passed.map(|v| ("output", v.clone())).into_iter().collect()
}

/// Computes a `SelectOne`, which returns one value of a list. An index after the end means the last
/// value.
pub(super) fn select_one(node: NodeRef<'_>) -> Outputs {
    let index = usize::try_from(node.get(select_one::INDEX)).unwrap_or(0);
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

/// Computes a `Concatenate`, which joins `input0` to `input9`. The field `type` states their type.
pub(super) fn concatenate(node: NodeRef<'_>) -> Outputs {
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
        _ => {} // All inputs have the same type.
    }
}
