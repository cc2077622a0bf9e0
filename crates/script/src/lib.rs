#![doc = include_str!("../README.md")]
//!
//! # How it works
//!
//! Each script has its own `Context` of the JavaScript engine, so that its fields are its globals.
//! `prelude.js` defines the types and the `Browser` object of VRML97, annex C. The host's functions
//! give a script nothing but the scene: no files except through the scene's own loader, no network,
//! no clock and no random numbers but those of the scene.
//!
//! A scene may be hostile. `meter` bounds instructions, strings, lists and nodes, `guard` changes a
//! program so that strings are measured, and the whole scene plays in a thread of its own with a
//! large stack and a deadline.

#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub)]

mod guard;
mod host;
mod machine;
mod meter;
mod places;
mod scripts;
mod thread;
mod values;

use std::cell::RefCell;
use std::rc::Rc;

use ivcam_inventor::events::{Played, ScriptEngine, Scripts, World};
use ivcam_inventor::iv::Document;

use scripts::RunningScripts;

/// The engine that runs scripts in JavaScript. It is set in the options of a snapshot.
#[derive(Clone, Copy, Debug, Default)]
pub struct JavaScript;

impl ScriptEngine for JavaScript {
    fn contain(
        &self,
        document: &Document,
        play: Box<dyn FnOnce(Document) -> Played + Send>,
    ) -> Played {
        thread::in_own_thread(document, play)
    }

    fn find(&self, world: &Rc<RefCell<World>>) -> Box<dyn Scripts> {
        Box::new(RunningScripts::find(world))
    }
}

#[cfg(test)]
mod tests;
