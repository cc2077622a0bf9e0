//! What a user allows one scene to take.

use std::time::Duration;

use super::budget::Budget;
use super::limit::WorkLimit;

/// What a user allows one scene to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// The bytes of memory.
    pub memory: u64,
    /// The steps of work.
    pub work: WorkLimit,
    /// The time; none is not limited.
    pub time: Option<Duration>,
}

impl Allowance {
    /// Does some work on a new account with this allowance, on this thread.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        let budget = Budget::new(self.memory, self.work);
        let _timer = self.time.map(|time| budget.stop().after(time));
        budget.during(work)
    }
}
