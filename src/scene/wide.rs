//! Nodes of eight boxes and leaves of four triangles, each tested at once.
//!
//! Collapsed from the binary tree that obvhs builds. Box and triangle tests are the ones of
//! `traverse`, operation by operation and never fused, so that a hit has the same bits with
//! whatever instructions the processor has. What is not a triangle keeps its place in a leaf and is
//! met by whoever knows what it is.

mod packet;

use std::mem::MaybeUninit;

use glam::Vec3;

pub use packet::{Others, PACKET, Packet, course};

use super::traverse::{Bvh, PreparedRay};

/// Boxes in a node.
const WIDTH: usize = 8;
/// Primitives in a block.
const BLOCK: usize = 4;

/// Eight boxes, plane by plane: smallest x, y, z, then largest. An empty one has its planes the
/// wrong way round and is never entered.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    planes: [[f32; WIDTH]; 6],
    /// The node or the first block behind each box.
    first: [u32; WIDTH],
    /// How many blocks; 0 where a node is.
    blocks: [u32; WIDTH],
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
struct Slabs<'a> {
    ray: &'a PreparedRay,
    /// Which of the six planes the ray comes to first, axis by axis; the others last.
    near: [usize; 3],
    far: [usize; 3],
}

impl<'a> Slabs<'a> {
    fn new(ray: &'a PreparedRay) -> Self {
        let back = |axis: usize| if ray.inverse[axis] < 0.0 { 3 } else { 0 };
        let [x, y, z] = [back(0), back(1), back(2)];
        Self {
            ray,
            near: [x, 1 + y, 2 + z],
            far: [3 - x, 4 - y, 5 - z],
        }
    }

    /// The boxes that the ray enters, as bits, and where. Far distances are widened by 2γ₃ (Ize,
    /// *Robust BVH Ray Traversal*), the one so far included: rounding never loses a box.
    #[inline(always)]
    #[allow(clippy::needless_range_loop)] // the same index into eight arrays, kept for lanes
    fn enters(&self, node: &Node, t_min: f32, t_max: f32, near: &mut [f32; WIDTH]) -> u32 {
        let mut mask = 0;
        for i in 0..WIDTH {
            let at = |plane: usize, axis: usize| {
                (node.planes[plane][i] - self.ray.origin[axis]) * self.ray.inverse[axis]
            };
            let first = |axis: usize| at(self.near[axis], axis);
            let last = |axis: usize| at(self.far[axis], axis);
            near[i] = first(0).max(first(1)).max(first(2)).max(t_min);
            let far = last(0).min(last(1)).min(last(2)).min(t_max);
            let wide = far + far.abs() * WIDENING;
            mask |= u32::from(near[i] <= wide) << i;
        }
        mask
    }
}

const WIDENING: f32 = 4.0 * f32::EPSILON;

/// A box to come back to.
#[derive(Clone, Copy)]
struct Waiting {
    near: f32,
    first: u32,
    blocks: u32,
    /// Which rays of a packet enter it; not used for one ray.
    lanes: u32,
}

impl Waiting {
    const ROOT: Self = Self {
        near: f32::NEG_INFINITY,
        first: 0,
        blocks: 0,
        lanes: 0,
    };
}

const DEEP: usize = 160;

/// Boxes to come back to, the next on top. No tree of any scene so far needs more than the array.
struct Stack {
    array: [MaybeUninit<Waiting>; DEEP],
    filled: usize,
    spilled: Vec<Waiting>,
}

impl Stack {
    fn new() -> Self {
        Self {
            array: [const { MaybeUninit::uninit() }; DEEP],
            filled: 0,
            spilled: Vec::new(),
        }
    }

    #[inline(always)]
    fn push(&mut self, waiting: Waiting) {
        if self.filled < DEEP {
            self.array[self.filled] = MaybeUninit::new(waiting);
            self.filled += 1;
        } else {
            self.spilled.push(waiting);
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Waiting> {
        if self.filled == DEEP
            && let Some(waiting) = self.spilled.pop()
        {
            return Some(waiting);
        }
        self.filled = self.filled.checked_sub(1)?;
        // SAFETY: `push` wrote every place below the old `filled`.
        Some(unsafe { self.array[self.filled].assume_init() })
    }
}

impl Wide {
    /// Leads a ray through the boxes, near ones first. `visit` gets a block and the distance so
    /// far, and answers with the distance of the nearest hit; one below `t_min` ends.
    #[inline]
    pub fn walk(
        &self,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, f32) -> f32,
    ) {
        if !self.nodes.is_empty() {
            self.walk_from(Waiting::ROOT, ray, t_min, t_max, visit);
        }
    }

    #[inline]
    fn walk_from(
        &self,
        start: Waiting,
        ray: &PreparedRay,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, f32) -> f32,
    ) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx") {
            // SAFETY: the processor was just asked.
            unsafe { self.walk_avx(start, &Slabs::new(ray), t_min, t_max, visit) };
            return;
        }
        let slabs = Slabs::new(ray);
        let enters = |n: &Node, t: f32, near: &mut [f32; WIDTH]| slabs.enters(n, t_min, t, near);
        self.walk_with(start, t_min, t_max, enters, visit);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx")]
    fn walk_avx(
        &self,
        start: Waiting,
        slabs: &Slabs<'_>,
        t_min: f32,
        t_max: f32,
        visit: impl FnMut(&Block, f32) -> f32,
    ) {
        use std::arch::x86_64::*;
        // [`Slabs::enters`] eight at a time. A closure, for a function would not be inlined.
        let (origin, inverse) = (slabs.ray.origin, slabs.ray.inverse);
        let origin = [
            _mm256_set1_ps(origin.x),
            _mm256_set1_ps(origin.y),
            _mm256_set1_ps(origin.z),
        ];
        let inverse = [
            _mm256_set1_ps(inverse.x),
            _mm256_set1_ps(inverse.y),
            _mm256_set1_ps(inverse.z),
        ];
        let least = _mm256_set1_ps(t_min);
        let enters = |node: &Node, t_max: f32, near: &mut [f32; WIDTH]| {
            let at = |plane: usize, axis: usize| {
                // SAFETY: a plane is eight floats, aligned to 32 by the node's layout.
                let plane = unsafe { _mm256_load_ps(node.planes[plane].as_ptr()) };
                _mm256_mul_ps(_mm256_sub_ps(plane, origin[axis]), inverse[axis])
            };
            let first = |axis: usize| at(slabs.near[axis], axis);
            let last = |axis: usize| at(slabs.far[axis], axis);
            let n = _mm256_max_ps(_mm256_max_ps(first(0), first(1)), first(2));
            let n = _mm256_max_ps(n, least);
            let f = _mm256_min_ps(_mm256_min_ps(last(0), last(1)), last(2));
            let f = _mm256_min_ps(f, _mm256_set1_ps(t_max));
            let size = _mm256_andnot_ps(_mm256_set1_ps(-0.0), f);
            let wide = _mm256_add_ps(f, _mm256_mul_ps(size, _mm256_set1_ps(WIDENING)));
            // SAFETY: the array is eight floats, and the store needs no alignment.
            unsafe { _mm256_storeu_ps(near.as_mut_ptr(), n) };
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(n, wide)) as u32
        };
        self.walk_with(start, t_min, t_max, enters, visit);
    }

    #[inline(always)]
    fn walk_with(
        &self,
        start: Waiting,
        t_min: f32,
        mut t_max: f32,
        enters: impl Fn(&Node, f32, &mut [f32; WIDTH]) -> u32,
        mut visit: impl FnMut(&Block, f32) -> f32,
    ) {
        let mut stack = Stack::new();
        let mut near = [0.0; WIDTH];
        let mut current = start;
        loop {
            if current.blocks > 0 {
                let first = current.first as usize;
                for block in &self.blocks[first..first + current.blocks as usize] {
                    t_max = visit(block, t_max);
                    if t_max < t_min {
                        return;
                    }
                }
            } else {
                let node = &self.nodes[current.first as usize];
                let mask = enters(node, t_max, &mut near);
                if push_sorted(node, mask, &near, &mut stack, &mut current) {
                    continue;
                }
            }
            let limit = t_max + t_max.abs() * WIDENING;
            current = loop {
                match stack.pop() {
                    Some(waiting) if waiting.near <= limit => break waiting,
                    Some(_) => {}
                    None => return,
                }
            };
        }
    }
}

/// Goes on to the nearest of the boxes entered and keeps the others; false if there is none.
#[inline(always)]
fn push_sorted(
    node: &Node,
    mask: u32,
    near: &[f32; WIDTH],
    stack: &mut Stack,
    current: &mut Waiting,
) -> bool {
    let waiting = |i: usize| Waiting {
        near: near[i],
        first: node.first[i],
        blocks: node.blocks[i],
        lanes: 0,
    };
    let count = mask.count_ones() as usize;
    match count {
        0 => return false,
        1 => {
            *current = waiting(mask.trailing_zeros() as usize);
            return true;
        }
        2 => {
            let a = waiting(mask.trailing_zeros() as usize);
            let b = waiting((31 - mask.leading_zeros()) as usize);
            let (first, second) = if b.near < a.near { (b, a) } else { (a, b) };
            stack.push(second);
            *current = first;
            return true;
        }
        _ => {}
    }
    // Farthest first, by insertion.
    let mut sorted = [waiting(0); WIDTH];
    for (n, i) in bits(mask).enumerate() {
        let new = waiting(i);
        let mut at = n;
        while at > 0 && sorted[at - 1].near < new.near {
            sorted[at] = sorted[at - 1];
            at -= 1;
        }
        sorted[at] = new;
    }
    sorted[..count - 1].iter().for_each(|w| stack.push(*w));
    *current = sorted[count - 1];
    true
}

impl Wide {
    /// Collapses a binary tree. `triangle` gives a primitive's corners, nothing for what is no
    /// triangle.
    pub fn collapse(
        binary: &Bvh,
        order: &[u32],
        triangle: impl Fn(u32) -> Option<[Vec3; 3]>,
    ) -> Self {
        let mut this = Self::default();
        if binary.nodes.is_empty() {
            return this;
        }
        let sizes = sizes(binary);
        // Binary nodes to open, and where the wide node goes.
        let mut ahead = vec![(0u32, this.new_node())];
        while let Some((from, to)) = ahead.pop() {
            for (i, child) in eight(binary, &sizes, from).into_iter().enumerate() {
                let node = &binary.nodes[child as usize];
                let (first, blocks) = if is_leaf(&sizes, binary, child) {
                    this.add_blocks(&gather(binary, order, child), &triangle)
                } else {
                    let place = this.new_node();
                    ahead.push((child, place));
                    (place, 0)
                };
                let wide = &mut this.nodes[to as usize];
                for axis in 0..3 {
                    wide.planes[axis][i] = node.min[axis];
                    wide.planes[axis + 3][i] = node.max[axis];
                }
                wide.first[i] = first;
                wide.blocks[i] = blocks;
            }
        }
        this
    }

    /// Memory of nodes and blocks.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(&self.nodes[..]) + std::mem::size_of_val(&self.blocks[..])
    }

    fn new_node(&mut self) -> u32 {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        self.nodes.push(Node {
            planes: [low, low, low, high, high, high],
            first: [0; WIDTH],
            blocks: [0; WIDTH],
        });
        self.nodes.len() as u32 - 1
    }

    fn add_blocks(
        &mut self,
        primitives: &[u32],
        triangle: impl Fn(u32) -> Option<[Vec3; 3]>,
    ) -> (u32, u32) {
        let first = self.blocks.len();
        for four in primitives.chunks(BLOCK) {
            let mut block = Block::EMPTY;
            for (lane, &primitive) in four.iter().enumerate() {
                block.primitives[lane] = primitive;
                match triangle(primitive) {
                    None => block.others |= 1 << lane,
                    Some(corners) => {
                        for (to, from) in block.corners.iter_mut().zip(corners) {
                            (0..3).for_each(|axis| to[axis][lane] = from[axis]);
                        }
                    }
                }
            }
            self.blocks.push(block);
        }
        (first as u32, (self.blocks.len() - first) as u32)
    }
}

/// Primitives under each node.
fn sizes(binary: &Bvh) -> Vec<u32> {
    let mut sizes = vec![0; binary.nodes.len()];
    let mut ahead = vec![(0usize, false)];
    while let Some((at, done)) = ahead.pop() {
        let node = &binary.nodes[at];
        let first = node.first as usize;
        if node.count > 0 {
            sizes[at] = node.count;
        } else if done {
            sizes[at] = sizes[first] + sizes[first + 1];
        } else {
            ahead.extend([(at, true), (first, false), (first + 1, false)]);
        }
    }
    sizes
}

/// What fits into a block is a leaf, whatever the binary tree makes of it.
fn is_leaf(sizes: &[u32], binary: &Bvh, node: u32) -> bool {
    binary.nodes[node as usize].count > 0 || sizes[node as usize] <= BLOCK as u32
}

/// Up to eight descendants in place of a node: the one of the largest surface is opened next.
fn eight(binary: &Bvh, sizes: &[u32], from: u32) -> Vec<u32> {
    let mut open = vec![from];
    while open.len() < WIDTH {
        let area = |n: u32| {
            let node = &binary.nodes[n as usize];
            let d = node.max - node.min;
            d.x * d.y + d.y * d.z + d.z * d.x
        };
        let widest = (0..open.len())
            .filter(|&i| !is_leaf(sizes, binary, open[i]))
            .max_by(|&a, &b| area(open[a]).total_cmp(&area(open[b])));
        let Some(at) = widest else {
            break;
        };
        let first = binary.nodes[open[at] as usize].first;
        open[at] = first;
        open.push(first + 1);
    }
    open
}

/// The primitives under a node.
fn gather(binary: &Bvh, order: &[u32], from: u32) -> Vec<u32> {
    let mut found = Vec::new();
    let mut ahead = vec![from];
    while let Some(at) = ahead.pop() {
        let node = &binary.nodes[at as usize];
        if node.count > 0 {
            let slots = node.first as usize..(node.first + node.count) as usize;
            found.extend_from_slice(&order[slots]);
        } else {
            ahead.extend([node.first + 1, node.first]);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::mix;
    use crate::scene::Ray;
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
            let slabs = Slabs::new(&prepared);
            let enters = |n: &Node, t: f32, near: &mut [f32; WIDTH]| slabs.enters(n, 0.0, t, near);
            tree.walk_with(Waiting::ROOT, 0.0, f32::INFINITY, enters, visit);
        } else {
            tree.walk(&prepared, 0.0, f32::INFINITY, visit);
        }
        nearest
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
