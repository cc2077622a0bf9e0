//! Nodes of eight boxes and leaves of four triangles, each tested at once.
//!
//! Collapsed from the binary tree that obvhs builds. Box and triangle tests are the ones of
//! `traverse`, operation by operation and never fused, so that a hit has the same bits with
//! whatever instructions the processor has. What is not a triangle keeps its place in a leaf and is
//! met by whoever knows what it is.

mod collapse;
mod packet;

use std::mem::MaybeUninit;

use glam::Vec3;

pub use packet::{Others, PACKET, Packet, course};

use super::traverse::PreparedRay;

/// Boxes in a node.
const WIDTH: usize = 8;
/// Primitives in a block.
const BLOCK: usize = 4;

/// Eight boxes, plane by plane: smallest x, y, z, then largest. An empty one has its planes the
/// wrong way round and is never entered.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
struct Node {
    planes: [[f32; WIDTH]; 6],
    children: [Child; WIDTH],
}

/// What is behind a box: a node, or the first block of a leaf.
#[derive(Clone, Copy, Debug)]
struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const ROOT: Self = Self(0);

    fn leaf(block: usize) -> Self {
        Self(block as u32 | Self::LEAF)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    fn place(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// Four primitives of a leaf.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub struct Block {
    /// Corner by corner, axis by axis; NaN, which nothing meets, where there is no triangle.
    corners: [[[f32; BLOCK]; 3]; 3],
    primitives: [u32; BLOCK],
    /// Which of the four are other things than triangles: bits.
    others: u32,
    /// No other block of the leaf is behind this one.
    last: bool,
}

/// The triangles of a block that a ray meets: bits, and where.
pub struct Met {
    pub mask: u32,
    pub t: [f32; BLOCK],
    pub u: [f32; BLOCK],
    pub v: [f32; BLOCK],
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub struct Wide {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

/// Set bits, lowest first.
pub fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        at
    })
}

impl Block {
    const EMPTY: Self = Self {
        corners: [[[f32::NAN; BLOCK]; 3]; 3],
        primitives: [0; BLOCK],
        others: 0,
        last: true,
    };

    pub fn primitive(&self, lane: usize) -> u32 {
        self.primitives[lane]
    }

    pub fn others(&self) -> u32 {
        self.others
    }

    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        self.corners
            .map(|c| Vec3::new(c[0][lane], c[1][lane], c[2][lane]))
    }

    /// [`PreparedRay::triangle`] for all four.
    #[inline(always)]
    #[cfg(not(target_arch = "x86_64"))]
    pub fn meet(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Met {
        let mut met = Met {
            mask: 0,
            t: [0.0; BLOCK],
            u: [0.0; BLOCK],
            v: [0.0; BLOCK],
        };
        for lane in 0..BLOCK {
            met.set(lane, ray.triangle(&self.triangle(lane), t_min, t_max));
        }
        met
    }

    /// [`PreparedRay::triangle`] for all four, the same operations in the same order. Lanes with
    /// an edge value of exactly 0, which f64 decides, are done by themselves.
    #[inline(always)]
    #[cfg(target_arch = "x86_64")]
    pub fn meet(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Met {
        use std::arch::x86_64::*;
        let [kx, ky, kz] = ray.axes;
        // SAFETY: SSE is part of every x86-64 processor, the loads are from arrays of four floats
        // aligned to 16 by the block's layout (48-byte corners, 16-byte rows), and the stores are
        // unaligned ones to arrays of four.
        unsafe {
            let from_ray = |corner: usize, axis: usize| {
                _mm_sub_ps(
                    _mm_load_ps(self.corners[corner][axis].as_ptr()),
                    _mm_set1_ps(ray.origin[axis]),
                )
            };
            let (sx, sy) = (_mm_set1_ps(ray.shear.x), _mm_set1_ps(ray.shear.y));
            let sheared = |corner: usize| {
                let z = from_ray(corner, kz);
                let x = _mm_sub_ps(from_ray(corner, kx), _mm_mul_ps(sx, z));
                let y = _mm_sub_ps(from_ray(corner, ky), _mm_mul_ps(sy, z));
                (x, y, z)
            };
            let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(0), sheared(1), sheared(2));
            let cross = |px, qy, py, qx| _mm_sub_ps(_mm_mul_ps(px, qy), _mm_mul_ps(py, qx));
            let u = cross(cx, by, cy, bx);
            let v = cross(ax, cy, ay, cx);
            let w = cross(bx, ay, by, ax);
            let zero = _mm_setzero_ps();
            let or = |a, b, c| _mm_or_ps(_mm_or_ps(a, b), c);
            let below = |a| _mm_cmplt_ps(a, zero);
            let above = |a| _mm_cmpgt_ps(a, zero);
            let on = |a| _mm_cmpeq_ps(a, zero);
            let negative = or(below(u), below(v), below(w));
            let positive = or(above(u), above(v), above(w));
            let exact = _mm_movemask_ps(or(on(u), on(v), on(w))) as u32;
            let mut mask = !_mm_movemask_ps(_mm_and_ps(negative, positive)) as u32 & 15 & !exact;
            let mut met = Met {
                mask: 0,
                t: [0.0; BLOCK],
                u: [0.0; BLOCK],
                v: [0.0; BLOCK],
            };
            if mask != 0 {
                let det = _mm_add_ps(_mm_add_ps(u, v), w);
                let sum = _mm_add_ps(
                    _mm_add_ps(_mm_mul_ps(u, az), _mm_mul_ps(v, bz)),
                    _mm_mul_ps(w, cz),
                );
                let t = _mm_div_ps(_mm_mul_ps(sum, _mm_set1_ps(ray.shear.z)), det);
                let near = _mm_cmpgt_ps(t, _mm_set1_ps(t_min));
                let far = _mm_cmplt_ps(t, _mm_set1_ps(t_max));
                let whole = _mm_cmpneq_ps(det, zero);
                let good = _mm_and_ps(_mm_and_ps(near, far), whole);
                mask &= _mm_movemask_ps(good) as u32;
                if mask != 0 {
                    _mm_storeu_ps(met.t.as_mut_ptr(), t);
                    _mm_storeu_ps(met.u.as_mut_ptr(), _mm_div_ps(v, det));
                    _mm_storeu_ps(met.v.as_mut_ptr(), _mm_div_ps(w, det));
                }
            }
            met.mask = mask;
            for lane in bits(exact) {
                met.set(lane, ray.triangle(&self.triangle(lane), t_min, t_max));
            }
            met
        }
    }
}

impl Met {
    fn set(&mut self, lane: usize, hit: Option<(f32, f32, f32)>) {
        if let Some((t, u, v)) = hit {
            self.mask |= 1 << lane;
            (self.t[lane], self.u[lane], self.v[lane]) = (t, u, v);
        }
    }
}

/// What a node's boxes ask of a ray.
struct Slabs {
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

const WIDENING: f32 = 4.0 * f32::EPSILON;

/// How far a box may be when something has been met at `t`.
#[inline(always)]
fn limit(t: f32) -> f32 {
    t + t.abs() * WIDENING
}

const DEEP: usize = 128;

/// What to come back to, the next on top. No tree of any scene so far needs more than the array.
struct Stack<T> {
    array: [MaybeUninit<T>; DEEP],
    filled: usize,
    spilled: Vec<T>,
}

impl<T: Copy> Stack<T> {
    fn new() -> Self {
        Self {
            array: [const { MaybeUninit::uninit() }; DEEP],
            filled: 0,
            spilled: Vec::new(),
        }
    }

    /// Makes sure that a node's boxes have room in the array.
    #[inline(always)]
    fn make_room(&mut self) {
        if self.filled + WIDTH > DEEP {
            self.spill();
        }
    }

    #[cold]
    fn spill(&mut self) {
        let held = &self.array[..self.filled];
        // SAFETY: every place below `filled` has been written.
        self.spilled
            .extend(held.iter().map(|t| unsafe { t.assume_init() }));
        self.filled = 0;
    }

    #[inline(always)]
    fn push(&mut self, waiting: T) {
        self.array[self.filled] = MaybeUninit::new(waiting);
        self.filled += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<T> {
        if self.filled == 0 {
            return self.spilled.pop();
        }
        self.filled -= 1;
        // SAFETY: every place below the old `filled` has been written.
        Some(unsafe { self.array[self.filled].assume_init() })
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

impl Stack<Waiting> {
    /// The nearest of the boxes entered, while the others are kept; nothing if there is none. Which
    /// of the cases it is can be guessed by the processor, as rays that follow each other do the
    /// same: without branches this takes a fifth more time.
    #[inline(always)]
    fn nearest(&mut self, node: &Node, mask: u32, near: &[f32; WIDTH]) -> Option<Child> {
        let rest = mask & mask.wrapping_sub(1);
        let a = mask.trailing_zeros() as usize % WIDTH;
        if rest == 0 {
            return (mask != 0).then(|| node.children[a]);
        }
        self.make_room();
        let waiting = |i: usize| Waiting::new(near[i], node.children[i]);
        let b = rest.trailing_zeros() as usize % WIDTH;
        let more = rest & rest.wrapping_sub(1);
        let (nearer, farther) = if near[b] < near[a] { (b, a) } else { (a, b) };
        if more == 0 {
            self.push(waiting(farther));
            return Some(node.children[nearer]);
        }
        let start = self.filled;
        self.push(waiting(farther));
        self.push(waiting(nearer));
        for i in bits(more) {
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
        self.make_room();
        for i in bits(mask & (mask - 1)) {
            self.push(Waiting::new(0.0, node.children[i % WIDTH]));
        }
        Some(node.children[mask.trailing_zeros() as usize % WIDTH])
    }

    /// Puts one among those from `start` on, which are sorted, the nearest on top.
    #[inline(always)]
    fn insert(&mut self, start: usize, new: Waiting) {
        let mut at = self.filled;
        while at > start {
            // SAFETY: every place below `filled` has been written.
            let before = unsafe { self.array[at - 1].assume_init() };
            if before >= new {
                break;
            }
            self.array[at] = MaybeUninit::new(before);
            at -= 1;
        }
        self.array[at] = MaybeUninit::new(new);
        self.filled += 1;
    }
}

impl Wide {
    /// Leads a ray through the boxes, near ones first, from `t_min` on, which is not negative.
    /// `visit` gets a block and the distance so far, and answers with the distance of the nearest
    /// hit; one below `t_min` ends.
    #[inline]
    pub fn walk(
        &self,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, f32) -> f32,
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
        visit: impl FnMut(&Block, f32) -> f32,
    ) {
        if !self.nodes.is_empty() {
            self.walk_from::<false>(Child::ROOT, ray, t_min, t_max, visit);
        }
    }

    #[inline]
    fn walk_from<const SORTED: bool>(
        &self,
        start: Child,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, f32) -> f32,
    ) {
        // A smallest distance of −0 has the bits of a large one.
        let slabs = Slabs::new(ray, if t_min > 0.0 { t_min } else { 0.0 });
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor was just asked; every one with AVX2 counts bits too.
            unsafe { self.walk_avx2::<SORTED>(start, &slabs, t_max, visit) };
            return;
        }
        let enters = |n: &Node, t: f32, near: &mut [f32; WIDTH]| slabs.enters(n, t, near);
        self.walk_with::<SORTED>(start, slabs.t_min, t_max, enters, visit);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,lzcnt,popcnt")]
    fn walk_avx2<const SORTED: bool>(
        &self,
        start: Child,
        slabs: &Slabs,
        t_max: f32,
        visit: impl FnMut(&Block, f32) -> f32,
    ) {
        use std::arch::x86_64::*;
        // [`Slabs::enters`] eight at a time, in half the operations: a plane's distance is its
        // place times the inverse, less the origin's. What the rounding of the origin's takes is
        // given back. A closure, for a function would not be inlined.
        let all = |v: Vec3| {
            [
                _mm256_set1_ps(v.x),
                _mm256_set1_ps(v.y),
                _mm256_set1_ps(v.z),
            ]
        };
        let (first, last) = (slabs.origin * slabs.inverse, slabs.origin * slabs.wider);
        let near_from = all(-first - first.abs() * f32::EPSILON);
        let far_from = all(-last + last.abs() * f32::EPSILON);
        let (inverse, wider) = (all(slabs.inverse), all(slabs.wider));
        let least = _mm256_set1_ps(slabs.t_min);
        let enters = |node: &Node, limit: f32, near: &mut [f32; WIDTH]| {
            let planes = node.planes.as_ptr().cast::<f32>();
            // SAFETY: `Slabs` names planes 0 to 5, each of eight floats and aligned to 32 by the
            // node's layout.
            let plane = |plane: usize| unsafe { _mm256_load_ps(planes.add(plane * WIDTH)) };
            let first = |a: usize| _mm256_fmadd_ps(plane(slabs.near[a]), inverse[a], near_from[a]);
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
        self.walk_with::<SORTED>(start, slabs.t_min, t_max, enters, visit);
    }

    #[inline(always)]
    fn walk_with<const SORTED: bool>(
        &self,
        start: Child,
        t_min: f32,
        mut t_max: f32,
        enters: impl Fn(&Node, f32, &mut [f32; WIDTH]) -> u32,
        mut visit: impl FnMut(&Block, f32) -> f32,
    ) {
        let mut stack = Stack::new();
        let mut near = [0.0; WIDTH];
        let mut current = start;
        let mut reach = limit(t_max);
        if !(reach >= 0.0) {
            return;
        }
        loop {
            if current.is_leaf() {
                for block in &self.blocks[current.place()..] {
                    t_max = visit(block, t_max);
                    if t_max < t_min {
                        return;
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
    use crate::sampling::mix;
    use crate::scene::Ray;
    use crate::scene::traverse::Bvh;
    use crate::scene::traverse::tests::brute;

    /// The nearest hit, by the instructions of the processor or without them.
    fn led(tree: &Wide, ray: &Ray, plain: bool) -> Option<f32> {
        let prepared = PreparedRay::new(ray);
        let mut nearest = None;
        let visit = |block: &Block, mut t_max: f32| {
            let met = block.meet(&prepared, 0.0, t_max);
            for lane in bits(met.mask) {
                if met.t[lane] < t_max {
                    t_max = met.t[lane];
                    nearest = Some(t_max);
                }
            }
            t_max
        };
        if plain {
            let slabs = Slabs::new(&prepared, 0.0);
            let enters = |n: &Node, t: f32, near: &mut [f32; WIDTH]| slabs.enters(n, t, near);
            tree.walk_with::<true>(Child::ROOT, 0.0, f32::INFINITY, enters, visit);
        } else {
            tree.walk(&prepared, 0.0, f32::INFINITY, visit);
        }
        nearest
    }

    /// Whether something is met, in whatever order.
    fn any(tree: &Wide, ray: &Ray) -> bool {
        let prepared = PreparedRay::new(ray);
        let mut met = false;
        tree.walk_any(&prepared, 0.0, f32::INFINITY, |block, t_max| {
            met |= block.meet(&prepared, 0.0, t_max).mask != 0;
            if met { -1.0 } else { t_max }
        });
        met
    }

    /// Thin triangles near and far, small and large.
    fn triangles(mut unit: impl FnMut() -> f32) -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for i in 0..2000 {
            let far = if i % 3 == 0 { 1e3 } else { 1.0 };
            let at = Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5) * 2.0 * far;
            let size = if i % 2 == 0 { 0.3 } else { 1e-4 };
            let mut edge = || Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5) * size;
            triangles.push([at, at + edge(), at + edge()]);
        }
        triangles
    }

    fn tree(triangles: &[[Vec3; 3]]) -> Wide {
        let boxes: Vec<(Vec3, Vec3)> = triangles
            .iter()
            .map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c)))
            .collect();
        let (binary, order) = Bvh::build(&boxes);
        Wide::collapse(&binary, &order, |p| Some(triangles[p as usize]))
    }

    /// 30,000 rays: along an axis or almost, −0.0 and tiny components included; from a point on
    /// one triangle to another; and from within a hundred-thousandth of what they hit.
    #[test]
    fn no_hit_is_lost_that_trying_every_triangle_finds() {
        let mut state = 7u64;
        let mut unit = move || {
            state = mix(state);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let triangles = triangles(&mut unit);
        let tree = tree(&triangles);
        let tiny = [0.0f32, -0.0, 1e-9, -1e-9, 1e-30, -1e-38, 1e-6];
        let mut hits = 0;
        for i in 0..30_000usize {
            let [a, b, c] = triangles[i % triangles.len()];
            let inside = (a + b + c) / 3.0;
            let ray = match i / 10_000 {
                0 | 1 => {
                    let (axis, sign) = (i % 3, if i % 2 == 0 { 1.0 } else { -1.0 });
                    let mut direction = Vec3::ZERO;
                    direction[axis] = sign;
                    direction[(axis + 1) % 3] = tiny[i % tiny.len()];
                    direction[(axis + 2) % 3] = tiny[(i / 7) % tiny.len()];
                    let mut origin = inside;
                    origin[axis] -= sign * if i < 10_000 { 3.0 } else { 1e-5 };
                    Ray::new(origin, direction)
                }
                _ => {
                    let [d, ..] = triangles[(i * 7 + 1) % triangles.len()];
                    Ray::new(d, (inside - d) * (1.0 + unit()))
                }
            };
            let expected = brute(&triangles, &ray);
            assert_eq!(expected, led(&tree, &ray, false), "ray {i}: {ray:?}");
            assert_eq!(expected, led(&tree, &ray, true), "ray {i}, plain: {ray:?}");
            assert_eq!(
                expected.is_some(),
                any(&tree, &ray),
                "ray {i}, any: {ray:?}"
            );
            hits += usize::from(expected.is_some());
        }
        assert!(hits > 20_000, "only {hits} hits: the test tests little");
    }

    #[test]
    fn an_empty_tree_and_one_of_one_triangle_are_trees() {
        let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        assert_eq!(led(&tree(&[]), &ray, false), None);
        assert_eq!(
            led(&tree(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]), &ray, false),
            Some(1.0)
        );
    }
}
