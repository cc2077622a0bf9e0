//! VRML97's `TimeSensor` (VRML97, 6.50).

use crate::grammar::time_sensor;
use crate::grammar::value::Value;
use crate::iv::NodeRef;

/// The state of a `TimeSensor` while a scene plays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timer {
    /// Whether the sensor runs.
    active: bool,
    /// The number of cycles that were complete when the sensor last sent its time.
    cycle: f64,
    /// Whether an event set the start time. Otherwise a start time of 0 is long ago, because VRML97
    /// counts from 1970.
    set: bool,
}

/// The fields of a `TimeSensor`, in seconds.
#[derive(Clone, Copy, Debug)]
struct Fields {
    start: f64,
    stop: f64,
    cycle: f64,
    loops: bool,
    enabled: bool,
}

impl Fields {
    fn of(node: NodeRef<'_>) -> Self {
        let cycle = node.get(time_sensor::CYCLE_INTERVAL);
        Self {
            start: node.get(time_sensor::START_TIME),
            stop: node.get(time_sensor::STOP_TIME),
            cycle: if cycle > 0.0 { cycle } else { 1.0 },
            loops: node.get(time_sensor::LOOP),
            enabled: node.get(time_sensor::ENABLED),
        }
    }

    /// Returns when the cycle with a number ends.
    fn end(self, cycle: f64) -> f64 {
        self.start + (cycle + 1.0) * self.cycle
    }

    /// Returns whether the stop time has an effect and is reached.
    fn is_stopped(self, now: f64) -> bool {
        self.stop > self.start && now >= self.stop
    }
}

/// The events of a `TimeSensor`, in the order in which it sends them.
pub(super) type TimerEvents = Vec<(&'static str, Value)>;

impl Timer {
    /// Returns whether the sensor runs.
    pub(super) fn is_active(&self) -> bool {
        self.active
    }

    /// Returns the events that the sensor sends at a time.
    pub(super) fn tick(&mut self, node: NodeRef<'_>, now: f64) -> TimerEvents {
        let fields = Fields::of(node);
        if self.active {
            return self.run(fields, now);
        }
        if !self.starts(fields, now) {
            return Vec::new();
        }
        self.active = true;
        self.cycle = ((now - fields.start) / fields.cycle).floor();
        let mut events = vec![
            ("isActive", Value::Bool(true)),
            ("cycleTime", Value::Double(now)),
        ];
        events.extend(moment(fields, now));
        events
    }

    /// Returns whether a sensor that does not run starts at a time.
    fn starts(self, fields: Fields, now: f64) -> bool {
        let was_long_ago = !self.set && fields.start <= 0.0;
        fields.enabled
            && now >= fields.start
            && !fields.is_stopped(now)
            && (fields.loops || (!was_long_ago && now < fields.end(0.0)))
    }

    /// Returns the events of a sensor that runs.
    fn run(&mut self, fields: Fields, now: f64) -> TimerEvents {
        if !fields.enabled {
            self.active = false;
            return vec![("isActive", Value::Bool(false))];
        }
        let mut last = None;
        if fields.is_stopped(now) {
            last = Some(fields.stop);
        }
        if !fields.loops && now >= fields.end(self.cycle) {
            let end = fields.end(self.cycle);
            last = Some(last.map_or(end, |stop| stop.min(end)));
        }
        if let Some(last) = last {
            self.active = false;
            let mut events = moment(fields, last);
            events.push(("isActive", Value::Bool(false)));
            return events;
        }
        let cycle = ((now - fields.start) / fields.cycle).floor();
        let mut events = Vec::new();
        if cycle > self.cycle {
            self.cycle = cycle;
            events.push(("cycleTime", Value::Double(now)));
        }
        events.extend(moment(fields, now));
        events
    }

    /// Returns the first time after `now` at which the sensor starts, ends or, if its cycles are
    /// at least `shortest` long, begins a cycle.
    pub(super) fn next(&self, node: NodeRef<'_>, now: f64, shortest: f64) -> Option<f64> {
        let fields = Fields::of(node);
        let mut times = vec![fields.start, fields.stop];
        if self.active && (!fields.loops || fields.cycle >= shortest) {
            times.push(fields.end(self.cycle));
        }
        let after = times.into_iter().filter(|t| *t > now && t.is_finite());
        after.reduce(f64::min).filter(|_| fields.enabled)
    }

    /// Takes note of an event for a field. Returns whether the field may change: a sensor that runs
    /// ignores changes of its start time and cycle, and a stop time before its start.
    pub(super) fn accepts(&mut self, node: NodeRef<'_>, field: &str, value: &Value) -> bool {
        let stops_early = match value {
            Value::Double(stop) => *stop < Fields::of(node).start,
            _ => false,
        };
        match field {
            "startTime" if !self.active => {
                self.set = true;
                true
            }
            "startTime" | "cycleInterval" => !self.active,
            "stopTime" => !(self.active && stops_early),
            _ => true,
        }
    }
}

/// Returns the fraction and time that a sensor sends at a time. At the end of a cycle the fraction
/// is 1, and not 0.
fn moment(fields: Fields, now: f64) -> TimerEvents {
    let cycles = (now - fields.start) / fields.cycle;
    let fraction = match cycles - cycles.floor() {
        0.0 if now > fields.start => 1.0,
        fraction => fraction,
    };
    vec![
        ("fraction_changed", Value::Float(fraction as f32)),
        ("time", Value::Double(now)),
    ]
}
