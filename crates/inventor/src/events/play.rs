//! Plays a scene from its beginning to one time.

use std::cell::RefCell;
use std::collections::{HashMap, VecDeque};
use std::rc::Rc;

use super::action::Action;
use super::engine::{Played, Scripts};
use super::log::EventLog;
use super::no_scripts::NoScripts;
use super::options::SnapshotOptions;
use super::source::{self, ProgramSource};
use super::timer::FRAME;
use super::viewer_sensor::EventOut;
use super::wires::Wires;
use super::world::World;
use crate::iv::{Document, NodeId};

/// The number of frames from the beginning to the requested time, at most. A longer time has longer
/// frames.
const MAX_FRAMES: f64 = 1_000.0;

/// The number of times at which time passes, at most, with the times at which sensors start and
/// end.
const MAX_TIMES: usize = 10_000;

/// The number of sensors that can start one another at the same time. It ends circles of sensors.
/// No search is recorded: `a_sensor_starts_another_when_it_begins_a_cycle_or_ends` tests a chain of
/// two.
const MAX_CHAIN: usize = 16;

/// Returns the document at the time of the options, after all events until then, or `None` if no
/// event can change it. Warnings are added to the copy's sink.
pub(super) fn play(document: &Document, options: &SnapshotOptions) -> Option<Played> {
    let scripts = source::scripts(document, 0);
    let has_program = |id: &NodeId| source::source(document, *id) != ProgramSource::Nothing;
    let has_scripts = scripts.iter().any(has_program);
    if !has_scripts && options.actions.is_empty() && Wires::of(document).is_empty() {
        return None;
    }
    let mut options = options.clone();
    options.time = options.moment();
    options.actions.sort_by(|a, b| a.time.total_cmp(&b.time));
    options.scripts = options.scripts.filter(|_| has_scripts);
    if let Some(engine) = options.scripts {
        let play = move |document| play_scene(document, options);
        return Some(engine.contain(document, Box::new(play)));
    }
    Some(play_scene(document.clone(), options))
}

/// Plays a scene to the time of the options.
fn play_scene(document: Document, options: SnapshotOptions) -> Played {
    let mut world = World::new(document, options.time.min(0.0));
    (world.viewer, world.aspect) = (options.viewer, options.aspect.unwrap_or(1.0));
    world.picker = options.picker;
    world.log = options.log.then(|| EventLog::new(&world.document));
    world.outputs = options.scripts.map(|_| HashMap::new());
    let world = Rc::new(RefCell::new(world));
    {
        let mut player = Player {
            actions: options.actions.into(),
            scripts: match options.scripts {
                Some(engine) => engine.find(&world),
                None => Box::new(NoScripts::find(&world)),
            },
            world: world.clone(),
        };
        player.world.borrow_mut().announce_first();
        player.scripts.initialize();
        player.deliver_all();
        player.tick();
        player.pass_time(options.time);
    }
    let world = Rc::into_inner(world)
        .expect("the scripts are gone")
        .into_inner();
    let mut document = world.document;
    document.sink.set_source(None);
    if world.holds_new_nodes {
        document.cut_cycles();
    }
    Played {
        document,
        bound: world.binding.bound(),
        sent: world.log.map(|log| log.sent).unwrap_or_default(),
    }
}

/// A scene and its scripts.
struct Player {
    /// What a user still does, in the order of time.
    actions: VecDeque<Action>,
    world: Rc<RefCell<World>>,
    scripts: Box<dyn Scripts>,
}

impl Player {
    /// Lets time pass until a time.
    ///
    /// Without scripts only the times at which a sensor starts or ends, and the requested time,
    /// matter: between them a sensor sends a function of the time. A script can depend on all that
    /// it was sent, and a sensor that another's time starts depends on when it was sent, so with
    /// them time also passes in frames.
    fn pass_time(&mut self, time: f64) {
        let depends_on_frames = self.scripts.any_runs() || {
            let world = self.world.borrow();
            !world.viewer_sensors.is_empty() || world.times_sensors_by_time()
        };
        let frame = if depends_on_frames {
            FRAME.max(time / MAX_FRAMES)
        } else {
            f64::INFINITY
        };
        let shortest = FRAME.max(time / MAX_FRAMES);
        let mut frames = 0.0;
        let mut times = 0;
        loop {
            let now = self.world.borrow().now;
            if now >= time {
                return;
            }
            let mut next = time;
            if frame.is_finite() {
                while frames * frame <= now {
                    frames += 1.0;
                }
                next = next.min(frames * frame);
            }
            if let Some(sensor) = self.world.borrow().next_time(shortest) {
                next = next.min(sensor);
            }
            if let Some(action) = self.actions.front() {
                next = next.min(action.time.max(now));
            }
            times += 1;
            if times >= MAX_TIMES && next < time {
                next = time;
                let message = format!(
                    "sensors start and end more than {MAX_TIMES} times; the rest is left out"
                );
                self.world.borrow_mut().limit(message);
            }
            self.world.borrow_mut().now = next;
            self.tick();
        }
    }

    /// Lets the user act and the sensors send their events of this time, and then those that these
    /// events start or end.
    fn tick(&mut self) {
        self.act();
        for _ in 0..MAX_CHAIN {
            let mut any = false;
            let sensors: Vec<NodeId> = self.world.borrow().timers.keys().copied().collect();
            for id in sensors {
                let events = self.world.borrow_mut().tick(id);
                any |= !events.is_empty();
                self.begin_cascades(events.into_iter().map(|(name, value)| (id, name, value)));
            }
            let seen = self.world.borrow_mut().look();
            any |= !seen.is_empty();
            self.begin_cascades(seen);
            if !any {
                return;
            }
        }
    }

    /// Does what the user does up to now.
    fn act(&mut self) {
        self.then(World::move_pointers);
        let now = self.world.borrow().now;
        let is_due = |action: &Action| action.time <= now;
        while self.actions.front().is_some_and(is_due) {
            let Some(action) = self.actions.pop_front() else {
                return;
            };
            self.then(|world| world.act(&action));
            self.then(World::move_pointers);
        }
    }

    /// Changes the world, and delivers the events and then the outputs that wait.
    fn then(&mut self, change: impl FnOnce(&mut World)) {
        self.world.borrow_mut().begin_cascade();
        change(&mut self.world.borrow_mut());
        self.deliver_all();
        let waiting = std::mem::take(&mut self.world.borrow_mut().cascades);
        self.begin_cascades(waiting);
    }

    /// Begins a cascade with each of some outputs.
    fn begin_cascades(&mut self, outputs: impl IntoIterator<Item = EventOut>) {
        for (id, output, value) in outputs {
            self.world.borrow_mut().begin_cascade();
            self.world.borrow_mut().send(id, output, &value);
            self.deliver_all();
        }
    }

    /// Delivers the events that wait, and those that they cause.
    fn deliver_all(&mut self) {
        loop {
            loop {
                let event = self.world.borrow_mut().next_event();
                let Some(event) = event else {
                    break;
                };
                if !self.scripts.deliver(&event) {
                    self.world.borrow_mut().deliver(&event);
                }
            }
            if !self.scripts.finish_events() {
                return;
            }
        }
    }
}
