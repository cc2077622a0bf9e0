//! Time that work takes, on the clock and of all processors together, and the time at which work is
//! due.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The time that work took.
#[derive(Clone, Copy, Debug)]
pub struct Spent {
    /// Seconds of the clock.
    pub seconds: f64,
    /// Seconds of processors, summed over threads; `None` if the system does not say.
    pub processor_seconds: Option<f64>,
}

impl Default for Spent {
    /// Returns no time.
    fn default() -> Self {
        Self {
            seconds: 0.0,
            processor_seconds: Some(0.0),
        }
    }
}

impl Spent {
    /// Returns the sum of this time and another one.
    pub fn plus(self, more: Self) -> Self {
        let both = self.processor_seconds.zip(more.processor_seconds);
        Self {
            seconds: self.seconds + more.seconds,
            processor_seconds: both.map(|(a, b)| a + b),
        }
    }
}

/// Measures the time since its start. The time of processors is that of all threads of the
/// program, in steps of up to 4 ms for threads that are at work.
pub struct Stopwatch {
    start: Instant,
    processor: Option<f64>,
}

impl Stopwatch {
    /// Starts.
    pub fn start() -> Self {
        Self {
            processor: processor_seconds(),
            start: Instant::now(),
        }
    }

    /// Returns the time of the clock since the start.
    pub(super) fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Returns the time since the start. A thread that has ended since does not count.
    pub fn spent(&self) -> Spent {
        let seconds = self.start.elapsed().as_secs_f64();
        let processor = self.processor.zip(processor_seconds());
        Spent {
            seconds,
            processor_seconds: processor.map(|(from, to)| (to - from).max(0.0)),
        }
    }
}

/// The time at which work is due that one of several threads does.
pub struct Alarm {
    start: Instant,
    /// Milliseconds from the start.
    due: AtomicU64,
}

impl Alarm {
    /// Returns an alarm for work that is due after a time, or never.
    pub fn new(after: Option<Duration>) -> Self {
        let due = after.map_or(u64::MAX, |after| after.as_millis() as u64);
        Self {
            start: Instant::now(),
            due: AtomicU64::new(due),
        }
    }

    /// Returns whether the work is due. One thread gets the answer true, and no other one does
    /// before the alarm is set again.
    pub fn is_due(&self) -> bool {
        let now = self.start.elapsed().as_millis() as u64;
        let due = self.due.load(Ordering::Relaxed);
        let swap = |due| {
            let swapped =
                self.due
                    .compare_exchange(due, u64::MAX, Ordering::Relaxed, Ordering::Relaxed);
            swapped.is_ok()
        };
        now >= due && swap(due)
    }

    /// Sets the alarm to a time from now.
    pub fn set(&self, after: Duration) {
        let due = self.start.elapsed() + after;
        self.due.store(due.as_millis() as u64, Ordering::Relaxed);
    }
}

/// Returns the processor time of all threads of the program, in seconds.
fn processor_seconds() -> Option<f64> {
    // The system brings a thread's time up to date when the thread stops working.
    std::thread::sleep(Duration::from_nanos(1));
    let mut sum = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        // The first number is in nanoseconds (Linux, Documentation/scheduler/sched-stats.rst). A
        // thread that has just ended has no file any more.
        let Ok(text) = std::fs::read_to_string(thread.ok()?.path().join("schedstat")) else {
            continue;
        };
        sum += 1e-9 * text.split(' ').next()?.parse::<f64>().ok()?;
    }
    (sum > 0.0).then_some(sum)
}
