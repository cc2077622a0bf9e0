//! A scene that plays: its document, routes, timers and the events that wait.

use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Severity, Span};
use ivcam_base::work::{Budget, spend};

use super::binding::BindingStacks;
use super::log::EventLog;
use super::picker::ShapePicker;
use super::pointing::Grab;
use super::survey::WorldSurvey;
use super::timer::{Timer, TimerEvents, is_time_dependent};
use super::viewer_sensor::{EventOut, ViewerSensor};
use super::wires::{End, Wires};
use crate::iv::{Document, NodeId, NodeRef, Value};
use crate::pose::CameraPose;
use crate::traversal::Leading;

/// The largest number of events that are delivered. It bounds the time for hostile files: 2 million
/// events take about 2 seconds. docs/decisions/0018-how-a-scene-plays.md states it.
const MAX_EVENTS: usize = 2_000_000;

/// The steps of work of an event, which takes about 1 µs.
const EVENT_STEPS: u64 = 200;

/// An event on its way to a node.
#[derive(Debug)]
pub struct Event {
    /// The node that receives the event.
    pub to: NodeId,
    /// The name of the input that receives it.
    pub input: Box<str>,
    /// The value that it carries.
    pub value: Value,
}

/// A scene that plays.
#[derive(Debug)]
pub struct World {
    /// The scene as the events have left it so far, with the messages about it in its sink.
    pub document: Document,
    /// The time in seconds since the scene was opened.
    pub now: f64,
    /// The routes that carry events.
    pub wires: Wires,
    /// The events that wait, in the order in which they were sent.
    queue: VecDeque<Event>,
    /// The events that nodes have sent since the last event from outside. Each is sent once, which
    /// ends loops of routes (VRML97, 4.10.4).
    sent: HashSet<End>,
    /// The state of each time-dependent node.
    pub timers: BTreeMap<NodeId, Timer>,
    /// The state of each sensor that depends on the viewer.
    pub(super) viewer_sensors: BTreeMap<NodeId, ViewerSensor>,
    /// The bindable nodes that were bound.
    pub(super) binding: BindingStacks,
    /// The viewer, if it is not at the bound `Viewpoint`.
    pub(super) viewer: Option<CameraPose>,
    /// The width of the viewer's picture over its height.
    pub(super) aspect: f64,
    /// Where shapes are, if the program can tell.
    pub(super) picker: Option<Arc<dyn ShapePicker>>,
    /// What the pointer has pressed and not released.
    pub(super) grabs: Vec<Grab>,
    /// The nodes that lead to sensors and bindable nodes.
    pub(super) leading: Leading,
    /// The outputs that wait to begin a cascade each.
    pub(super) cascades: VecDeque<EventOut>,
    /// The last value of each output, if there are scripts, which can read them.
    pub(super) outputs: Option<HashMap<End, Value>>,
    /// The events that were sent, if they are recorded.
    pub(super) log: Option<EventLog>,
    /// The number of events that were delivered.
    delivered: usize,
    /// Whether an event changed which nodes a field holds.
    pub holds_new_nodes: bool,
}

impl World {
    /// Creates a scene that is about to play.
    pub(super) fn new(document: Document, now: f64) -> Self {
        let leading = WorldSurvey::leading(&document);
        let survey = WorldSurvey::of(&document, now, None, &leading);
        let mut world = Self {
            wires: Wires::of(&document),
            log: None,
            outputs: None,
            document,
            now,
            viewer_sensors: BTreeMap::new(),
            binding: BindingStacks::new(survey.first),
            viewer: None,
            aspect: 1.0,
            picker: None,
            grabs: Vec::new(),
            leading,
            cascades: VecDeque::new(),
            queue: VecDeque::new(),
            sent: HashSet::new(),
            timers: BTreeMap::new(),
            delivered: 0,
            holds_new_nodes: false,
        };
        world.find_timers(0);
        world.find_viewer_sensors(0);
        world
    }

    /// Finds the time-dependent nodes among those of the arena from an index on.
    pub fn find_timers(&mut self, first: usize) {
        for index in first..self.document.nodes.len() {
            let id = NodeId(index as u32);
            let node = NodeRef {
                document: &self.document,
                id,
            };
            if is_time_dependent(node.class_id()) && !self.document.is_template(id) {
                self.timers.insert(id, Timer::default());
            }
        }
    }

    /// Sends an event along its routes. If the node already sent this event in the same cascade,
    /// nothing happens. `output` is the name that `output_name` returns.
    pub fn send(&mut self, from: NodeId, output: &str, value: &Value) {
        let end = (from, Box::<str>::from(output));
        // The value of a field is in the field.
        if self.outputs.is_some() && self.output_type(from, output).is_some() {
            let outputs = self.outputs.get_or_insert_default();
            outputs.insert(end.clone(), value.clone());
        }
        if !self.sent.insert(end.clone()) {
            return;
        }
        self.log(from, output, value);
        for (to, input) in self.wires.targets(&end) {
            self.queue.push_back(Event {
                to: *to,
                input: input.clone(),
                value: value.clone(),
            });
        }
    }

    /// Returns the value that an output had last, if scripts may ask for it.
    pub(super) fn last_output(&self, end: &End) -> Option<Value> {
        self.outputs.as_ref()?.get(end).cloned()
    }

    /// Adds an event that waits.
    pub fn post(&mut self, event: Event) {
        self.queue.push_back(event);
    }

    /// Begins a cascade: every node may send each of its events again.
    pub(super) fn begin_cascade(&mut self) {
        self.sent.clear();
    }

    /// Returns the next event that waits. Beyond the limit of events the rest is left out.
    pub(super) fn next_event(&mut self) -> Option<Event> {
        if self.delivered >= MAX_EVENTS && !self.queue.is_empty() {
            self.queue.clear();
            self.limit(format!(
                "the scene sends more than {MAX_EVENTS} events; the rest is left out"
            ));
        }
        let event = self.queue.pop_front()?;
        if let Err(cut) = spend(EVENT_STEPS) {
            self.queue.clear();
            let warning = Budget::current().warning(cut);
            self.document.sink.add(*warning);
            return None;
        }
        self.delivered += 1;
        Some(event)
    }

    /// Returns the events that a time-dependent node sends now.
    pub(super) fn tick(&mut self, id: NodeId) -> TimerEvents {
        let node = NodeRef {
            document: &self.document,
            id,
        };
        let timer = self.timers.get_mut(&id);
        timer.map_or_else(Vec::new, |timer| timer.tick(node, self.now))
    }

    /// Returns the first time after now at which a pressed pointer moves, or a time-dependent node
    /// starts, ends or begins a cycle of at least `shortest` seconds.
    pub(super) fn next_time(&self, shortest: f64) -> Option<f64> {
        let times = self.timers.iter().filter_map(|(&id, timer)| {
            let document = &self.document;
            timer.next(NodeRef { document, id }, self.now, shortest)
        });
        let moves = self.grabs.iter().map(|grab| grab.next_time(self.now));
        times.chain(moves).reduce(f64::min)
    }

    /// Returns whether the time of a sensor goes to a time-dependent node, by routes.
    pub(super) fn times_sensors_by_time(&self) -> bool {
        let sends_time = |(node, event): &End| {
            self.timers.contains_key(node) && matches!(&**event, "time" | "fraction_changed")
        };
        let is_timer = |node: NodeId| self.timers.contains_key(&node);
        self.wires.lead(sends_time, is_timer)
    }

    /// Adds a warning about a node.
    pub fn warn(&mut self, node: NodeId, message: String) -> &mut Diagnostic {
        let data = &self.document.nodes[node.0 as usize];
        let (span, source): (Span, _) = (data.span, usize::from(data.source));
        let source = self.document.sources.get(source).cloned();
        self.document.sink.set_source(source);
        self.document.sink.warn(span, message)
    }

    /// Adds a note about a node.
    pub fn note(&mut self, node: NodeId, message: String) {
        let data = &self.document.nodes[node.0 as usize];
        let (span, source): (Span, _) = (data.span, usize::from(data.source));
        let source = self.document.sources.get(source).cloned();
        self.document.sink.set_source(source);
        self.document.sink.note(span, message);
    }

    /// Adds a warning that a limit was reached.
    pub fn limit(&mut self, message: String) {
        let warning = Diagnostic::beyond_limit(message).at_most(Severity::Warning);
        self.document.sink.add(*warning);
    }
}
