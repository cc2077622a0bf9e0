//! Plays a scene from its beginning to one time.

use std::cell::RefCell;
use std::rc::Rc;

use super::engine::{ScriptEngine, Scripts};
use super::no_scripts::NoScripts;
use super::source::{self, ProgramSource};
use super::wires::Wires;
use super::world::World;
use crate::iv::{Document, NodeId};

/// The shortest step while scripts run, in seconds: the frames of the browser that a scene's
/// scripts would see.
pub const FRAME: f64 = 1.0 / 25.0;

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

/// Returns the document at a time, after all events until then, or `None` if no event can change
/// it. Warnings are added to the copy's sink.
pub(in crate::snapshot) fn play(
    document: &Document,
    time: f64,
    engine: Option<&'static dyn ScriptEngine>,
) -> Option<Document> {
    let scripts = source::scripts(document, 0);
    let has_program = |id: &NodeId| source::source(document, *id) != ProgramSource::Nothing;
    let has_scripts = scripts.iter().any(has_program);
    if !has_scripts && Wires::of(document).is_empty() {
        return None;
    }
    if let Some(engine) = engine.filter(|_| has_scripts) {
        let play = move |document| play_scene(document, time, Some(engine));
        return Some(engine.contain(document, Box::new(play)));
    }
    Some(play_scene(document.clone(), time, None))
}

/// Plays a scene to a time.
fn play_scene(document: Document, time: f64, engine: Option<&dyn ScriptEngine>) -> Document {
    let world = Rc::new(RefCell::new(World::new(document, time.min(0.0))));
    {
        let mut player = Player {
            scripts: match engine {
                Some(engine) => engine.find(&world),
                None => Box::new(NoScripts::find(&world)),
            },
            world: world.clone(),
        };
        player.scripts.initialize();
        player.deliver_all();
        player.tick();
        player.pass_time(time);
    }
    let world = Rc::into_inner(world)
        .expect("the scripts are gone")
        .into_inner();
    let mut document = world.document;
    document.sink.set_source(None);
    if world.holds_new_nodes {
        document.cut_cycles();
    }
    document
}

/// A scene and its scripts.
struct Player {
    world: Rc<RefCell<World>>,
    scripts: Box<dyn Scripts>,
}

impl Player {
    /// Lets time pass until a time.
    ///
    /// Without scripts only the times at which a sensor starts or ends, and the requested time,
    /// matter: between them a sensor sends a function of the time. A script can depend on all that
    /// it was sent, so with scripts time also passes in frames.
    fn pass_time(&mut self, time: f64) {
        let frame = if self.scripts.any_runs() {
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

    /// Lets the sensors send their events of this time, and then those that these events start.
    fn tick(&mut self) {
        let mut sensors: Vec<NodeId> = self.world.borrow().timers.keys().copied().collect();
        for _ in 0..MAX_CHAIN {
            let mut any = false;
            for id in sensors {
                let events = self.world.borrow_mut().tick(id);
                any |= !events.is_empty();
                for (output, value) in events {
                    self.world.borrow_mut().begin_cascade();
                    self.world.borrow_mut().send(id, output, &value);
                    self.deliver_all();
                }
            }
            if !any {
                return;
            }
            sensors = self.world.borrow().resting_timers();
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
