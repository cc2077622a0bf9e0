//! Inventor's engines that depend on the time and on triggers.

use super::outputs::{Outputs, Pulses};
use crate::grammar::value::{Seconds, Trigger, Value};
use crate::grammar::{Field, counter, elapsed_time, on_off, one_shot, time_counter};
use crate::iv::NodeRef;

/// Returns the pulses of a trigger.
type Fired<'a> = &'a dyn Fn(Field<Trigger>) -> Pulses;

/// Computes an `ElapsedTime`: the time since its last reset.
pub(super) fn elapsed_time(node: NodeRef<'_>, time: f64, fired: Fired<'_>) -> Outputs {
    let runs = node.get(elapsed_time::ON) && !node.get(elapsed_time::PAUSE);
    let since = time_in(node, elapsed_time::TIME_IN, time) - fired(elapsed_time::RESET).last;
    let speed = f64::from(node.get(elapsed_time::SPEED));
    let elapsed = if runs { speed * since } else { 0.0 };
    vec![("timeOut", Value::Double(elapsed))]
}

/// Returns the value of a connected `timeIn`. Without a connection it is the present time, even if
/// the file states a value.
fn time_in(node: NodeRef<'_>, field: Field<Seconds>, time: f64) -> f64 {
    let mut entries = node.data().fields.iter();
    let joined = node.class_id() == Some(field.class)
        && entries.any(|f| f.connection.is_some() && f.index == field.index);
    if joined { node.get(field) } else { time }
}

/// An arithmetic series from `min` to `max` by `step`.
struct ClockSeries {
    min: i64,
    max: i64,
    step: i64,
}

impl ClockSeries {
    /// Returns the number of values, or `None` if the steps do not lead from `min` to `max`.
    fn count(&self) -> Option<i64> {
        let span = self.max - self.min;
        let leads = self.step != 0 && span.signum() * self.step.signum() >= 0;
        leads.then(|| span / self.step + 1)
    }

    /// Returns the value at an index.
    fn at(&self, place: i64) -> Value {
        Value::Int(i32::try_from(self.min + place * self.step).unwrap_or(i32::MAX))
    }
}

/// Computes a `TimeCounter`, which counts from `min` to `max` by `step` once in 1/frequency
/// seconds. `duty` weights the duration of each count.
pub(super) fn time_counter(node: NodeRef<'_>, time: f64) -> Outputs {
    let series = ClockSeries {
        min: node.get(time_counter::MIN).into(),
        max: node.get(time_counter::MAX).into(),
        step: node.get(time_counter::STEP).into(),
    };
    let count = series.count().filter(|_| node.get(time_counter::ON));
    let place = count.map_or(0, |count| {
        let cycles = cycles(node, time);
        place_in_round(node.get(time_counter::DUTY), cycles - cycles.floor(), count)
    });
    vec![("output", series.at(place))]
}

/// Returns the index, of `count` values, at a phase of the cycle from 0 to 1.
fn place_in_round(duty: &[f32], phase: f64, count: i64) -> i64 {
    let total: f64 = duty.iter().map(|&d| f64::from(d.max(0.0))).sum();
    if duty.len() as i64 == count && count > 1 && total > 0.0 {
        let mut passed = 0.0;
        let place = duty.iter().position(|&d| {
            passed += f64::from(d.max(0.0)) / total;
            phase < passed
        });
        place.map_or(count - 1, |p| p as i64)
    } else {
        ((phase * count as f64) as i64).clamp(0, count - 1)
    }
}

/// Returns the number of cycles of a `TimeCounter` since time 0.
fn cycles(node: NodeRef<'_>, time: f64) -> f64 {
    let frequency = f64::from(node.get(time_counter::FREQUENCY));
    time_in(node, time_counter::TIME_IN, time) * frequency
}

/// Returns the pulses of the `syncOut` of a `TimeCounter`, one for each complete cycle.
pub(super) fn rounds(node: NodeRef<'_>, time: f64) -> Pulses {
    let cycles = cycles(node, time);
    let whole = cycles.floor();
    if !(whole > 0.0) || !node.get(time_counter::ON) {
        return Pulses::default();
    }
    Pulses {
        count: whole as u64,
        last: time_in(node, time_counter::TIME_IN, time) * (whole / cycles),
    }
}

/// Computes a `Counter`, which steps once for each trigger and starts again after its last value.
pub(super) fn counter(node: NodeRef<'_>, fired: Fired<'_>) -> Outputs {
    let series = ClockSeries {
        min: node.get(counter::MIN).into(),
        max: node.get(counter::MAX).into(),
        step: node.get(counter::STEP).into(),
    };
    let steps = fired(counter::TRIGGER).count;
    let place = series.count().map_or(0, |n| (steps % n as u64) as i64);
    vec![("output", series.at(place))]
}

/// Computes a `OneShot`, which runs for `duration` from its last trigger. With `HOLD_FINAL` it
/// keeps its last values.
pub(super) fn one_shot(node: NodeRef<'_>, time: f64, fired: Fired<'_>) -> Outputs {
    let trigger = fired(one_shot::TRIGGER);
    let duration = node.get(one_shot::DURATION);
    let started = trigger.count > 0 && !node.get(one_shot::DISABLE);
    let since = time_in(node, one_shot::TIME_IN, time) - trigger.last;
    let active = started && since < duration;
    let holds = node.get(one_shot::FLAGS) & one_shot::FLAGS_HOLD_FINAL != 0;
    let shown = match (started, active) {
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

/// Computes an `OnOff`, which triggers turn on, turn off or toggle.
pub(super) fn on_off(fired: Fired<'_>) -> Outputs {
    let (on, off) = (fired(on_off::ON), fired(on_off::OFF));
    let turned_on = on.count > 0 && (off.count == 0 || on.last >= off.last);
    let is_on = turned_on != (fired(on_off::TOGGLE).count % 2 == 1);
    vec![("isOn", Value::Bool(is_on)), ("isOff", Value::Bool(!is_on))]
}
