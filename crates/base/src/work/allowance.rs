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
        let budget = Budget::within(self.memory, self.work, self.time);
        let _timer = self.time.map(|time| budget.stop().after(time));
        budget.during(work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_is_late_says_how_long_it_might_take() {
        let allowance = Allowance {
            memory: 100,
            work: WorkLimit(10),
            time: Some(Duration::from_millis(1)),
        };
        let error = allowance.during(|| {
            loop {
                match Budget::current().renewed().check() {
                    Ok(()) => std::thread::yield_now(),
                    Err(error) => break error,
                }
            }
        });
        let expected = "the scene takes longer than 0.001 s, the limit of `--time`";
        assert_eq!(error.message, expected);
    }
}
