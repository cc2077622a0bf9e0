//! Computes the outputs of an engine or an animated node.

use super::outputs::{Outputs, Pulses};
use super::{calculator, clocks, compose, interpolate, movers, values};
use crate::grammar::value::{Trigger, Value};
use crate::grammar::{ClassId, Field, class};
use crate::iv::NodeRef;

/// The inputs of an engine other than its fields.
pub(super) struct EngineMoment<'a> {
    /// The time in seconds since the scene was opened.
    pub time: f64,
    /// Returns the pulses of a trigger field of the engine.
    pub fired: &'a dyn Fn(Field<Trigger>) -> Pulses,
}

/// Returns the outputs of a node of a class. The list is empty for a class without outputs.
///
/// # Errors
/// Returns a message if the engine's fields are wrong.
pub(super) fn outputs(
    node: NodeRef<'_>,
    class: ClassId,
    moment: &EngineMoment<'_>,
) -> Result<Outputs, String> {
    let &EngineMoment { time, fired } = moment;
    Ok(match class {
        class::CALCULATOR => calculator::outputs(node)?,
        class::COMPOSE_VEC2F => compose::vec2(node),
        class::COMPOSE_VEC3F => compose::vec3(node),
        class::COMPOSE_VEC4F => compose::vec4(node),
        class::COMPOSE_ROTATION => compose::rotation(node),
        class::COMPOSE_ROTATION_FROM_TO => compose::rotation_from_to(node),
        class::COMPOSE_MATRIX => compose::matrix(node),
        class::DECOMPOSE_VEC2F => compose::parts_of_vec2(node),
        class::DECOMPOSE_VEC3F => compose::parts_of_vec3(node),
        class::DECOMPOSE_VEC4F => compose::parts_of_vec4(node),
        class::DECOMPOSE_ROTATION => compose::parts_of_rotation(node),
        class::DECOMPOSE_MATRIX => compose::parts_of_matrix(node),
        class::TRANSFORM_VEC3F => compose::transformed(node),
        class::INTERPOLATE_FLOAT => interpolate::floats(node),
        class::INTERPOLATE_VEC2F => interpolate::vec2s(node),
        class::INTERPOLATE_VEC3F => interpolate::vec3s(node),
        class::INTERPOLATE_VEC4F => interpolate::vec4s(node),
        class::INTERPOLATE_ROTATION => interpolate::rotations(node),
        class::BOOL_OPERATION => values::bool_operation(node),
        class::SELECT_ONE => values::select_one(node),
        class::GATE => values::gate(node, fired),
        class::CONCATENATE => values::concatenate(node),
        class::ELAPSED_TIME => clocks::elapsed_time(node, time, fired),
        class::TIME_COUNTER => clocks::time_counter(node, time),
        class::COUNTER => clocks::counter(node, fired),
        class::ONE_SHOT => clocks::one_shot(node, time, fired),
        class::ON_OFF => clocks::on_off(fired),
        // A `GlobalField` declares one field. Inventor's clock has this name.
        class::GLOBAL_FIELD if node.value("realTime").is_some() => {
            vec![("realTime", Value::Double(time))]
        }
        class::ROTOR => movers::rotor(node, time),
        class::PENDULUM => movers::pendulum(node, time),
        class::SHUTTLE => movers::shuttle(node, time),
        _ => Vec::new(),
    })
}
