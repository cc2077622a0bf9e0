//! Time-dependent nodes: `TimeSensor` (VRML97, 6.50), and whether an `AudioClip` (6.2) or a
//! `MovieTexture` (6.28) plays; with the pauses of X3D (ISO/IEC 19775-1, 8.2.4).

use crate::grammar::value::Value;
use crate::grammar::{ClassId, audio_clip, class, movie_texture, time_sensor};
use crate::iv::NodeRef;

/// The state of a time-dependent node while a scene plays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timer {
    /// Whether the sensor runs.
    active: bool,
    /// The number of the cycle in which the sensor last sent its time.
    cycle: f64,
    /// When it last sent its time.
    sent: Option<f64>,
    /// When the sensor started.
    begun: f64,
    /// Since when it is paused.
    paused: Option<f64>,
    /// How long it was paused since it started.
    delay: f64,
    /// Whether events set the times in [`TIMES`]. A time that the file states counts from 1970.
    set: [bool; 4],
}

/// The fields with the times at which a time-dependent node starts, stops, pauses and resumes.
const TIMES: [&str; 4] = ["startTime", "stopTime", "pauseTime", "resumeTime"];

/// The seconds from 1970, from when a file counts, until the scene is opened. Every cycle counts as
/// a part of it, so that a sensor that has always run begins one when the scene is opened. A later
/// time of a file is not reached.
const OPENING: f64 = 1e9;

/// The shortest step while scripts run or the pointer moves, in seconds: the frames of the browser
/// that a scene's scripts would see.
pub const FRAME: f64 = 1.0 / 25.0;

/// The length of an `AudioClip` or a `MovieTexture` in seconds. Its file is not read, so one that
/// does not loop plays until its stop time; one that the file started long ago has ended.
const CLIP: f64 = 1e6;

/// Returns whether a class of node plays a file.
pub(super) fn is_clip(class: Option<ClassId>) -> bool {
    matches!(class, Some(class::AUDIO_CLIP | class::MOVIE_TEXTURE))
}

/// Returns whether a class of node is time-dependent.
pub(super) fn is_time_dependent(class: Option<ClassId>) -> bool {
    class == Some(class::TIME_SENSOR) || is_clip(class)
}

/// The fields of a time-dependent node, in seconds since the scene was opened.
#[derive(Clone, Copy, Debug)]
struct Fields {
    start: f64,
    stop: f64,
    pause: f64,
    resume: f64,
    /// A time at which a cycle begins.
    phase: f64,
    cycle: f64,
    loops: bool,
    enabled: bool,
}

impl Fields {
    fn of(node: NodeRef<'_>, timer: Timer) -> Self {
        let (times, cycle, loops, enabled) = match node.class_id() {
            Some(class::AUDIO_CLIP) => (
                [
                    audio_clip::START_TIME,
                    audio_clip::STOP_TIME,
                    audio_clip::PAUSE_TIME,
                    audio_clip::RESUME_TIME,
                ]
                .map(|time| node.get(time)),
                CLIP,
                node.get(audio_clip::LOOP),
                true,
            ),
            Some(class::MOVIE_TEXTURE) => (
                [
                    movie_texture::START_TIME,
                    movie_texture::STOP_TIME,
                    movie_texture::PAUSE_TIME,
                    movie_texture::RESUME_TIME,
                ]
                .map(|time| node.get(time)),
                CLIP,
                node.get(movie_texture::LOOP),
                true,
            ),
            _ => (
                [
                    time_sensor::START_TIME,
                    time_sensor::STOP_TIME,
                    time_sensor::PAUSE_TIME,
                    time_sensor::RESUME_TIME,
                ]
                .map(|time| node.get(time)),
                node.get(time_sensor::CYCLE_INTERVAL),
                node.get(time_sensor::LOOP),
                node.get(time_sensor::ENABLED),
            ),
        };
        let since_opening = |i: usize| match times[i] {
            time if timer.set[i] => time,
            time if time < OPENING => time - OPENING,
            _ => f64::INFINITY,
        };
        let [start, stop, pause, resume] = [0, 1, 2, 3].map(since_opening);
        Self {
            start,
            stop,
            pause,
            resume,
            phase: times[0] + timer.delay,
            cycle: if cycle > 0.0 { cycle } else { 1.0 },
            loops,
            enabled,
        }
    }

    /// Returns when the cycle with a number ends.
    fn end(self, cycle: f64) -> f64 {
        self.phase + (cycle + 1.0) * self.cycle
    }

    /// Returns the number of the cycle at a time.
    ///
    /// The quotient may be rounded across a whole number, so the number is corrected to the one
    /// whose cycle begins and ends, as [`Self::end`] rounds, around the time.
    fn cycle_at(self, now: f64) -> f64 {
        let cycle = ((now - self.phase) / self.cycle).floor();
        if now >= self.end(cycle) {
            cycle + 1.0
        } else if now < self.end(cycle - 1.0) {
            cycle - 1.0
        } else {
            cycle
        }
    }

    /// Returns whether the stop time has an effect and is reached.
    fn is_stopped(self, now: f64) -> bool {
        self.stop > self.start && now >= self.stop
    }
}

/// The events of a time-dependent node, in the order in which it sends them.
pub(super) type TimerEvents = Vec<(&'static str, Value)>;

impl Timer {
    /// Returns the events that the node sends at a time. A node that was asked at this time already
    /// sends only that it starts or ends.
    pub(super) fn tick(&mut self, node: NodeRef<'_>, now: f64) -> TimerEvents {
        let mut events = self.sensor_events(node, now);
        if is_clip(node.class_id()) {
            events.retain(|(output, _)| matches!(*output, "isActive" | "isPaused"));
        } else if node.document.is_x3d()
            && let Some((_, Value::Double(time))) = events.iter().find(|(name, _)| *name == "time")
        {
            let elapsed = time - self.begun - self.delay;
            events.push(("elapsedTime", Value::Double(elapsed)));
        }
        events
    }

    /// Returns the events that a `TimeSensor` with the fields of the node sends at a time.
    fn sensor_events(&mut self, node: NodeRef<'_>, now: f64) -> TimerEvents {
        if self.active {
            return self.run(Fields::of(node, *self), now);
        }
        self.delay = 0.0;
        let fields = Fields::of(node, *self);
        if !self.starts(fields, now) {
            return Vec::new();
        }
        self.active = true;
        self.begun = now;
        self.sent = Some(now);
        self.cycle = fields.cycle_at(now);
        let mut events = vec![
            ("isActive", Value::Bool(true)),
            ("cycleTime", Value::Double(now)),
        ];
        events.extend(moment(fields, now, 0.0));
        events
    }

    /// Returns whether a sensor that does not run starts at a time.
    fn starts(self, fields: Fields, now: f64) -> bool {
        fields.enabled
            && now >= fields.start
            && !fields.is_stopped(now)
            && (fields.loops || now < fields.start + fields.cycle)
    }

    /// Returns when a sensor that runs ends, if that is now or was before.
    fn last(self, fields: Fields, now: f64) -> Option<f64> {
        let mut last = None;
        if !fields.enabled {
            last = Some(now);
        }
        if fields.is_stopped(now) {
            last = Some(last.map_or(fields.stop, |now| now.min(fields.stop)));
        }
        if !fields.loops && self.paused.is_none() && now >= fields.end(self.cycle) {
            let end = fields.end(self.cycle);
            last = Some(last.map_or(end, |stop| stop.min(end)));
        }
        last
    }

    /// Returns the events of a sensor that runs or is paused.
    fn run(&mut self, mut fields: Fields, now: f64) -> TimerEvents {
        let has_sent = self.sent.replace(now) == Some(now);
        let mut events = Vec::new();
        if let Some(last) = self.last(fields, now) {
            let was_paused = self.paused.take().is_some();
            if !has_sent && !was_paused {
                events.extend(moment(fields, last, 1.0));
            }
            events.push(("isActive", Value::Bool(false)));
            if was_paused {
                events.push(("isPaused", Value::Bool(false)));
            }
            self.active = false;
            return events;
        }
        if let Some(since) = self.paused {
            if fields.resume <= fields.pause || now < fields.resume {
                return events;
            }
            self.paused = None;
            self.delay += now - since;
            fields.phase += now - since;
            events.push(("isPaused", Value::Bool(false)));
        }
        if !has_sent {
            let cycle = fields.cycle_at(now);
            if cycle > self.cycle {
                self.cycle = cycle;
                events.push(("cycleTime", Value::Double(now)));
            }
            events.extend(moment(fields, now, 1.0));
        }
        if fields.pause > fields.resume && now >= fields.pause {
            self.paused = Some(now);
            events.push(("isPaused", Value::Bool(true)));
        }
        events
    }

    /// Returns the first time after `now` at which the sensor starts, ends, pauses, resumes or, if
    /// its cycles are at least `shortest` long, begins a cycle.
    pub(super) fn next(&self, node: NodeRef<'_>, now: f64, shortest: f64) -> Option<f64> {
        let fields = Fields::of(node, *self);
        let mut times = vec![fields.start, fields.stop, fields.pause, fields.resume];
        if self.active && self.paused.is_none() && (!fields.loops || fields.cycle >= shortest) {
            times.push(fields.end(self.cycle));
        }
        let after = times.into_iter().filter(|t| *t > now && t.is_finite());
        after.reduce(f64::min).filter(|_| fields.enabled)
    }

    /// Takes note of an event for a field. Returns whether the field may change: a sensor that runs
    /// ignores changes of its start time and cycle, and a stop time before its start.
    pub(super) fn accepts(&mut self, node: NodeRef<'_>, field: &str, value: &Value) -> bool {
        let stops_early = match value {
            Value::Double(stop) => *stop < Fields::of(node, *self).start,
            _ => false,
        };
        let accepts = match field {
            "startTime" | "cycleInterval" => !self.active,
            "stopTime" => !(self.active && stops_early),
            _ => true,
        };
        if let Some(i) = TIMES.iter().position(|time| *time == field) {
            self.set[i] |= accepts;
        }
        accepts
    }
}

/// Returns the fraction and time that a sensor sends at a time. Where one cycle ends and the next
/// begins the fraction is `between`: 0 when the sensor starts, and 1 while it runs.
fn moment(fields: Fields, now: f64, between: f64) -> TimerEvents {
    let cycle = fields.cycle_at(now);
    let fraction = if now == fields.end(cycle - 1.0) {
        between
    } else {
        ((now - fields.phase) / fields.cycle - cycle).clamp(0.0, 1.0)
    };
    vec![
        ("fraction_changed", Value::Float(fraction as f32)),
        ("time", Value::Double(now)),
    ]
}
