//! Traces a single ray through the tree.
//!
//! A ray waits for memory more than for arithmetic. The next box is therefore chosen by branches,
//! not by an index. Successive rays take similar paths, so the processor predicts the branch and
//! loads the next node's planes before the tests of the boxes are done.

use glam::Vec3;
use ivcam_base::math::lanes::bits;
use ivcam_base::math::simd::{Quads, Vectors};
#[cfg(target_arch = "x86_64")]
use ivcam_base::math::simd::{Width, distinct, load_8, store_8};

use super::block::{Block, BlockHits, BlockTest};
use super::nodes::{Bvh, Child, WIDTH, WideNode};
use super::stack::{StackStorage, TraversalStack};
use super::triangle::PreparedRay;

/// The part of the tests of a node's boxes that depends only on the ray.
struct Slabs {
    /// The ray's origin for the planes where it enters a box. It is ahead of the true one by the
    /// padding of the boxes.
    near_origin: Vec3,
    /// The ray's origin for the planes where it leaves a box, behind the true one by the padding.
    far_origin: Vec3,
    inverse: Vec3,
    /// The inverse for the planes where a ray leaves a box. It is larger by the factor 1 + 2γ₃
    /// (Ize, *Robust BVH Ray Traversal*, 2013), so that rounding never loses a box.
    wider: Vec3,
    /// For each axis, the index of the node's planes where the ray enters.
    near: [usize; 3],
    /// For each axis, the index of the node's planes where the ray leaves.
    far: [usize; 3],
    t_min: f32,
}

impl Slabs {
    /// Prepares the tests of boxes that are enlarged by a padding on all sides.
    #[inline(always)]
    fn new(ray: &PreparedRay, padding: Vec3, t_min: f32) -> Self {
        let ahead = padding * ray.inverse.signum();
        let back = |axis: usize| if ray.inverse[axis] < 0.0 { 3 } else { 0 };
        let [x, y, z] = [back(0), back(1), back(2)];
        Self {
            near_origin: ray.origin + ahead,
            far_origin: ray.origin - ahead,
            inverse: ray.inverse,
            wider: ray.inverse * (1.0 + WIDENING),
            near: [x, 1 + y, 2 + z],
            far: [3 - x, 4 - y, 5 - z],
            t_min,
        }
    }

    /// Returns a bit mask of the boxes that the ray enters at `limit` or nearer, and stores the
    /// entry distances in `near`.
    #[inline(always)]
    fn enters(&self, node: &WideNode, limit: f32, near: &mut [f32; WIDTH]) -> u32 {
        const { assert!(Quads::LANES == WIDTH) }
        let v = Quads;
        let (mut n, mut f) = (v.splat(self.t_min), v.splat(limit));
        for axis in 0..3 {
            let to_plane = |plane: usize, origin: Vec3| {
                v.sub(v.load(&node.planes[plane], 0), v.splat(origin[axis]))
            };
            let first = to_plane(self.near[axis], self.near_origin);
            let last = to_plane(self.far[axis], self.far_origin);
            // The product is NaN after an overflow, for example.
            n = v.max_num(v.mul(first, v.splat(self.inverse[axis])), n);
            f = v.min_num(v.mul(last, v.splat(self.wider[axis])), f);
        }
        v.store(near, 0, u32::MAX, n);
        v.at_most(n, f)
    }
}

/// The entry distances of a node's boxes. With their alignment the whole stack frame of the search
/// for the nearest hit is aligned; otherwise vectors on the stack cross cache lines in every second
/// process, and a ray takes up to a fifth more time. A search for any hit does not store them.
#[repr(C, align(32))]
struct EntryDistances([f32; WIDTH]);

/// The fraction by which exit distances are increased: see [`Slabs`].
pub(super) const WIDENING: f32 = 4.0 * f32::EPSILON;

/// The farthest distance of a box that may contain a hit at distance `t`.
#[inline(always)]
fn limit(t: f32) -> f32 {
    t + t.abs() * WIDENING
}

/// A box that a ray still has to visit, with its distance in the upper half and its child in the
/// lower half. Distances are not negative, so their bits compare like their values.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct StackEntry(u64);

impl StackEntry {
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

impl TraversalStack<'_, StackEntry> {
    /// Returns the nearest of the entered boxes, if any, and pushes the others. The processor
    /// predicts whether there are none, one, two or more; without branches this takes a fifth more
    /// time. Among three or more boxes branches would be mispredicted too often, so they are
    /// sorted.
    #[inline(always)]
    fn nearest(&mut self, node: &WideNode, mask: u32, near: &[f32; WIDTH]) -> Option<Child> {
        let rest = mask & mask.wrapping_sub(1);
        let a = mask.trailing_zeros() as usize % WIDTH;
        if rest == 0 {
            return (mask != 0).then(|| node.predicted_child(a));
        }
        let entry = |i: usize| StackEntry::new(near[i], node.children[i]);
        let b = rest.trailing_zeros() as usize % WIDTH;
        let more = rest & rest.wrapping_sub(1);
        if more == 0 {
            return Some(if near[b] < near[a] {
                self.push(entry(a));
                node.predicted_child(b)
            } else {
                self.push(entry(b));
                node.predicted_child(a)
            });
        }
        let start = self.len();
        for i in bits(mask) {
            self.insert_sorted(start, entry(i % WIDTH));
        }
        self.pop().map(StackEntry::child)
    }

    /// Returns one of the entered boxes, if any, and pushes the others.
    #[inline(always)]
    fn any(&mut self, node: &WideNode, mask: u32) -> Option<Child> {
        if mask == 0 {
            return None;
        }
        for i in bits(mask & (mask - 1)) {
            self.push(StackEntry::new(0.0, node.children[i % WIDTH]));
        }
        Some(node.predicted_child(mask.trailing_zeros() as usize % WIDTH))
    }
}

impl WideNode {
    /// Returns a child by a jump to one of eight instructions, so that the processor continues with
    /// the child that it predicts. With `i` as an index it would wait for the tests of the boxes,
    /// and a ray would take 10 to 20% more time.
    #[inline(always)]
    fn predicted_child(&self, i: usize) -> Child {
        #[cfg(target_arch = "x86_64")]
        {
            // The eight arms differ, so that the compiler does not merge them.
            let child = |i: usize| self.children[i].0;
            Child(match i {
                0 => distinct::<0>(child(0)),
                1 => distinct::<1>(child(1)),
                2 => distinct::<2>(child(2)),
                3 => distinct::<3>(child(3)),
                4 => distinct::<4>(child(4)),
                5 => distinct::<5>(child(5)),
                6 => distinct::<6>(child(6)),
                _ => distinct::<7>(child(7)),
            })
        }
        #[cfg(not(target_arch = "x86_64"))]
        self.children[i]
    }
}

/// Defines a traversal that is compiled for the given instructions. It computes [`Slabs::enters`]
/// for eight boxes at a time with half the operations: the distance to a plane is plane·inverse −
/// origin·inverse, widened by the rounding error of the second product. It is a macro because a
/// closure is compiled for these instructions only inside a function that enables them.
#[cfg(target_arch = "x86_64")]
macro_rules! walk_by {
    ($name:ident, $instructions:literal) => {
        #[target_feature(enable = $instructions)]
        fn $name<const SORTED: bool>(
            &self,
            start: Child,
            (ray, padding): (&PreparedRay, Vec3),
            (t_min, t_max): (f32, f32),
            visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
        ) {
            use std::arch::x86_64::*;
            let slabs = Slabs::new(ray, padding, t_min);
            let all = |v: Vec3| v.to_array().map(|x| _mm256_set1_ps(x));
            let first = slabs.near_origin * slabs.inverse;
            let last = slabs.far_origin * slabs.wider;
            let near_from = all(-first - first.abs() * f32::EPSILON);
            let far_from = all(-last + last.abs() * f32::EPSILON);
            let (inverse, wider) = (all(slabs.inverse), all(slabs.wider));
            let least = _mm256_set1_ps(slabs.t_min);
            let enters = |node: &WideNode, limit: f32, near: &mut [f32; WIDTH]| {
                let plane = |plane: usize| load_8(&node.planes[plane]);
                let first =
                    |a: usize| _mm256_fmadd_ps(plane(slabs.near[a]), inverse[a], near_from[a]);
                let last = |a: usize| _mm256_fmadd_ps(plane(slabs.far[a]), wider[a], far_from[a]);
                // `max` and `min` return the second operand if one is NaN, as after an overflow.
                let n = _mm256_max_ps(first(0), least);
                let n = _mm256_max_ps(first(2), _mm256_max_ps(first(1), n));
                let f = _mm256_min_ps(last(0), _mm256_set1_ps(limit));
                let f = _mm256_min_ps(last(2), _mm256_min_ps(last(1), f));
                store_8(near, n);
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(n, f)) as u32
            };
            self.walk_with::<SORTED>(start, ray, (t_min, t_max), enters, visit);
        }
    };
}

impl Bvh {
    /// Traces a ray through the tree from `t_min`, which is not negative, with near boxes first.
    /// `visit` gets a block, the hits of its triangles, and the farthest distance of interest. It
    /// returns the new farthest distance; a value below `t_min` ends the traversal.
    #[inline]
    pub fn walk(
        &self,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        if !self.nodes.is_empty() {
            self.walk_from::<true>(Child::ROOT, ray, t_min, t_max, visit);
        }
    }

    /// Traces a ray like [`Bvh::walk`], but in no particular order, which is faster if any hit
    /// suffices.
    #[inline]
    pub fn walk_any(
        &self,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        if !self.nodes.is_empty() {
            self.walk_from::<false>(Child::ROOT, ray, t_min, t_max, visit);
        }
    }

    /// Traces a ray like [`Bvh::walk`] if `sorted`, else like [`Bvh::walk_any`], through boxes that
    /// are enlarged by a padding on all sides.
    pub(crate) fn walk_padded(
        &self,
        ray: (&PreparedRay, Vec3),
        sorted: bool,
        limits: (f32, f32),
        visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        if sorted {
            self.walk_by_width::<true>(Child::ROOT, ray, limits, visit);
        } else {
            self.walk_by_width::<false>(Child::ROOT, ray, limits, visit);
        }
    }

    #[inline]
    pub(super) fn walk_from<const SORTED: bool>(
        &self,
        start: Child,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        self.walk_by_width::<SORTED>(start, (ray, Vec3::ZERO), (t_min, t_max), visit);
    }

    #[inline]
    fn walk_by_width<const SORTED: bool>(
        &self,
        start: Child,
        ray: (&PreparedRay, Vec3),
        (t_min, t_max): (f32, f32),
        visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        // −0 has the bits of a large integer, so it would not sort as a small distance.
        let t_min = if t_min > 0.0 { t_min } else { 0.0 };
        #[cfg(target_arch = "x86_64")]
        match Width::detect() {
            #[allow(unsafe_code)]
            Width::Avx512 => {
                // SAFETY: `detect` has just found all instructions that the function enables.
                return unsafe { self.walk_avx512::<SORTED>(start, ray, (t_min, t_max), visit) };
            }
            #[allow(unsafe_code)]
            Width::Avx2 => {
                // SAFETY: as above.
                return unsafe { self.walk_avx2::<SORTED>(start, ray, (t_min, t_max), visit) };
            }
            Width::Plain => {}
        }
        self.walk_plain::<SORTED>(start, ray, (t_min, t_max), visit);
    }

    pub(super) fn walk_plain<const SORTED: bool>(
        &self,
        start: Child,
        (ray, padding): (&PreparedRay, Vec3),
        (t_min, t_max): (f32, f32),
        visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        let slabs = Slabs::new(ray, padding, t_min);
        let enters = |n: &WideNode, t: f32, near: &mut [f32; WIDTH]| slabs.enters(n, t, near);
        self.walk_with::<SORTED>(start, ray, (t_min, t_max), enters, visit);
    }

    #[cfg(target_arch = "x86_64")]
    walk_by!(walk_avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
    // The vectors have the same width as with AVX2, but there are more registers.
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
        enters: impl Fn(&WideNode, f32, &mut [f32; WIDTH]) -> u32,
        mut visit: impl FnMut(&Block, &BlockHits, f32) -> f32,
    ) {
        let test = BlockTest::new(ray, t_min);
        let mut storage = StackStorage::new();
        let mut stack = storage.stack(self.stack_size);
        let mut near = EntryDistances([0.0; WIDTH]);
        let mut current = start;
        let mut reach = limit(t_max);
        if !(reach >= 0.0) {
            return;
        }
        loop {
            if current.is_leaf() {
                for block in &self.blocks[current.place()..] {
                    let hits = test.intersect(block, t_max);
                    if hits.mask | block.non_triangles != 0 {
                        t_max = visit(block, &hits, t_max);
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
                let mask = enters(node, reach, &mut near.0);
                let next = match SORTED {
                    true => stack.nearest(node, mask, &near.0),
                    false => stack.any(node, mask),
                };
                if let Some(next) = next {
                    current = next;
                    continue;
                }
            }
            current = loop {
                match stack.pop() {
                    Some(entry) if entry.is_within(reach) => break entry.child(),
                    Some(_) => {}
                    None => return,
                }
            };
        }
    }
}
