//! Runs the scripts of a scene that plays.
//!
//! Each script has its own `Context` of the JavaScript engine, so that its fields are its globals.
//! `prelude.js` defines the types and the `Browser` object of VRML97, annex C. The host's functions
//! give a script nothing but the scene: no files except through the scene's own loader, no network,
//! no clock and no random numbers but those of the scene.
//!
//! A scene may be hostile. `meter` bounds instructions, strings, lists and nodes, `guard` changes a
//! program so that strings are measured, and the whole scene plays in a thread of its own with a
//! large stack and a deadline.

mod guard;
mod host;
mod machine;
mod meter;
mod places;
mod scripts;
mod thread;
mod values;

pub(super) use scripts::Scripts;
pub(super) use thread::in_own_thread;

#[cfg(test)]
mod tests;
