//! The steps that a ray takes between instances, and what becomes of one that takes too many.

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use ivcam_base::work::StopSignal;

/// The number of steps after which a ray looks at the signal that ends its work.
const TURN: u64 = 1024;

/// The steps that one ray may still take between the instances of a scene: prototypes that it
/// enters, boxes of their parts, and halves of grids.
///
/// Instances that overlap have no end of steps: a ray has to look into each that it is inside of.
/// A ray that has none left is cut: its hit is the nearest so far. The limit is that of one ray, so
/// that the picture has the same bits at any number of threads.
pub(in crate::scene) struct RaySteps<'a> {
    left: Cell<u64>,
    is_cut: Cell<bool>,
    stop: &'a StopSignal,
}

impl<'a> RaySteps<'a> {
    /// Returns the steps of a ray before its first one.
    #[inline]
    pub(in crate::scene) fn new(most: u64, stop: &'a StopSignal) -> Self {
        Self {
            left: Cell::new(most),
            is_cut: Cell::new(false),
            stop,
        }
    }

    /// Takes a step. Returns `false` if the ray is cut.
    #[inline]
    pub(super) fn take(&self) -> bool {
        let left = self.left.get();
        if left.is_multiple_of(TURN) && (left == 0 || self.stop.is_set()) {
            self.is_cut.set(true);
            self.left.set(0);
            return false;
        }
        self.left.set(left - 1);
        true
    }

    /// Whether the ray is cut.
    #[inline]
    pub(in crate::scene) fn is_cut(&self) -> bool {
        self.is_cut.get()
    }
}

/// The rays that were cut.
#[derive(Debug)]
pub(in crate::scene) struct CutRays {
    count: AtomicU64,
    /// The lowest number of a prototype in which one was cut.
    prototype: AtomicU32,
}

impl Default for CutRays {
    fn default() -> Self {
        Self {
            count: AtomicU64::new(0),
            prototype: AtomicU32::new(u32::MAX),
        }
    }
}

impl CutRays {
    /// Counts a ray that was cut.
    pub(in crate::scene) fn add(&self) {
        self.count.fetch_add(1, Ordering::Relaxed);
    }

    /// Notes that a ray was cut in a prototype.
    pub(super) fn note(&self, prototype: u32) {
        self.prototype.fetch_min(prototype, Ordering::Relaxed);
    }

    /// Returns their number, and the lowest number of a prototype in which one was cut.
    pub(in crate::scene) fn get(&self) -> (u64, u32) {
        let count = self.count.load(Ordering::Relaxed);
        (count, self.prototype.load(Ordering::Relaxed))
    }
}
