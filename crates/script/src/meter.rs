//! Measures the work and the memory of a scene's scripts.

use std::cell::{Cell, RefCell};

use boa_engine::{JsResult, JsString, RuntimeLimitError};
use ivcam_base::work::{self, Budget, WorkLimit};

/// The steps of work that one executed instruction takes.
const STEPS: u64 = 20;
/// The scripts of a scene may together execute one instruction for this many steps of its limit: 20
/// million with the usual limit. A frame of a usual script takes some hundreds. Each can allocate
/// about 100 bytes, so this also bounds the memory for objects, to about 1 GB.
const STEPS_OF_ACCOUNT: u64 = 50;

/// The number of instructions in tests, which reach the limit sooner.
const IN_TESTS: usize = 1_000_000;

/// The instructions that stand for making a script that another one creates, which takes about 10
/// ms. Scripts that the file states are bounded by their number.
pub(super) const CREATED_SCRIPT: usize = 150_000;

/// The number of elements that functions such as `sort` may visit.
const MAX_ELEMENTS: f64 = 5e6;

/// The longest string, in characters.
const MAX_STRING: f64 = 16_777_216.0;

/// The number of characters that all strings in use may have together.
const MAX_CHARACTERS: usize = 64 << 20;

/// The characters of a string that take as long to write as an instruction takes. Long strings are
/// in new memory, which costs more than copying.
const CHARACTERS_OF_INSTRUCTION: usize = 80;

/// The number of elements of a list such as an `MFVec3f`.
pub(super) const MAX_LIST: usize = 1_000_000;

/// Strings up to this length are not measured, because the number of instructions bounds them.
const SHORT: usize = 32;

/// What the scripts of a scene have used, and whether they have reached a limit.
#[derive(Debug)]
pub(super) struct Meter {
    /// The number of instructions that all scripts may execute together.
    limit: usize,
    /// The number of them that are left.
    instructions: Cell<usize>,
    elements: Cell<f64>,
    /// The strings that operations made and that may still be in use.
    strings: RefCell<Vec<JsString>>,
    /// The characters of `strings`, and the number at which the unused ones are removed.
    characters: Cell<usize>,
    next_sweep: Cell<usize>,
    /// The limit that was reached.
    reached: RefCell<Option<String>>,
}

impl Default for Meter {
    fn default() -> Self {
        let work = Budget::of_thread().map_or(WorkLimit::default(), |budget| budget.work());
        let limit = match cfg!(test) {
            true => IN_TESTS,
            false => (work.0 / STEPS_OF_ACCOUNT) as usize,
        };
        Self {
            limit,
            instructions: Cell::new(limit),
            elements: Cell::new(0.0),
            strings: RefCell::default(),
            characters: Cell::new(0),
            next_sweep: Cell::new(1 << 20),
            reached: RefCell::default(),
        }
    }
}

impl Meter {
    /// Returns the number of instructions that are left.
    pub(super) fn instructions(&self) -> usize {
        self.instructions.get()
    }

    /// Counts instructions that were executed.
    pub(super) fn executed(&self, instructions: usize) {
        let left = self.instructions.get().saturating_sub(instructions);
        let fits = work::spend(STEPS * instructions as u64).is_ok();
        self.instructions.set(if fits { left } else { 0 });
    }

    /// Returns whether no script may execute anything any more.
    pub(super) fn is_used_up(&self) -> bool {
        self.instructions.get() == 0
    }

    /// Returns the message that no instructions are left.
    pub(super) fn too_many_instructions(&self) -> String {
        let limit = self.limit;
        format!("the scene's scripts execute more than {limit} instructions")
    }

    /// Returns the limit that was reached, once.
    pub(super) fn take_reached(&self) -> Option<String> {
        self.reached.borrow_mut().take()
    }

    /// Ends the script, because a limit was reached. The error cannot be caught in a script.
    pub(super) fn stop<T>(&self, limit: String) -> JsResult<T> {
        *self.reached.borrow_mut() = Some(limit);
        Err(RuntimeLimitError::StackSize.into())
    }

    /// Counts elements that a function is about to visit.
    pub(super) fn charge(&self, elements: f64) -> JsResult<()> {
        // A length that is not a number counts as too many.
        let sum = self.elements.get() + elements.max(0.0);
        self.elements.set(sum);
        if sum <= MAX_ELEMENTS {
            return Ok(());
        }
        self.stop(format!(
            "its functions visit more than {MAX_ELEMENTS} elements"
        ))
    }

    /// Ends the script if a string is about to become too long.
    pub(super) fn fits(&self, length: f64) -> JsResult<()> {
        if length <= MAX_STRING {
            return Ok(());
        }
        self.stop(format!(
            "a string would be longer than {MAX_STRING} characters"
        ))
    }

    /// Measures a string that an operation has made.
    pub(super) fn grow(&self, text: &JsString) -> JsResult<()> {
        let length = text.len();
        if length <= SHORT {
            return Ok(());
        }
        self.fits(length as f64)?;
        self.executed(length / CHARACTERS_OF_INSTRUCTION);
        if self.is_used_up() {
            return self.stop(self.too_many_instructions());
        }
        self.strings.borrow_mut().push(text.clone());
        self.characters.set(self.characters.get() + length);
        if self.characters.get() > self.next_sweep.get() {
            self.sweep();
            if self.characters.get() > MAX_CHARACTERS / 2 {
                // Objects that are not in use any more hold strings until they are collected.
                boa_engine::gc::force_collect();
                self.sweep();
            }
            if self.characters.get() > MAX_CHARACTERS {
                let limit = format!("its strings have more than {MAX_CHARACTERS} characters");
                return self.stop(limit);
            }
            let next = 2 * self.characters.get();
            self.next_sweep.set(next.clamp(1 << 20, MAX_CHARACTERS));
        }
        Ok(())
    }

    /// Forgets the strings that only the meter uses.
    fn sweep(&self) {
        let mut strings = self.strings.borrow_mut();
        strings.retain(|text| text.refcount().is_some_and(|count| count > 1));
        self.characters.set(strings.iter().map(JsString::len).sum());
    }
}
