//! Time that work takes: on the clock, and of all processors together.

use std::time::{Duration, Instant};

/// The time that work took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spent {
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
    pub(super) fn plus(self, more: Self) -> Self {
        let both = self.processor_seconds.zip(more.processor_seconds);
        Self {
            seconds: self.seconds + more.seconds,
            processor_seconds: both.map(|(a, b)| a + b),
        }
    }
}

/// Measures the time since its start. The time of processors is that of all threads of the
/// program, in steps of up to 4 ms for threads that are at work.
pub(crate) struct Stopwatch {
    start: Instant,
    processor: Option<f64>,
}

impl Stopwatch {
    /// Starts.
    pub(crate) fn start() -> Self {
        Self {
            processor: processor_seconds(),
            start: Instant::now(),
        }
    }

    /// Returns the time since the start. A thread that has ended since does not count.
    pub(crate) fn spent(&self) -> Spent {
        let seconds = self.start.elapsed().as_secs_f64();
        let processor = self.processor.zip(processor_seconds());
        Spent {
            seconds,
            processor_seconds: processor.map(|(from, to)| (to - from).max(0.0)),
        }
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
