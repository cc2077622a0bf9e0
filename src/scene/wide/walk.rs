//! The way of one ray through the tree.
//!
//! A ray waits for the next node's place more than for arithmetic. So which box comes next is said
//! by jumps, which the processor guesses, as rays that follow each other do much the same: the next
//! node's planes are on their way before it is known that they are wanted.

use std::mem::MaybeUninit;

use glam::Vec3;

use super::super::traverse::PreparedRay;
use super::block::{Block, Edges, Met};
use super::{Child, Node, WIDTH, Wide, bits};
#[cfg(target_arch = "x86_64")]
use crate::math::lanes::Width;

/// What a node's boxes ask of a ray.
pub struct Slabs {
    origin: Vec3,
    inverse: Vec3,
    /// The same, and a little farther: distances to where a ray leaves a box are widened by 2γ₃
    /// (Ize, *Robust BVH Ray Traversal*), so that rounding never loses a box.
    wider: Vec3,
    /// Which of the six planes the ray comes to first, axis by axis; the others last.
    near: [usize; 3],
    far: [usize; 3],
    t_min: f32,
}

impl Slabs {
    #[inline(always)]
    fn new(ray: &PreparedRay, t_min: f32) -> Self {
        let back = |axis: usize| if ray.inverse[axis] < 0.0 { 3 } else { 0 };
        let [x, y, z] = [back(0), back(1), back(2)];
        Self {
            origin: ray.origin,
            inverse: ray.inverse,
            wider: ray.inverse * (1.0 + WIDENING),
            near: [x, 1 + y, 2 + z],
            far: [3 - x, 4 - y, 5 - z],
            t_min,
        }
    }

    /// The boxes that the ray enters no farther than `limit`, as bits, and where.
    #[inline(always)]
    #[allow(clippy::needless_range_loop)] // the same index into eight arrays, kept for lanes
    fn enters(&self, node: &Node, limit: f32, near: &mut [f32; WIDTH]) -> u32 {
        let mut mask = 0;
        for i in 0..WIDTH {
            let from = |plane: usize, axis: usize| node.planes[plane][i] - self.origin[axis];
            let first = |axis: usize| from(self.near[axis], axis) * self.inverse[axis];
            let last = |axis: usize| from(self.far[axis], axis) * self.wider[axis];
            near[i] = first(0).max(first(1)).max(first(2)).max(self.t_min);
            let far = last(0).min(last(1)).min(last(2)).min(limit);
            mask |= u32::from(near[i] <= far) << i;
        }
        mask
    }
}

pub(super) const WIDENING: f32 = 4.0 * f32::EPSILON;

/// How far a box may be when something has been met at `t`.
#[inline(always)]
fn limit(t: f32) -> f32 {
    t + t.abs() * WIDENING
}

const DEEP: usize = 256;

/// Room for what a ray comes back to: without memory from elsewhere for trees of usual depth.
///
/// How much that is at most is known of a tree before: to make room on the way would be a call, and
/// a call in the loop of the walk, even one that never happens, keeps the numbers of the ray out of
/// the vector registers and costs a third of the time.
pub(super) struct Room<T> {
    array: [MaybeUninit<T>; DEEP],
    more: Vec<MaybeUninit<T>>,
}

impl<T: Copy> Room<T> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            array: [const { MaybeUninit::uninit() }; DEEP],
            more: Vec::new(),
        }
    }

    /// For so many at once.
    #[inline(always)]
    pub(super) fn stack(&mut self, most: usize) -> Stack<'_, T> {
        let places = if most > DEEP {
            self.grow(most);
            &mut self.more[..]
        } else {
            &mut self.array[..most]
        };
        Stack { places, filled: 0 }
    }

    #[cold]
    fn grow(&mut self, most: usize) {
        self.more.resize(most, MaybeUninit::uninit());
    }
}

/// What to come back to, the next on top.
pub(super) struct Stack<'a, T> {
    places: &'a mut [MaybeUninit<T>],
    filled: usize,
}

impl<T: Copy> Stack<'_, T> {
    #[inline(always)]
    pub(super) fn push(&mut self, waiting: T) {
        self.places[self.filled] = MaybeUninit::new(waiting);
        self.filled += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<T> {
        let top = self.filled.checked_sub(1)?;
        self.filled = top;
        // SAFETY: every place below the old `filled` has been written.
        Some(unsafe { self.places[top].assume_init() })
    }
}

/// A box to come back to, for one ray: how near it is, and what is behind it. Distances are not
/// negative, so that their bits are in their order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(near: f32, child: Child) -> Self {
        Self(u64::from(near.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    fn is_within(self, limit: f32) -> bool {
        (self.0 >> 32) as u32 <= limit.to_bits()
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

impl Stack<'_, Waiting> {
    /// The nearest of the boxes entered, while the others are kept; nothing if there is none. Which
    /// of the cases it is can be guessed by the processor: without branches this takes a fifth more
    /// time. Of three or more the nearest is not said by a jump, which would be wrong too often.
    #[inline(always)]
    fn nearest(&mut self, node: &Node, mask: u32, near: &[f32; WIDTH]) -> Option<Child> {
        let rest = mask & mask.wrapping_sub(1);
        let a = mask.trailing_zeros() as usize % WIDTH;
        if rest == 0 {
            return (mask != 0).then(|| node.guessed(a));
        }
        let waiting = |i: usize| Waiting::new(near[i], node.children[i]);
        let b = rest.trailing_zeros() as usize % WIDTH;
        let more = rest & rest.wrapping_sub(1);
        if more == 0 {
            return Some(if near[b] < near[a] {
                self.push(waiting(a));
                node.guessed(b)
            } else {
                self.push(waiting(b));
                node.guessed(a)
            });
        }
        let start = self.filled;
        for i in bits(mask) {
            self.insert(start, waiting(i % WIDTH));
        }
        self.pop().map(Waiting::child)
    }

    /// One of the boxes entered, while the others are kept.
    #[inline(always)]
    fn any(&mut self, node: &Node, mask: u32) -> Option<Child> {
        if mask == 0 {
            return None;
        }
        for i in bits(mask & (mask - 1)) {
            self.push(Waiting::new(0.0, node.children[i % WIDTH]));
        }
        Some(node.guessed(mask.trailing_zeros() as usize % WIDTH))
    }

    /// Puts one among those from `start` on, which are sorted, the nearest on top.
    #[inline(always)]
    fn insert(&mut self, start: usize, new: Waiting) {
        let mut at = self.filled;
        while at > start {
            // SAFETY: every place below `filled` has been written.
            let before = unsafe { self.places[at - 1].assume_init() };
            if before >= new {
                break;
            }
            self.places[at] = MaybeUninit::new(before);
            at -= 1;
        }
        self.places[at] = MaybeUninit::new(new);
        self.filled += 1;
    }
}

impl Node {
    /// A child. Which of the eight is said by a jump, so that the processor goes on with the one it
    /// guesses; with the number as an index it waits for the tests of the boxes, and a ray takes a
    /// tenth to a fifth more time.
    #[inline(always)]
    fn guessed(&self, i: usize) -> Child {
        #[cfg(target_arch = "x86_64")]
        {
            // Eight ways that differ in a comment, or the compiler would make one of them.
            macro_rules! at {
                ($i:literal) => {{
                    let mut child = self.children[$i].0;
                    // SAFETY: no instruction at all.
                    unsafe {
                        std::arch::asm!(
                            concat!("/* ", $i, " {0:e} */"),
                            inout(reg) child,
                            options(pure, nomem, nostack, preserves_flags)
                        );
                    }
                    Child(child)
                }};
            }
            match i {
                0 => at!(0),
                1 => at!(1),
                2 => at!(2),
                3 => at!(3),
                4 => at!(4),
                5 => at!(5),
                6 => at!(6),
                _ => at!(7),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        self.children[i]
    }
}

/// The walk in the instructions named, with [`Slabs::enters`] eight at a time, in half the
/// operations: a plane's distance is its place times the inverse, less the origin's. What the
/// rounding of the origin's takes is given back. A macro, for only closures of a function with
/// these instructions are compiled for them.
#[cfg(target_arch = "x86_64")]
macro_rules! walk_by {
    ($name:ident, $instructions:literal) => {
        #[target_feature(enable = $instructions)]
        fn $name<const SORTED: bool>(
            &self,
            start: Child,
            ray: &PreparedRay,
            (t_min, t_max): (f32, f32),
            visit: impl FnMut(&Block, &Met, f32) -> f32,
        ) {
            use std::arch::x86_64::*;
            let slabs = Slabs::new(ray, t_min);
            let all = |v: Vec3| v.to_array().map(|x| _mm256_set1_ps(x));
            let (first, last) = (slabs.origin * slabs.inverse, slabs.origin * slabs.wider);
            let near_from = all(-first - first.abs() * f32::EPSILON);
            let far_from = all(-last + last.abs() * f32::EPSILON);
            let (inverse, wider) = (all(slabs.inverse), all(slabs.wider));
            let least = _mm256_set1_ps(slabs.t_min);
            let enters = |node: &Node, limit: f32, near: &mut [f32; WIDTH]| {
                let planes = node.planes.as_ptr().cast::<f32>();
                // SAFETY: `Slabs` names planes 0 to 5, each of eight floats and aligned to 32 by
                // the node's layout.
                let plane = |plane: usize| unsafe { _mm256_load_ps(planes.add(plane * WIDTH)) };
                let first =
                    |a: usize| _mm256_fmadd_ps(plane(slabs.near[a]), inverse[a], near_from[a]);
                let last = |a: usize| _mm256_fmadd_ps(plane(slabs.far[a]), wider[a], far_from[a]);
                // Of two the second is taken if one is no number, as beyond the largest.
                let n = _mm256_max_ps(first(0), least);
                let n = _mm256_max_ps(first(2), _mm256_max_ps(first(1), n));
                let f = _mm256_min_ps(last(0), _mm256_set1_ps(limit));
                let f = _mm256_min_ps(last(2), _mm256_min_ps(last(1), f));
                // SAFETY: the array is eight floats, and the store needs no alignment.
                unsafe { _mm256_storeu_ps(near.as_mut_ptr(), n) };
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(n, f)) as u32
            };
            self.walk_with::<SORTED>(start, ray, (t_min, t_max), enters, visit);
        }
    };
}

impl Wide {
    /// Leads a ray through the boxes, near ones first, from `t_min` on, which is not negative.
    /// `visit` gets a block, what triangles of it are met, and the distance so far, and answers
    /// with the distance of the nearest hit; one below `t_min` ends.
    #[inline]
    pub fn walk(
        &self,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, &Met, f32) -> f32,
    ) {
        if !self.nodes.is_empty() {
            self.walk_from::<true>(Child::ROOT, ray, t_min, t_max, visit);
        }
    }

    /// The same in whatever order, which is faster where any hit will do.
    #[inline]
    pub fn walk_any(
        &self,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, &Met, f32) -> f32,
    ) {
        if !self.nodes.is_empty() {
            self.walk_from::<false>(Child::ROOT, ray, t_min, t_max, visit);
        }
    }

    #[inline]
    pub(super) fn walk_from<const SORTED: bool>(
        &self,
        start: Child,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, &Met, f32) -> f32,
    ) {
        // A smallest distance of −0 has the bits of a large one.
        let t_min = if t_min > 0.0 { t_min } else { 0.0 };
        #[cfg(target_arch = "x86_64")]
        match Width::detect() {
            // SAFETY: the processor was just asked; every one with AVX2 counts bits too.
            Width::Avx512 => {
                return unsafe { self.walk_avx512::<SORTED>(start, ray, (t_min, t_max), visit) };
            }
            // SAFETY: as above.
            Width::Avx2 => {
                return unsafe { self.walk_avx2::<SORTED>(start, ray, (t_min, t_max), visit) };
            }
            Width::Plain => {}
        }
        self.walk_plain::<SORTED>(start, ray, (t_min, t_max), visit);
    }

    pub(super) fn walk_plain<const SORTED: bool>(
        &self,
        start: Child,
        ray: &PreparedRay,
        (t_min, t_max): (f32, f32),
        visit: impl FnMut(&Block, &Met, f32) -> f32,
    ) {
        let slabs = Slabs::new(ray, t_min);
        let enters = |n: &Node, t: f32, near: &mut [f32; WIDTH]| slabs.enters(n, t, near);
        self.walk_with::<SORTED>(start, ray, (t_min, t_max), enters, visit);
    }

    #[cfg(target_arch = "x86_64")]
    walk_by!(walk_avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
    // In the same vectors, but there are more of them.
    #[cfg(target_arch = "x86_64")]
    walk_by!(
        walk_avx512,
        "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
    );

    #[inline(always)]
    fn walk_with<const SORTED: bool>(
        &self,
        start: Child,
        ray: &PreparedRay,
        (t_min, mut t_max): (f32, f32),
        enters: impl Fn(&Node, f32, &mut [f32; WIDTH]) -> u32,
        mut visit: impl FnMut(&Block, &Met, f32) -> f32,
    ) {
        let edges = Edges::new(ray, t_min);
        let mut room = Room::new();
        let mut stack = room.stack(self.waiting);
        let mut near = [0.0; WIDTH];
        let mut current = start;
        let mut reach = limit(t_max);
        if !(reach >= 0.0) {
            return;
        }
        loop {
            if current.is_leaf() {
                for block in &self.blocks[current.place()..] {
                    let met = edges.meet(block, t_max);
                    if met.mask | block.others != 0 {
                        t_max = visit(block, &met, t_max);
                        if t_max < t_min {
                            return;
                        }
                    }
                    if block.last {
                        break;
                    }
                }
                reach = limit(t_max);
            } else {
                let node = &self.nodes[current.place()];
                let mask = enters(node, reach, &mut near);
                let next = match SORTED {
                    true => stack.nearest(node, mask, &near),
                    false => stack.any(node, mask),
                };
                if let Some(next) = next {
                    current = next;
                    continue;
                }
            }
            current = loop {
                match stack.pop() {
                    Some(waiting) if waiting.is_within(reach) => break waiting.child(),
                    Some(_) => {}
                    None => return,
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_holds_what_the_deepest_tree_leaves_waiting() {
        for most in [1, DEEP, DEEP + 1, 5 * DEEP] {
            let mut room = Room::new();
            let mut stack = room.stack(most);
            (0..most).for_each(|i| stack.push(i));
            assert!((0..most).rev().all(|i| stack.pop() == Some(i)));
            assert_eq!(stack.pop(), None);
        }
    }
}
