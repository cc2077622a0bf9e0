//! Takes the place of the engine that runs scripts if a snapshot has none.

use std::cell::RefCell;
use std::rc::Rc;

use ivcam_base::diag::ErrorKind;

use super::engine::Scripts;
use super::source::{self, ProgramSource};
use super::world::{Event, World};

/// The scripts of a scene, none of which runs.
#[derive(Debug)]
pub(super) struct NoScripts;

impl NoScripts {
    /// Warns about each script that has a program.
    pub(super) fn find(world: &Rc<RefCell<World>>) -> Self {
        let world = &mut *world.borrow_mut();
        for id in source::scripts(&world.document, 0) {
            let (reason, help) = match source::source(&world.document, id) {
                ProgramSource::Nothing => continue,
                ProgramSource::Unsupported(reason) => (reason, None),
                ProgramSource::Program(text) if text.trim().is_empty() => continue,
                ProgramSource::Program(_) => {
                    let reason = "this program is built without the feature `scripts`".to_owned();
                    let help = "`cargo install --path . --features viewer,scripts` adds it";
                    (reason, Some(help))
                }
            };
            let warning = world.warn(id, format!("a `Script` was not run: {reason}"));
            warning.kind = ErrorKind::Unsupported;
            if let Some(help) = help {
                warning.help(help);
            }
        }
        Self
    }
}

impl Scripts for NoScripts {
    fn any_runs(&self) -> bool {
        false
    }

    fn initialize(&mut self) {}

    fn deliver(&mut self, _: &Event) -> bool {
        false
    }

    fn finish_events(&mut self) -> bool {
        false
    }
}
