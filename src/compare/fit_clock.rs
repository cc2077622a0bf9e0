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
    sums: Cell<RenderSums>,
}

/// All renderings so far.
#[derive(Clone, Copy, Default)]
struct RenderSums {
    renders: f64,
    pixels: f64,
    /// The seconds outside the exposures, such as the time of placing the camera in the scene.
    outside: f64,
    /// The seconds of the exposures.
    exposures: f64,
}

impl RenderSums {
    /// Returns the seconds that other renderings with so many pixels in total are expected to take.
    fn seconds(self, renders: f64, pixels: f64) -> f64 {
        let outside = self.outside / self.renders.max(1.0);
        let exposure = self.exposures / self.pixels.max(1.0);
        renders * outside + pixels * exposure
    }
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
            sums: Cell::default(),
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
        let sums = self.sums.get();
        self.sums.set(RenderSums {
            renders: sums.renders + 1.0,
            pixels: sums.pixels + pixels,
            outside: sums.outside + (seconds - exposure).max(0.0),
            exposures: sums.exposures + exposure,
        });
    }

    /// Returns the time that so many renderings with so many pixels in total are expected to take,
    /// at most what the limit leaves.
    pub(super) fn left(&self, renders: f64, pixels: f64) -> Duration {
        let left = Duration::from_secs_f64(self.sums.get().seconds(renders, pixels));
        let limit = self.limit.get();
        limit.map_or(left, |limit| {
            left.min(limit.saturating_sub(self.start.elapsed()))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Placing the camera takes 0.2 seconds, and a large picture hardly longer than a small one.
    #[test]
    fn the_time_left_counts_what_a_rendering_takes_at_any_size() {
        let size = Resolution::new(192, 128).unwrap();
        let clock = FitClock::new(None, size, StopSignal::default());
        for _ in 0..340 {
            let Some(begun) = Instant::now().checked_sub(Duration::from_millis(203)) else {
                return; // A clock that has just started.
            };
            clock.add((48, 32), begun, 0.003);
        }
        let left = clock.left(300.0, 300.0 * 192.0 * 128.0).as_secs_f64();
        assert!((left - 300.0 * (0.2 + 0.003 * 16.0)).abs() < 1.0, "{left}");
        clock.set_limit(Some(Duration::from_secs(9)));
        assert!(clock.left(300.0, 1e6) <= Duration::from_secs(9));
    }

    /// A small rendering whose time is nearly all compiling says little about a large one.
    #[test]
    fn the_time_of_a_large_rendering_is_not_that_of_compiling_a_small_one() {
        let small = RenderCost::default().with(1e3, 2.01, 0.01);
        assert!((small.seconds(1e5) - 3.0).abs() < 1e-9);
        let both = small.with(1e5, 2.5, 0.5).with(1e3, 1.0, 0.9);
        assert!((both.seconds(2e5) - 3.0).abs() < 1e-9);
    }
}
