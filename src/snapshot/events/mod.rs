//! Delivers VRML97's events up to one time.
//!
//! A `ROUTE` carries a value only when its source sends an event (VRML97, 4.10). Events begin at
//! `TimeSensor`s and at scripts, because there is no user input. Time 0 is when the scene was
//! opened. A scene is played from there to the requested time: scripts are initialized, and time
//! passes in steps that depend only on the scene and on that time, so that the same time always
//! gives the same document.
//!
//! Scripts run only with the feature `scripts`; without it, a warning names each that would run.

mod cascade;
mod play;
mod source;
mod timer;
mod wires;
mod world;

#[cfg(not(feature = "scripts"))]
mod no_scripts;
#[cfg(feature = "scripts")]
mod script;

pub(super) use play::play;

#[cfg(test)]
mod tests;
