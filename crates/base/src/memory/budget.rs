//! The memory that a scene may use, and the part that is in use.

use std::fmt::Display;

use super::limit::MemoryLimit;
use super::size::size_text;
use crate::diag::{Diagnostic, Result};

/// The smallest block, in bytes, for which the system is asked whether it has one. Smaller blocks
/// are found in memory that the process has already.
const PROBED: u64 = 1 << 20;

/// The memory that a scene may use, and how much of it is in use.
///
/// It counts; it does not allocate. Who takes memory for a while gives it back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryBudget {
    limit: u64,
    used: u64,
}

impl MemoryBudget {
    /// Creates a budget of a number of bytes, all of which is left.
    pub fn new(limit: u64) -> Self {
        Self { limit, used: 0 }
    }

    /// Creates the default budget, half of the machine's memory.
    pub fn of_machine() -> Self {
        Self::new(MemoryLimit::default().bytes())
    }

    /// Returns the whole budget in bytes.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// Returns the number of bytes that are in use.
    pub fn used(&self) -> u64 {
        self.used
    }

    /// Returns the number of bytes that are left.
    ///
    /// Code that can work in parts, such as strips of a film, sizes them by this, and then takes
    /// the memory of one part.
    pub fn remaining(&self) -> u64 {
        self.limit.saturating_sub(self.used)
    }

    /// Takes memory for `what`, a noun with its article.
    ///
    /// # Errors
    /// Fails if less is left, or if the system does not have a block of this size. The message
    /// names `what`, its size and what is left. Nothing is taken then.
    pub fn take(&mut self, what: impl Display, bytes: u64) -> Result<()> {
        if bytes > self.remaining() {
            return Err(self.refusal(what, bytes));
        }
        if !is_available(bytes) {
            let size = size_text(bytes);
            let text = format!("{what} needs {size} of memory, which the system does not have");
            return Err(Diagnostic::beyond_limit(text));
        }
        self.used += bytes;
        Ok(())
    }

    /// Counts memory that is in use already, whether it fits or not.
    pub fn count(&mut self, bytes: u64) {
        self.used = self.used.saturating_add(bytes);
    }

    /// Gives back memory that was taken.
    pub fn give_back(&mut self, bytes: u64) {
        self.used = self.used.saturating_sub(bytes);
    }

    /// Returns the error that `what` does not fit.
    pub(crate) fn refusal(&self, what: impl Display, bytes: u64) -> Box<Diagnostic> {
        let [size, left, limit] = [bytes, self.remaining(), self.limit].map(size_text);
        let text = format!("{what} needs {size} of memory, and {left} of {limit} are left");
        Diagnostic::beyond_limit(text).with_help("`--memory SIZE` raises the limit")
    }
}

/// Returns whether the system has a block of memory of a size. On a system that promises more
/// memory than it has, this finds only sizes that are beyond any promise.
fn is_available(bytes: u64) -> bool {
    let Ok(bytes) = usize::try_from(bytes) else {
        return false;
    };
    (bytes as u64) < PROBED || Vec::<u8>::new().try_reserve_exact(bytes).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::ErrorKind;

    #[test]
    fn what_does_not_fit_is_refused_with_what_is_left() {
        let mut budget = MemoryBudget::new(10 << 20);
        assert!(budget.take("the tree", 8 << 20).is_ok());
        let error = budget.take("the film", 3 << 20).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Limit);
        assert_eq!(
            error.message,
            "the film needs 3.0 MB of memory, and 2.0 MB of 10 MB are left"
        );
        assert!(error.help.unwrap_or_default().contains("--memory"));
        assert_eq!((budget.used(), budget.remaining()), (8 << 20, 2 << 20));
        budget.give_back(6 << 20);
        assert_eq!(budget.remaining(), 8 << 20);
        budget.count(9 << 20);
        assert_eq!(budget.remaining(), 0);
    }

    #[test]
    fn a_block_that_the_system_does_not_have_is_an_error_and_not_an_abort() {
        let mut budget = MemoryBudget::new(u64::MAX);
        let error = budget.take("the moon", u64::MAX / 2).unwrap_err();
        assert!(error.message.contains("which the system does not have"));
        assert_eq!(budget.used(), 0);
    }
}
