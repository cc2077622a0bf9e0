//! Evaluates the fields that Inventor's animated nodes change, for connections from these fields.

use std::f64::consts::TAU;

use super::interpolate::between;
use super::outputs::Outputs;
use crate::grammar::value::{Rotation, Value};
use crate::grammar::{Field, pendulum, rotor, shuttle};
use crate::iv::NodeRef;

pub(super) fn rotor(node: NodeRef<'_>, time: f64) -> Outputs {
    let Some(cycles) = cycles(node, (rotor::ON, rotor::SPEED), time) else {
        return Vec::new();
    };
    let start = node.get(rotor::ROTATION);
    let angle = start.angle + (TAU * cycles) as f32;
    vec![("rotation", Value::Rotation(Rotation { angle, ..start }))]
}

pub(super) fn pendulum(node: NodeRef<'_>, time: f64) -> Outputs {
    let Some(cycles) = cycles(node, (pendulum::ON, pendulum::SPEED), time) else {
        return Vec::new();
    };
    let (a, b) = (node.get(pendulum::ROTATION0), node.get(pendulum::ROTATION1));
    vec![("rotation", Value::Rotation(between(a, b, swing(cycles))))]
}

pub(super) fn shuttle(node: NodeRef<'_>, time: f64) -> Outputs {
    let Some(cycles) = cycles(node, (shuttle::ON, shuttle::SPEED), time) else {
        return Vec::new();
    };
    let (a, b) = (
        node.get(shuttle::TRANSLATION0),
        node.get(shuttle::TRANSLATION1),
    );
    vec![("translation", Value::Vec3(a.lerp(b, swing(cycles) as f32)))]
}

/// Returns the cycles since the start, or `None` if the node is off.
fn cycles(node: NodeRef<'_>, (on, speed): (Field<bool>, Field<f32>), time: f64) -> Option<f64> {
    node.get(on).then(|| f64::from(node.get(speed)) * time)
}

fn swing(cycles: f64) -> f64 {
    0.5 - 0.5 * libm::cos(TAU * cycles)
}
