//! The interface through which a scene that plays runs its scripts.

use std::cell::RefCell;
use std::fmt::Debug;
use std::rc::Rc;

use super::world::{Event, World};
use crate::iv::Document;
use crate::snapshot::{BoundNodes, SentEvent};

/// A scene after it played.
#[derive(Debug)]
pub struct Played {
    /// The scene.
    pub document: Document,
    /// The bindable nodes that are bound, if events have changed which.
    pub bound: Option<BoundNodes>,
    /// The events that were sent, if they were to be recorded.
    pub sent: Vec<SentEvent>,
}

/// An engine that runs the programs of `Script` nodes. The crate `ivcam-script` has one for
/// JavaScript.
pub trait ScriptEngine: Debug + Send + Sync {
    /// Returns what `play` makes of a copy of the document. The engine may call it in a thread of
    /// its own, to bound what a hostile program can do; if it fails, the document is returned as
    /// it was, with a warning.
    fn contain(
        &self,
        document: &Document,
        play: Box<dyn FnOnce(Document) -> Played + Send>,
    ) -> Played;

    /// Finds the scripts of a scene and runs their programs, which define functions.
    fn find(&self, world: &Rc<RefCell<World>>) -> Box<dyn Scripts>;
}

/// The scripts of a scene that plays.
pub trait Scripts {
    /// Returns whether any script runs.
    fn any_runs(&self) -> bool;

    /// Calls `initialize` of each script.
    fn initialize(&mut self);

    /// Delivers an event to a script. Returns whether its target is a script that runs.
    fn deliver(&mut self, event: &Event) -> bool;

    /// Calls `eventsProcessed` of the scripts that received events, and `initialize` of those that
    /// are new. Returns whether there were any.
    fn finish_events(&mut self) -> bool;
}
