//! The signal that ends work before it is done.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::Builder;
use std::time::Duration;

/// Why work has to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCause {
    /// The time that it may take has passed.
    Time,
    /// The user, or a signal of the system, has canceled it.
    Canceled,
}

/// A signal that ends work before it is done. Reading it costs one atomic load, so a loop that may
/// run for more than a millisecond reads it in every iteration.
#[derive(Clone, Debug, Default)]
pub struct StopSignal {
    is_set: Arc<AtomicBool>,
    is_late: Arc<AtomicBool>,
}

/// Waits until a time has passed, and then sets a signal. Dropping it ends the wait.
#[derive(Debug)]
#[must_use = "dropping it ends the wait"]
pub struct StopTimer(#[allow(dead_code)] Option<Sender<()>>);

impl StopSignal {
    /// Returns whether work has to end.
    #[inline(always)]
    pub fn is_set(&self) -> bool {
        self.is_set.load(Ordering::Relaxed)
    }

    /// Returns why work has to end, if it has to.
    pub fn cause(&self) -> Option<StopCause> {
        match (self.is_set(), self.is_late.load(Ordering::Relaxed)) {
            (false, _) => None,
            (true, true) => Some(StopCause::Time),
            (true, false) => Some(StopCause::Canceled),
        }
    }

    /// Cancels the work.
    pub fn cancel(&self) {
        self.is_set.store(true, Ordering::Relaxed);
    }

    /// Returns the variable that cancels the work when it is set, for handlers of signals.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.is_set.clone()
    }

    /// Sets the signal after a time, unless the timer is dropped before. A signal that an earlier
    /// timer has set is cleared. On a system without threads the time never passes.
    pub fn after(&self, time: Duration) -> StopTimer {
        if self.is_late.swap(false, Ordering::Relaxed) {
            self.is_set.store(false, Ordering::Relaxed);
        }
        let (timer, end) = channel();
        let signal = self.clone();
        let wait = move || {
            if end.recv_timeout(time) == Err(RecvTimeoutError::Timeout) {
                signal.is_late.store(!signal.is_set(), Ordering::Relaxed);
                signal.cancel();
            }
        };
        let thread = Builder::new().name("timer".into()).spawn(wait);
        StopTimer(thread.is_ok().then_some(timer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn a_timer_sets_the_signal_and_a_dropped_one_does_not() {
        let signal = StopSignal::default();
        drop(signal.after(Duration::from_millis(1)));
        std::thread::sleep(Duration::from_millis(30));
        assert_eq!(signal.cause(), None);
        let start = Instant::now();
        let _timer = signal.after(Duration::from_millis(20));
        while !signal.is_set() {
            std::thread::yield_now();
        }
        assert!(start.elapsed() >= Duration::from_millis(20));
        assert_eq!(signal.cause(), Some(StopCause::Time));
        let _timer = signal.after(Duration::from_secs(60));
        assert_eq!(signal.cause(), None);
        signal.flag().store(true, Ordering::Relaxed);
        assert_eq!(signal.cause(), Some(StopCause::Canceled));
    }
}
