//! Delivers VRML97's events up to one time.
//!
//! A `ROUTE` carries a value only when its source sends an event (VRML97, 4.10). Events begin at
//! `TimeSensor`s and at scripts, because there is no user input. Time 0 is when the scene was
//! opened. A scene is played from there to the requested time: scripts are initialized, and time
//! passes in steps that depend only on the scene and on that time, so that the same time always
//! gives the same document.
//!
//! Scripts run if the options of the snapshot have an engine for them; without one, a warning names
//! each that would run.

mod cascade;
mod engine;
mod no_scripts;
pub mod play;
mod reach;
mod source;
mod timer;
mod wires;
mod world;

pub use engine::{ScriptEngine, Scripts};
pub use play::FRAME;
pub(super) use play::play;
pub use reach::script_input;
pub use source::{ProgramSource, scripts, source};
pub use world::{Event, World};

#[cfg(test)]
mod tests;
