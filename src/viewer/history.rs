//! Undo: the earlier setups, one per gesture.

use super::setup::Setup;

/// The time in seconds within which changes of one control are one step.
const TOGETHER: f64 = 0.5;
/// The largest number of steps that are kept. It bounds memory.
const MOST: usize = 200;

/// Controls with discrete choices, each of which is a step of its own.
const CHOICES: [&str; 3] = ["lens", "camera file", "touch"];

/// The setups before and after the present one.
#[derive(Default)]
pub(crate) struct History {
    before: Vec<Setup>,
    after: Vec<Setup>,
    /// The control that made the last change, and the time of it.
    last: Option<(&'static str, f64)>,
}

impl History {
    /// Keeps a setup that a control is about to change. If `held`, a button is still pressed, and
    /// the change is part of the same gesture.
    pub(crate) fn keep(&mut self, before: &Setup, control: &'static str, now: f64, held: bool) {
        let continues = self
            .last
            .is_some_and(|(c, at)| c == control && (held || now - at < TOGETHER))
            && !CHOICES.contains(&control);
        self.last = Some((control, now));
        self.after.clear();
        if continues {
            return;
        }
        self.before.push(before.clone());
        if self.before.len() > MOST {
            self.before.remove(0);
        }
    }

    /// Returns the setup before the present one.
    pub(crate) fn undo(&mut self, present: &Setup) -> Option<Setup> {
        let setup = self.before.pop()?;
        self.after.push(present.clone());
        self.last = None;
        Some(setup)
    }

    /// Returns the setup that was last undone.
    pub(crate) fn redo(&mut self, present: &Setup) -> Option<Setup> {
        let setup = self.after.pop()?;
        self.before.push(present.clone());
        self.last = None;
        Some(setup)
    }

    /// Returns whether there is a setup to return to.
    pub(crate) fn can_undo(&self) -> bool {
        !self.before.is_empty()
    }

    /// Returns whether there is a setup that was undone.
    pub(crate) fn can_redo(&self) -> bool {
        !self.after.is_empty()
    }

    /// Removes all steps.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }
}
