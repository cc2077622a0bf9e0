//! The account of one scene: its bytes, its steps, and the signal that ends its work.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use super::limit::WorkLimit;
use super::stop::{StopCause, StopSignal};
use crate::diag::{Diagnostic, Result, Severity};
use crate::memory::size_text;

thread_local! {
    /// The account that this thread works on.
    static CURRENT: RefCell<Option<Budget>> = const { RefCell::new(None) };
}

/// Why work was cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// All steps are used.
    Work,
    /// All bytes are used.
    Memory,
    /// The work has to end.
    Stopped(StopCause),
}

/// The account of one scene. A copy is the same account.
///
/// It counts; it neither allocates nor ends anything. An account that is used up stays so: whoever
/// asks next is cut too, until the scene is finished.
#[derive(Clone, Debug)]
pub struct Budget(Arc<Account>);

#[derive(Debug)]
struct Account {
    bytes: u64,
    used_bytes: AtomicU64,
    steps: WorkLimit,
    used_steps: AtomicU64,
    /// The time after which the signal is set, for the message that it was.
    time: Option<Duration>,
    stop: StopSignal,
}

impl Budget {
    /// Creates an account of a number of bytes and of steps.
    pub fn new(bytes: u64, steps: WorkLimit) -> Self {
        Self::within(bytes, steps, None)
    }

    /// Creates an account whose signal is set after a time. The caller sets it.
    pub(super) fn within(bytes: u64, steps: WorkLimit, time: Option<Duration>) -> Self {
        Self::with_signal(bytes, steps, time, StopSignal::default())
    }

    fn with_signal(bytes: u64, steps: WorkLimit, time: Option<Duration>, stop: StopSignal) -> Self {
        Self(Arc::new(Account {
            bytes,
            used_bytes: AtomicU64::new(0),
            steps,
            used_steps: AtomicU64::new(0),
            time,
            stop,
        }))
    }

    /// Creates an account without limits, as code has that works on no scene.
    pub fn unlimited() -> Self {
        Self::new(u64::MAX, WorkLimit(u64::MAX))
    }

    /// Returns the account that this thread works on; without one, an unlimited one.
    pub fn current() -> Self {
        Self::of_thread().unwrap_or_else(Self::unlimited)
    }

    /// Returns the account that this thread works on, if there is one.
    pub fn of_thread() -> Option<Self> {
        CURRENT.with_borrow(Clone::clone)
    }

    /// Returns a new account with the limits and the signal of this one.
    pub fn renewed(&self) -> Self {
        self.stopped_by(&self.0.stop)
    }

    /// Does some work on this account, on this thread.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        /// Puts the account of before back, also after a panic.
        struct Before(Option<Budget>);
        impl Drop for Before {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _before = Before(CURRENT.replace(Some(self.clone())));
        work()
    }

    /// Returns a new account with the limits of this one and another signal.
    pub fn stopped_by(&self, stop: &StopSignal) -> Self {
        Self::with_signal(self.0.bytes, self.0.steps, self.0.time, stop.clone())
    }

    /// The signal that ends the work.
    pub fn stop(&self) -> &StopSignal {
        &self.0.stop
    }

    /// The limit on the steps.
    pub fn work(&self) -> WorkLimit {
        self.0.steps
    }

    /// The number of steps that were taken.
    pub fn used_steps(&self) -> u64 {
        self.0.used_steps.load(Ordering::Relaxed)
    }

    /// Counts steps that are about to be taken.
    ///
    /// # Errors
    /// Fails if they are more than are left, or if the work has to end.
    #[inline]
    pub fn spend(&self, steps: u64) -> std::result::Result<(), Cut> {
        let before = self.0.used_steps.fetch_add(steps, Ordering::Relaxed);
        if before.saturating_add(steps) > self.0.steps.0 {
            return Err(Cut::Work);
        }
        self.0
            .stop
            .cause()
            .map_or(Ok(()), |cause| Err(Cut::Stopped(cause)))
    }

    /// Counts bytes that are about to be used, and one step for every two of them, because the
    /// first write to new memory takes longer than later ones.
    ///
    /// # Errors
    /// Fails if they are more than are left, or if there are not enough steps.
    pub fn spend_bytes(&self, bytes: u64) -> std::result::Result<(), Cut> {
        let before = self.0.used_bytes.fetch_add(bytes, Ordering::Relaxed);
        if before.saturating_add(bytes) > self.0.bytes {
            self.0.used_bytes.fetch_sub(bytes, Ordering::Relaxed);
            return Err(Cut::Memory);
        }
        self.spend(bytes / 2)
    }

    /// Gives back bytes that were counted.
    pub fn give_back(&self, bytes: u64) {
        self.0.used_bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Returns why the account cuts all work, if it does.
    pub fn cut(&self) -> Option<Cut> {
        match self.0.stop.cause() {
            Some(cause) => Some(Cut::Stopped(cause)),
            None => (self.used_steps() >= self.0.steps.0).then_some(Cut::Work),
        }
    }

    /// Creates the message that work on the scene was cut. Everyone uses the same words, so that a
    /// sink counts them as one message.
    pub fn refusal(&self, cut: Cut) -> Box<Diagnostic> {
        let (text, help) = match cut {
            Cut::Work => {
                let text = format!("the scene takes more than {} steps of work", self.0.steps);
                (text, Some("`--work N` raises the limit"))
            }
            Cut::Memory => {
                let size = size_text(self.0.bytes);
                let text = format!("the scene's values need more than {size} of memory");
                (text, Some("`--memory SIZE` raises the limit"))
            }
            Cut::Stopped(StopCause::Time) => {
                let limit = match self.0.time {
                    Some(time) => format!("{} s, the limit of `--time`", time.as_secs_f64()),
                    None => "`--time` allows".to_owned(),
                };
                let text = format!("the scene takes longer than {limit}");
                (text, Some("give `--time` a longer time"))
            }
            Cut::Stopped(StopCause::Canceled) => ("the work was canceled".to_owned(), None),
        };
        let error = Diagnostic::beyond_limit(text);
        match help {
            Some(help) => error.with_help(help),
            None => error,
        }
    }

    /// Creates the warning that the work was cut, and that the rest of it is left out.
    pub fn warning(&self, cut: Cut) -> Box<Diagnostic> {
        let mut warning = self.refusal(cut).at_most(Severity::Warning);
        warning.message.push_str("; the rest is left out");
        warning
    }

    /// Checks that the work may go on.
    ///
    /// # Errors
    /// Fails if it was stopped.
    pub fn check(&self) -> Result<()> {
        let cause = self.0.stop.cause();
        cause.map_or(Ok(()), |cause| Err(self.refusal(Cut::Stopped(cause))))
    }
}

/// Counts steps on the account of this thread.
///
/// # Errors
/// Fails as [`Budget::spend`] does.
pub fn spend(steps: u64) -> std::result::Result<(), Cut> {
    CURRENT.with_borrow(|budget| budget.as_ref().map_or(Ok(()), |budget| budget.spend(steps)))
}

/// Counts bytes on the account of this thread.
///
/// # Errors
/// Fails as [`Budget::spend_bytes`] does.
pub fn spend_bytes(bytes: u64) -> std::result::Result<(), Cut> {
    CURRENT.with_borrow(|budget| {
        let budget = budget.as_ref();
        budget.map_or(Ok(()), |budget| budget.spend_bytes(bytes))
    })
}

/// Yields the items of a long list until the work of this thread is stopped. Whoever uses it asks
/// [`Budget::check`] afterwards.
pub fn until_stopped<T>(items: impl Iterator<Item = T>) -> impl Iterator<Item = T> {
    let stop = Budget::of_thread().map(|budget| budget.stop().clone());
    let mut number: u32 = 0;
    items.take_while(move |_| {
        number = number.wrapping_add(1);
        !number.is_multiple_of(1024) || !stop.as_ref().is_some_and(StopSignal::is_set)
    })
}

/// Returns whether the account of this thread cuts all work.
pub fn is_cut() -> bool {
    CURRENT.with_borrow(|budget| budget.as_ref().is_some_and(|budget| budget.cut().is_some()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::ErrorKind;

    #[test]
    fn an_account_that_is_used_up_cuts_all_further_work() {
        let budget = Budget::new(100, WorkLimit(1000));
        budget.during(|| {
            assert_eq!(spend(600), Ok(()));
            assert_eq!(spend_bytes(80), Ok(()));
            assert_eq!(spend_bytes(80), Err(Cut::Memory));
            assert!(!is_cut());
            assert_eq!(spend(600), Err(Cut::Work));
            assert_eq!(spend(1), Err(Cut::Work));
        });
        assert!(!is_cut());
        assert_eq!(
            (budget.cut(), budget.0.used_bytes.load(Ordering::Relaxed)),
            (Some(Cut::Work), 80)
        );
        let error = budget.refusal(Cut::Work);
        assert_eq!(error.kind, ErrorKind::Limit);
        assert_eq!(error.message, "the scene takes more than 1k steps of work");
        assert!(error.help.unwrap_or_default().contains("--work"));
    }

    #[test]
    fn a_thread_takes_over_the_account_of_another_one() {
        let budget = Budget::new(100, WorkLimit(10));
        budget.during(|| {
            let shared = Budget::current();
            let worker = std::thread::spawn(move || shared.during(|| spend(7)));
            assert_eq!(worker.join().ok(), Some(Ok(())));
            assert_eq!(spend(7), Err(Cut::Work));
        });
        budget.stop().cancel();
        let error = budget.check().unwrap_err();
        assert_eq!(error.message, "the work was canceled");
    }
}
