//! The stack of boxes that a traversal still has to visit.
//!
//! Its entries are not initialized, because setting 2 kB for every ray takes a measurable part of
//! its time. Only entries below the length are read, and `push` and `insert_sorted`, which alone
//! raise the length, write the entry that they add. Every index is checked.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// The number of entries that are stored without a heap allocation. Trees of usual depth need
/// fewer.
const INLINE: usize = 256;

/// Memory for a [`TraversalStack`].
///
/// A tree knows how large the stack can become, so the memory is provided before the traversal. A
/// stack that grows would need a call in the loop. Even a call that is never made keeps the ray out
/// of the vector registers, which costs a third of the time.
pub(super) struct StackStorage<T> {
    array: [MaybeUninit<T>; INLINE],
    heap: Vec<MaybeUninit<T>>,
}

impl<T: Copy> StackStorage<T> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            array: [const { MaybeUninit::uninit() }; INLINE],
            heap: Vec::new(),
        }
    }

    /// Makes an empty stack that can hold `size` entries.
    #[inline(always)]
    pub(super) fn stack(&mut self, size: usize) -> TraversalStack<'_, T> {
        let entries = if size > INLINE {
            self.grow(size);
            &mut self.heap[..]
        } else {
            &mut self.array[..size]
        };
        TraversalStack { entries, len: 0 }
    }

    #[cold]
    fn grow(&mut self, size: usize) {
        self.heap.resize(size, MaybeUninit::uninit());
    }
}

/// The entries still to be visited, with the next one on top.
pub(super) struct TraversalStack<'a, T> {
    entries: &'a mut [MaybeUninit<T>],
    len: usize,
}

impl<T: Copy> TraversalStack<'_, T> {
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub(super) fn push(&mut self, entry: T) {
        self.entries[self.len] = MaybeUninit::new(entry);
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<T> {
        let top = self.len.checked_sub(1)?;
        self.len = top;
        // SAFETY: `top` is below the old length, and every entry below the length has been written.
        Some(unsafe { self.entries[top].assume_init() })
    }

    /// Inserts an entry among those from `start` on, which are sorted with the smallest on top.
    #[inline(always)]
    pub(super) fn insert_sorted(&mut self, start: usize, entry: T)
    where
        T: Ord,
    {
        let mut at = self.len;
        while at > start {
            // SAFETY: `at` is at most the length, below which every entry has been written.
            let before = unsafe { self.entries[at - 1].assume_init() };
            if before >= entry {
                break;
            }
            self.entries[at] = MaybeUninit::new(before);
            at -= 1;
        }
        self.entries[at] = MaybeUninit::new(entry);
        self.len += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_holds_as_many_entries_as_the_deepest_tree_needs() {
        for size in [1, INLINE, INLINE + 1, 5 * INLINE] {
            let mut storage = StackStorage::new();
            let mut stack = storage.stack(size);
            (0..size).for_each(|i| stack.push(i));
            assert!((0..size).rev().all(|i| stack.pop() == Some(i)));
            assert_eq!(stack.pop(), None);
        }
    }
}
