//! The steps that a ray takes between parts that overlap, and what becomes of one that takes too
//! many.

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, Ordering};

use ivcam_base::work::StopSignal;

/// The number of steps after which a ray looks at the signal that ends its work.
const TURN: u64 = 1024;

/// The steps that one ray may still take between the instances of a scene: prototypes that it
/// enters, boxes of their parts, and halves of grids. In a scene with many primitives at one place
/// the blocks and the primitives that it tests are steps too.
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
    pub(in crate::scene) fn take(&self) -> bool {
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

/// The lowest number of a prototype in which a ray was cut.
#[derive(Debug)]
pub(in crate::scene) struct CutPrototype(AtomicU32);

impl Default for CutPrototype {
    fn default() -> Self {
        Self(AtomicU32::new(u32::MAX))
    }
}

impl CutPrototype {
    /// Notes that a ray was cut in a prototype.
    pub(super) fn note(&self, prototype: u32) {
        self.0.fetch_min(prototype, Ordering::Relaxed);
    }

    /// Returns the number; that of no prototype if no ray was cut in one.
    pub(in crate::scene) fn get(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }
}
