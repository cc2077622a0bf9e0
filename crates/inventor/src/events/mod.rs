//! Delivers VRML97's events up to one time.
//!
//! A `ROUTE` carries a value only when its source sends an event (VRML97, 4.10). Events begin at
//! `TimeSensor`s, at sensors that depend on the viewer, at nodes that are bound, at scripts, and at
//! what a user does ([`Action`]). Time 0 is when the scene was opened. A scene is played from there
//! to the requested time: scripts are initialized, and time passes in steps that depend only on the
//! scene and on that time, so that the same time always gives the same document.
//!
//! Scripts run if the options of the snapshot have an engine for them; without one, a warning names
//! each that would run.

mod action;
mod bind;
mod binding;
mod cascade;
mod collision;
mod drag;
mod engine;
mod log;
mod no_scripts;
mod options;
mod picker;
pub mod play;
mod pointer;
mod pointer_path;
mod pointing;
mod reach;
mod source;
mod survey;
mod take;
mod timer;
mod viewer;
mod viewer_sensor;
mod wires;
mod world;

pub use action::{Action, ActionKind};
pub use collision::hears_collisions;
pub use engine::{Played, ScriptEngine, Scripts};
pub use options::SnapshotOptions;
pub use picker::{ShapeHit, ShapePicker};
pub use pointer::PointerTarget;
pub use reach::script_input;
pub use source::{ProgramSource, scripts, source};
pub use survey::depends_on_viewer;
pub use timer::FRAME;
pub use world::{Event, World};

#[cfg(test)]
mod tests;
