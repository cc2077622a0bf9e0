//! The scripts of a scene.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

use ivcam_base::diag::ErrorKind;
use ivcam_inventor::events::{self, Event, ProgramSource, Scripts, World};
use ivcam_inventor::iv::{NodeId, NodeRef, Value};

use super::host::Host;
use super::machine::{Machine, ScriptFailure, ScriptOutputs};
use super::meter::{CREATED_SCRIPT, Meter};

/// The largest number of scripts in a scene. Each needs about 250 kB. Tests reach the limit sooner.
const MAX_SCRIPTS: usize = if cfg!(test) { 20 } else { 500 };

/// The scripts of a scene that run.
#[derive(Debug)]
pub(crate) struct RunningScripts {
    world: Rc<RefCell<World>>,
    meter: Rc<Meter>,
    creations: Rc<Cell<(usize, usize)>>,
    machines: BTreeMap<NodeId, Machine>,
    /// The scripts that received events since `eventsProcessed` was called.
    received: Vec<NodeId>,
    /// The number of nodes of the document whose scripts have been found.
    seen: usize,
    /// The number of scripts that were found.
    found: usize,
    /// Whether it was reported that all scripts stopped.
    is_told: bool,
}

impl RunningScripts {
    /// Returns the scripts of a scene before they run.
    pub(crate) fn find(world: &Rc<RefCell<World>>) -> Self {
        Self {
            world: world.clone(),
            meter: Rc::default(),
            creations: Rc::default(),
            machines: BTreeMap::new(),
            received: Vec::new(),
            seen: 0,
            found: 0,
            is_told: false,
        }
    }

    /// Finds the scripts among the nodes that are new. Runs the program of each, which defines its
    /// functions, and its `initialize`, before the next one: preparing a script takes some 10 ms,
    /// which would be wasted if earlier scripts had used up all instructions. Returns whether there
    /// were any.
    fn begin_new(&mut self) -> bool {
        let is_created = self.seen > 0;
        let (found, seen) = {
            let document = &self.world.borrow().document;
            (events::scripts(document, self.seen), document.nodes.len())
        };
        self.seen = seen;
        let before = self.found;
        for id in found {
            if self.meter.is_used_up() {
                break;
            }
            if self.found >= MAX_SCRIPTS {
                let message =
                    format!("the scene has more than {MAX_SCRIPTS} scripts; the rest is not run");
                self.world.borrow_mut().limit(message);
                break;
            }
            let program = events::source(&self.world.borrow().document, id);
            match program {
                ProgramSource::Nothing => {}
                ProgramSource::Unsupported(reason) => {
                    let message = format!("a `Script` was not run: {reason}");
                    self.world.borrow_mut().warn(id, message).kind = ErrorKind::Unsupported;
                }
                ProgramSource::Program(program) => {
                    self.found += 1;
                    if is_created {
                        self.meter.executed(CREATED_SCRIPT);
                    }
                    if self.add(id, &program) {
                        self.call_each(&[id], "initialize");
                    }
                }
            }
        }
        self.found > before
    }

    /// Adds a script. Returns whether its program ran.
    fn add(&mut self, id: NodeId, program: &str) -> bool {
        let direct = {
            let document = &self.world.borrow().document;
            let direct = NodeRef { document, id }.value("directOutput").cloned();
            direct == Some(Value::Bool(true))
        };
        let host = Rc::new(Host {
            world: self.world.clone(),
            meter: self.meter.clone(),
            id,
            direct,
            creations: self.creations.clone(),
        });
        match Machine::new(&host, program, self.found as u32, events::FRAME) {
            Ok(machine) => {
                self.machines.insert(id, machine);
                true
            }
            Err(failure) => {
                self.report(id, "a `Script` was not run", failure);
                false
            }
        }
    }

    fn call_each(&mut self, ids: &[NodeId], function: &str) {
        for id in ids {
            if let Some(machine) = self.machines.get_mut(id) {
                let result = machine.call(function);
                self.finish(*id, result);
            }
        }
    }

    /// Sends what a script assigned, and reports its failure.
    fn finish(&mut self, id: NodeId, (outputs, failure): (ScriptOutputs, Option<ScriptFailure>)) {
        for (name, value) in outputs {
            self.world.borrow_mut().send(id, &name, &value);
        }
        if let Some(failure) = failure {
            self.report(id, "a script stopped", failure);
        }
    }

    /// Reports a failure. A script that reached a limit does not run again.
    fn report(&mut self, id: NodeId, what: &str, failure: ScriptFailure) {
        let world = &mut *self.world.borrow_mut();
        match failure {
            ScriptFailure::Error(reason) => {
                world.warn(id, format!("{what}: {reason}"));
            }
            ScriptFailure::Limit(reason) if self.meter.is_used_up() => {
                self.machines.clear();
                if !std::mem::replace(&mut self.is_told, true) {
                    let warning = world.warn(id, format!("all scripts stopped: {reason}"));
                    warning.kind = ErrorKind::Limit;
                    warning.help("`--work N` raises the limit");
                }
            }
            ScriptFailure::Limit(reason) => {
                self.machines.remove(&id);
                world.warn(id, format!("{what}: {reason}")).kind = ErrorKind::Limit;
            }
        }
    }
}

impl Scripts for RunningScripts {
    fn any_runs(&self) -> bool {
        !self.machines.is_empty()
    }

    fn initialize(&mut self) {
        self.begin_new();
    }

    fn deliver(&mut self, event: &Event) -> bool {
        let now = self.world.borrow().now;
        let Some(machine) = self.machines.get_mut(&event.to) else {
            return false;
        };
        let result = machine.receive(event, now);
        self.finish(event.to, result);
        if !self.received.contains(&event.to) {
            self.received.push(event.to);
        }
        true
    }

    fn finish_events(&mut self) -> bool {
        let received = std::mem::take(&mut self.received);
        self.call_each(&received, "eventsProcessed");
        let has_grown = self.world.borrow().document.nodes.len() > self.seen;
        let has_begun = has_grown && self.begin_new();
        !received.is_empty() || has_begun
    }
}
