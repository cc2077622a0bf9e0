//! What a thread works for, and passes to a thread that works for it.

use crate::files::InputRecord;
use crate::work::Budget;

/// The record of the files that a thread reads, and the account that it works on.
#[derive(Clone, Debug)]
pub struct ThreadContext {
    record: Option<InputRecord>,
    budget: Option<Budget>,
}

impl ThreadContext {
    /// Returns what this thread works for.
    pub fn current() -> Self {
        Self {
            record: InputRecord::current(),
            budget: Budget::of_thread(),
        }
    }

    /// Does some work for it, on this thread.
    pub fn during<T>(self, work: impl FnOnce() -> T) -> T {
        InputRecord::share(self.record);
        match self.budget {
            Some(budget) => budget.during(work),
            None => work(),
        }
    }
}
