//! The time that a fit takes, and whether enough is left for another rendering.

use std::cell::Cell;
use std::cmp::Ordering;
use std::time::{Duration, Instant};

use ivcam_base::work::StopSignal;
use ivcam_optics::film::Resolution;

/// The time that a fit takes.
pub(super) struct FitClock {
    start: Instant,
    limit: Cell<Option<Duration>>,
    /// The signal that cancels the work.
    stop: StopSignal,
    /// The pixels of the last rendering.
    pixels: f64,
    cost: Cell<RenderCost>,
}

/// The time that a rendering is expected to take.
#[derive(Clone, Copy, Default)]
struct RenderCost {
    /// The longest time outside the exposure, in seconds: it does not depend on the size.
    fixed: f64,
    /// The longest exposure of the largest pictures so far, in seconds per pixel. Small pictures
    /// say less, because starting the threads takes a part of their time.
    rate: f64,
    /// The pixels of the largest pictures so far.
    largest: f64,
}

impl RenderCost {
    /// Returns the costs with those of another rendering: its pixels, all its seconds, and those of
    /// its exposure.
    fn with(self, pixels: f64, seconds: f64, exposure: f64) -> Self {
        let rate = exposure / pixels;
        Self {
            fixed: self.fixed.max(seconds - exposure),
            rate: match pixels.total_cmp(&self.largest) {
                Ordering::Less => self.rate,
                Ordering::Equal => self.rate.max(rate),
                Ordering::Greater => rate,
            },
            largest: self.largest.max(pixels),
        }
    }

    fn seconds(self, pixels: f64) -> f64 {
        self.fixed + self.rate * pixels
    }
}

impl FitClock {
    /// Starts a clock. A last rendering of `size` has to end within the limit.
    pub(super) fn new(limit: Option<Duration>, size: Resolution, stop: StopSignal) -> Self {
        Self {
            start: Instant::now(),
            limit: Cell::new(limit),
            stop,
            pixels: f64::from(size.width) * f64::from(size.height),
            cost: Cell::default(),
        }
    }

    /// Changes the time limit, which counts from the start of the clock.
    pub(super) fn set_limit(&self, limit: Option<Duration>) {
        self.limit.set(limit);
    }

    /// Returns whether the work was canceled, or the limit leaves no time for another rendering of
    /// the present size and the last one.
    pub(super) fn is_over(&self) -> bool {
        let cost = self.cost.get();
        let needed = cost.seconds(cost.largest) + cost.seconds(self.pixels);
        let taken = self.start.elapsed().as_secs_f64();
        let is_late = |limit: Duration| taken + needed > limit.as_secs_f64();
        self.stop.is_set() || self.limit.get().is_some_and(is_late)
    }

    /// Takes account of a rendering with so many pixels that began at a time, and whose exposure
    /// took so many seconds.
    pub(super) fn add(&self, (width, height): (usize, usize), begun: Instant, exposure: f64) {
        let (pixels, seconds) = ((width * height) as f64, begun.elapsed().as_secs_f64());
        let cost = self.cost.get();
        self.cost.set(cost.with(pixels, seconds, exposure));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small rendering whose time is nearly all compiling says little about a large one.
    #[test]
    fn the_time_of_a_large_rendering_is_not_that_of_compiling_a_small_one() {
        let small = RenderCost::default().with(1e3, 2.01, 0.01);
        assert!((small.seconds(1e5) - 3.0).abs() < 1e-9);
        let both = small.with(1e5, 2.5, 0.5).with(1e3, 1.0, 0.9);
        assert!((both.seconds(2e5) - 3.0).abs() < 1e-9);
    }
}
