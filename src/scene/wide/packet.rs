//! The rays of a bundle at once through the tree, for rays that go much the same way.
//!
//! A node's eight boxes are first tried against an interval around the packet; the few that are
//! left against every ray, sixteen at a time. A triangle is met by all rays together, by the
//! operations of one ray, so that a hit has the same bits. Where few rays are left they go on one by one. Without the
//! wide vectors for this the caller traces rays one by one.

use glam::Vec3;

use super::super::bundle::{BUNDLE, RayLanes, Side};
use super::super::traverse::{PreparedRay, Ray, invert};
#[cfg(target_arch = "x86_64")]
use super::walk::{Room, Stack, WIDENING};
use super::{Block, Child, Met, Wide, bits};
#[cfg(target_arch = "x86_64")]
use super::{Node, WIDTH, block::BLOCK};

/// Rays in a packet.
pub const PACKET: usize = BUNDLE;
/// Numbers in a vector.
#[cfg(target_arch = "x86_64")]
const VECTOR: usize = 16;
/// As many rays as this, or fewer, are faster one by one.
const FEW: u32 = 3;

/// Hits within this share of their distance are close: twice the thickness of a plane.
const CLOSE: f32 = 2.0 * super::super::COPLANAR;

type Lanes = Side;

/// A box to come back to.
#[derive(Clone, Copy)]
#[cfg(target_arch = "x86_64")]
struct Waiting {
    near: f32,
    child: Child,
    /// Which rays of the packet enter it.
    lanes: u32,
}

/// Rays of one course: the same signs in the directions, the same longest axis.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Packet {
    origin: [Lanes; 3],
    direction: [Lanes; 3],
    inverse: [Lanes; 3],
    /// Where the ways to planes begin: less the origin's, and what its rounding takes given back.
    near_from: [Lanes; 3],
    far_from: [Lanes; 3],
    shear: [Lanes; 3],
    t_min: Lanes,
    /// The nearest hit so far, or the farthest distance that counts.
    t: Lanes,
    u: Lanes,
    v: Lanes,
    primitive: [u32; PACKET],
    /// Which rays have met something: bits.
    pub found: u32,
    /// Which have met two things so near together that it matters which is taken.
    pub close: u32,
    live: u32,
    axes: [usize; 3],
    /// Which of a node's planes all rays come to first and last.
    near: [usize; 3],
    far: [usize; 3],
    /// What gives the nearest and the farthest distances on each axis.
    interval: [Interval; 3],
}

/// Bounds over the rays of a packet, on one axis.
#[derive(Clone, Copy, Debug, Default)]
struct Interval {
    /// The origin from which the first plane is nearest, and the last farthest.
    origin: [f32; 2],
    inverse: [f32; 2],
}

/// Distances, the weights of a triangle's second and third corner, and primitives.
pub struct Found<'a> {
    pub t: &'a Lanes,
    pub u: &'a Lanes,
    pub v: &'a Lanes,
    pub primitive: &'a [u32; PACKET],
}

/// What the rays of a packet must agree on: three signs and the longest axis.
pub fn course(ray: &Ray) -> u8 {
    let d = ray.direction;
    let a = d.abs();
    let z = if a.x > a.y && a.x > a.z {
        0
    } else if a.y > a.z {
        1
    } else {
        2
    };
    z << 3 | u8::from(d.x < 0.0) | u8::from(d.y < 0.0) << 1 | u8::from(d.z < 0.0) << 2
}

impl Packet {
    pub const fn empty() -> Self {
        Self {
            origin: [[0.0; PACKET]; 3],
            direction: [[1.0; PACKET]; 3],
            inverse: [[1.0; PACKET]; 3],
            near_from: [[0.0; PACKET]; 3],
            far_from: [[0.0; PACKET]; 3],
            shear: [[1.0; PACKET]; 3],
            t_min: [0.0; PACKET],
            t: [f32::NEG_INFINITY; PACKET],
            u: [0.0; PACKET],
            v: [0.0; PACKET],
            primitive: [0; PACKET],
            found: 0,
            close: 0,
            live: 0,
            axes: [0, 1, 2],
            near: [0, 1, 2],
            far: [3, 4, 5],
            interval: [Interval {
                origin: [0.0; 2],
                inverse: [0.0; 2],
            }; 3],
        }
    }

    /// Whether this processor has the instructions.
    pub fn is_worth_while() -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx2")
        }
        #[cfg(not(target_arch = "x86_64"))]
        false
    }

    /// Takes rays of one course, at most [`PACKET`]; distances must be finite.
    pub fn fill<'a>(&mut self, rays: impl Iterator<Item = &'a Ray>) {
        let mut count = 0;
        for (lane, ray) in rays.take(PACKET).enumerate() {
            let d = ray.direction + Vec3::ZERO; // turns −0.0 into +0.0
            for axis in 0..3 {
                self.origin[axis][lane] = ray.origin[axis];
                self.direction[axis][lane] = d[axis];
            }
            self.t_min[lane] = ray.t_min;
            self.t[lane] = ray.t_max.min(f32::MAX);
            count = lane + 1;
        }
        // What is left over is the last ray again, and never asked for.
        for lane in count..PACKET {
            for axis in 0..3 {
                self.origin[axis][lane] = self.origin[axis][count.max(1) - 1];
                self.direction[axis][lane] = self.direction[axis][count.max(1) - 1];
            }
            self.t_min[lane] = 0.0;
            self.t[lane] = f32::NEG_INFINITY;
        }
        self.live = ((1u64 << count) - 1) as u32;
        (self.found, self.close) = (0, 0);
        #[cfg(target_arch = "x86_64")]
        if Packet::is_worth_while() {
            // SAFETY: the processor was just asked.
            unsafe { self.prepare_avx512() };
            return;
        }
        self.prepare(bounds);
    }

    /// Takes the rays of a bundle, at least one, that are of one course.
    pub fn load(&mut self, rays: &RayLanes) {
        #[cfg(target_arch = "x86_64")]
        if Packet::is_worth_while() {
            // SAFETY: the processor was just asked.
            unsafe { self.load_avx512(rays) };
            return;
        }
        self.take_lanes(rays);
        self.prepare(bounds);
    }

    #[inline(always)]
    fn take_lanes(&mut self, rays: &RayLanes) {
        let live = rays.mask;
        // What holds no ray is another ray again, and never asked for.
        let some = live.trailing_zeros() as usize;
        for axis in 0..3 {
            let (from, to) = (&rays.origin[axis], &rays.direction[axis]);
            let (other_from, other_to) = (from[some], to[some]);
            for lane in 0..PACKET {
                let on = live >> lane & 1 == 1;
                self.origin[axis][lane] = if on { from[lane] } else { other_from };
                let d = if on { to[lane] } else { other_to };
                self.direction[axis][lane] = d + 0.0; // turns −0.0 into +0.0
            }
        }
        for (lane, t_max) in rays.t_max.iter().enumerate() {
            let end = if *t_max < f32::MAX { *t_max } else { f32::MAX };
            let on = live >> lane & 1 == 1;
            self.t[lane] = if on { end } else { f32::NEG_INFINITY };
        }
        self.t_min = [0.0; PACKET];
        self.live = live;
        (self.found, self.close) = (0, 0);
    }

    /// What the tests of boxes and triangles need, as [`PreparedRay::new`] makes it for one ray.
    #[inline(always)]
    fn prepare(&mut self, bounds: impl Fn(&Lanes) -> (f32, f32)) {
        let of = |all: &[Lanes; 3]| Vec3::new(all[0][0], all[1][0], all[2][0]);
        let first = PreparedRay::new(&Ray::new(of(&self.origin), of(&self.direction)));
        let [kx, ky, kz] = first.axes;
        self.axes = first.axes;
        for axis in 0..3 {
            for lane in 0..PACKET {
                let inverse = invert(self.direction[axis][lane]);
                let from = self.origin[axis][lane] * inverse;
                self.inverse[axis][lane] = inverse;
                self.near_from[axis][lane] = -from - from.abs() * f32::EPSILON;
                self.far_from[axis][lane] = -from + from.abs() * f32::EPSILON;
            }
            let back = first.inverse[axis] < 0.0;
            self.near[axis] = if back { axis + 3 } else { axis };
            self.far[axis] = if back { axis } else { axis + 3 };
            let (low, high) = bounds(&self.origin[axis]);
            let (slow, fast) = bounds(&self.inverse[axis]);
            self.interval[axis] = Interval {
                origin: if back { [low, high] } else { [high, low] },
                inverse: [slow, fast],
            };
        }
        for lane in 0..PACKET {
            let z = self.direction[kz][lane];
            self.shear[0][lane] = self.direction[kx][lane] / z;
            self.shear[1][lane] = self.direction[ky][lane] / z;
            self.shear[2][lane] = 1.0 / z;
        }
    }

    /// One of the rays.
    fn ray(&self, lane: usize) -> PreparedRay {
        let of = |all: &[Lanes; 3]| Vec3::new(all[0][lane], all[1][lane], all[2][lane]);
        PreparedRay {
            origin: of(&self.origin),
            direction: of(&self.direction),
            inverse: of(&self.inverse),
            axes: self.axes,
            shear: of(&self.shear),
        }
    }

    /// What the rays that have `found` something have met.
    pub fn hits(&self) -> Found<'_> {
        Found {
            t: &self.t,
            u: &self.u,
            v: &self.v,
            primitive: &self.primitive,
        }
    }

    /// Takes a hit if it is nearer, and notes if it is no farther than the nearest can tell.
    fn take(&mut self, lane: usize, primitive: u32, (t, u, v): (f32, f32, f32)) {
        let best = self.t[lane];
        let apart = (t - best).abs();
        if self.found >> lane & 1 == 1 && apart <= best * CLOSE {
            self.close |= 1 << lane;
        }
        if t < best {
            self.t[lane] = t;
            (self.u[lane], self.v[lane]) = (u, v);
            self.primitive[lane] = primitive;
            self.found |= 1 << lane;
        }
    }

    /// Up to where hits of a ray must be looked at.
    fn reach(&self, lane: usize) -> f32 {
        let t = self.t[lane];
        if self.found >> lane & 1 == 1 {
            t + t * CLOSE
        } else {
            t
        }
    }
}

/// Least and greatest.
fn bounds(lanes: &Lanes) -> (f32, f32) {
    let least = lanes.iter().copied().fold(f32::INFINITY, f32::min);
    let greatest = lanes.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    (least, greatest)
}

/// Where a ray meets what is not a triangle.
pub trait Others {
    fn meet(&self, ray: &PreparedRay, primitive: u32, t_min: f32, t_max: f32) -> Option<f32>;
}

impl Wide {
    /// The nearest hit of every ray of a packet that is not `close`. With `ANY`, `found` alone
    /// means something, and any hit nearer than `t` will do.
    pub fn meet_packet<const ANY: bool>(&self, packet: &mut Packet, others: &impl Others) {
        if self.nodes.is_empty() || packet.live == 0 {
            return;
        }
        #[cfg(target_arch = "x86_64")]
        if Packet::is_worth_while() {
            // SAFETY: the processor was just asked.
            unsafe { self.meet_avx512::<ANY>(packet, others) };
            return;
        }
        for lane in bits(packet.live) {
            self.go_on::<ANY>(Child::ROOT, lane, packet, others);
        }
    }

    /// One ray by itself, from a box on.
    #[inline(never)]
    fn go_on<const ANY: bool>(
        &self,
        from: Child,
        lane: usize,
        packet: &mut Packet,
        others: &impl Others,
    ) {
        let ray = packet.ray(lane);
        let (t_min, t_max) = (packet.t_min[lane], packet.reach(lane));
        let visit = |block: &Block, met: &Met, _: f32| {
            for i in bits(met.mask) {
                packet.take(lane, block.primitive(i), (met.t[i], met.u[i], met.v[i]));
            }
            for i in bits(block.others()) {
                packet.meet_other(lane, &ray, block.primitive(i), others);
            }
            if ANY && packet.found >> lane & 1 == 1 {
                f32::NEG_INFINITY
            } else {
                packet.reach(lane)
            }
        };
        if ANY {
            self.walk_from::<false>(from, &ray, t_min, t_max, visit);
        } else {
            self.walk_from::<true>(from, &ray, t_min, t_max, visit);
        }
    }
}

impl Packet {
    fn meet_other(&mut self, lane: usize, ray: &PreparedRay, primitive: u32, others: &impl Others) {
        let mut from = self.t_min[lane];
        // A curved one may be met twice.
        while let Some(t) = others.meet(ray, primitive, from, self.reach(lane)) {
            self.take(lane, primitive, (t, 0.0, 0.0));
            from = t;
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::*;

    use super::*;

    impl Wide {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,bmi1,bmi2,popcnt,lzcnt")]
        pub(super) fn meet_avx512<const ANY: bool>(
            &self,
            packet: &mut Packet,
            others: &impl Others,
        ) {
            let mut room = Room::new();
            let mut stack = room.stack(self.waiting);
            let mut current = Waiting {
                near: 0.0,
                child: Child::ROOT,
                lanes: packet.live,
            };
            let mut limit = packet.limit(packet.live);
            loop {
                if ANY {
                    current.lanes &= !packet.found;
                }
                if current.lanes.count_ones() <= FEW {
                    for lane in bits(current.lanes) {
                        self.go_on::<ANY>(current.child, lane, packet, others);
                    }
                    limit = packet.limit(packet.live);
                } else if current.child.is_leaf() {
                    for block in &self.blocks[current.child.place()..] {
                        packet.meet_block::<ANY>(block, current.lanes, others);
                        if block.last {
                            break;
                        }
                    }
                    limit = packet.limit(packet.live);
                } else {
                    let node = &self.nodes[current.child.place()];
                    if packet.enter(node, limit, &mut current, &mut stack) {
                        continue;
                    }
                }
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

    impl Packet {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2")]
        pub(super) fn load_avx512(&mut self, rays: &RayLanes) {
            self.take_lanes(rays);
            self.prepare_avx512();
        }

        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2")]
        pub(super) fn prepare_avx512(&mut self) {
            self.prepare(|of| {
                let [a, b] = [Self::lanes(of, 0), Self::lanes(of, VECTOR)];
                (
                    _mm512_reduce_min_ps(_mm512_min_ps(a, b)),
                    _mm512_reduce_max_ps(_mm512_max_ps(a, b)),
                )
            });
        }

        #[inline]
        #[target_feature(enable = "avx512f")]
        fn lanes(of: &Lanes, first: usize) -> __m512 {
            const { assert!(PACKET == 2 * VECTOR) }
            // SAFETY: sixteen floats from one of the two places; the load needs no alignment.
            unsafe { _mm512_loadu_ps(of.as_ptr().add(first & VECTOR)) }
        }

        /// The farthest distance that still counts for any of the rays, widened, but finite: an
        /// empty box is farther.
        #[inline]
        #[target_feature(enable = "avx512f")]
        fn limit(&self, lanes: u32) -> f32 {
            let reach = |first: usize| {
                _mm512_mask_reduce_max_ps((lanes >> first) as u16, Self::lanes(&self.t, first))
            };
            let t = reach(0).max(reach(VECTOR));
            (t + t.abs() * (WIDENING + CLOSE)).min(f32::MAX)
        }

        /// The boxes of a node that some ray may enter, and how near: an interval around all
        /// rays. Rounding is monotonic, so no ray is nearer or farther than its ends.
        #[inline]
        #[target_feature(enable = "avx512f,avx512vl,avx2")]
        fn candidates(&self, node: &Node, limit: f32) -> (u32, [f32; WIDTH]) {
            let at = |plane: usize, origin: f32, axis: usize| {
                // SAFETY: a plane is eight floats, aligned to 32 by the node's layout.
                let plane = unsafe { _mm256_load_ps(node.planes[plane].as_ptr()) };
                let from = _mm256_sub_ps(plane, _mm256_set1_ps(origin));
                let [slow, fast] = self.interval[axis].inverse;
                (
                    _mm256_mul_ps(from, _mm256_set1_ps(slow)),
                    _mm256_mul_ps(from, _mm256_set1_ps(fast)),
                )
            };
            let first = |axis: usize| {
                let (a, b) = at(self.near[axis], self.interval[axis].origin[0], axis);
                _mm256_min_ps(a, b)
            };
            let last = |axis: usize| {
                let (a, b) = at(self.far[axis], self.interval[axis].origin[1], axis);
                _mm256_max_ps(a, b)
            };
            let n = _mm256_max_ps(_mm256_max_ps(first(0), first(1)), first(2));
            let n = _mm256_max_ps(n, _mm256_setzero_ps());
            let f = _mm256_min_ps(_mm256_min_ps(last(0), last(1)), last(2));
            let size = _mm256_andnot_ps(_mm256_set1_ps(-0.0), f);
            let f = _mm256_add_ps(f, _mm256_mul_ps(size, _mm256_set1_ps(WIDENING)));
            let f = _mm256_min_ps(f, _mm256_set1_ps(limit));
            let mut near = [0.0; WIDTH];
            // SAFETY: the array is eight floats, and the store needs no alignment.
            unsafe { _mm256_storeu_ps(near.as_mut_ptr(), n) };
            (u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(n, f)), near)
        }

        /// The rays that enter one of a node's boxes.
        #[inline]
        #[target_feature(enable = "avx512f,avx512dq")]
        fn enter_box(&self, node: &Node, i: usize, lanes: u32) -> u32 {
            let mut entering = 0;
            for first in [0, VECTOR] {
                let some = (lanes >> first) as u16;
                entering |= u32::from(self.enter_sixteen(node, i, first, some)) << first;
            }
            entering
        }

        #[inline]
        #[target_feature(enable = "avx512f,avx512dq")]
        fn enter_sixteen(&self, node: &Node, i: usize, first: usize, lanes: u16) -> u16 {
            let at = |plane: usize, axis: usize, from: &[Lanes; 3]| {
                let plane = _mm512_set1_ps(node.planes[plane][i]);
                _mm512_fmadd_ps(
                    plane,
                    Self::lanes(&self.inverse[axis], first),
                    Self::lanes(&from[axis], first),
                )
            };
            let entry = |axis: usize| at(self.near[axis], axis, &self.near_from);
            let exit = |axis: usize| at(self.far[axis], axis, &self.far_from);
            // Of two the second is taken if one is no number, as beyond the largest.
            let n = _mm512_max_ps(entry(0), Self::lanes(&self.t_min, first));
            let n = _mm512_max_ps(entry(2), _mm512_max_ps(entry(1), n));
            let f = _mm512_min_ps(exit(0), Self::lanes(&self.t, first));
            let f = _mm512_min_ps(exit(2), _mm512_min_ps(exit(1), f));
            let more = _mm512_set1_ps(WIDENING + CLOSE);
            let wide = _mm512_fmadd_ps(_mm512_abs_ps(f), more, f);
            _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(lanes, n, wide)
        }

        /// Goes on to the nearest of the boxes entered and keeps the others; false if there is
        /// none.
        #[inline]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,bmi1,bmi2,popcnt,lzcnt")]
        fn enter(
            &self,
            node: &Node,
            limit: f32,
            current: &mut Waiting,
            stack: &mut Stack<'_, Waiting>,
        ) -> bool {
            let (candidates, near) = self.candidates(node, limit);
            let mut nearest: Option<Waiting> = None;
            // Sorted by insertion, farthest first.
            let mut sorted = [*current; WIDTH];
            let mut count = 0;
            // A node that stands alone is opened without asking who enters: that is seen in it.
            let alone = candidates.is_power_of_two();
            for i in bits(candidates) {
                let lanes = if alone && !node.children[i].is_leaf() {
                    current.lanes
                } else {
                    self.enter_box(node, i, current.lanes)
                };
                if lanes == 0 {
                    continue;
                }
                let new = Waiting {
                    near: near[i],
                    child: node.children[i],
                    lanes,
                };
                let Some(best) = nearest else {
                    nearest = Some(new);
                    continue;
                };
                let put = if new.near < best.near {
                    nearest = Some(new);
                    best
                } else {
                    new
                };
                let mut at = count;
                while at > 0 && sorted[at - 1].near < put.near {
                    sorted[at] = sorted[at - 1];
                    at -= 1;
                }
                sorted[at] = put;
                count += 1;
            }
            for waiting in &sorted[..count] {
                stack.push(*waiting);
            }
            if let Some(next) = nearest {
                *current = next;
                return true;
            }
            false
        }

        #[inline]
        #[target_feature(enable = "avx512f,avx512dq,bmi1,bmi2,popcnt,lzcnt")]
        fn meet_block<const ANY: bool>(&mut self, block: &Block, lanes: u32, others: &impl Others) {
            for i in 0..BLOCK {
                // An empty place, or no triangle.
                if block.corners[0][0][i].is_nan() {
                    continue;
                }
                let lanes = if ANY { lanes & !self.found } else { lanes };
                self.meet_triangle(block, i, lanes);
            }
            for i in bits(block.others()) {
                let primitive = block.primitive(i);
                for lane in bits(lanes) {
                    self.meet_other(lane, &self.ray(lane), primitive, others);
                }
            }
        }

        /// [`PreparedRay::triangle`] for all rays, the same operations in the same order.
        #[inline]
        #[target_feature(enable = "avx512f,avx512dq")]
        fn meet_triangle(&mut self, block: &Block, i: usize, lanes: u32) {
            for first in [0, VECTOR] {
                let some = (lanes >> first) as u16;
                if some != 0 {
                    self.meet_sixteen(block, i, first, some);
                }
            }
        }

        #[inline]
        #[target_feature(enable = "avx512f,avx512dq")]
        fn meet_sixteen(&mut self, block: &Block, i: usize, first: usize, lanes: u16) {
            let [kx, ky, kz] = self.axes;
            let (sx, sy) = (
                Self::lanes(&self.shear[0], first),
                Self::lanes(&self.shear[1], first),
            );
            let (ox, oy, oz) = (
                Self::lanes(&self.origin[kx], first),
                Self::lanes(&self.origin[ky], first),
                Self::lanes(&self.origin[kz], first),
            );
            let sheared = |corner: usize| {
                let from = |axis: usize, o| {
                    _mm512_sub_ps(_mm512_set1_ps(block.corners[corner][axis][i]), o)
                };
                let z = from(kz, oz);
                let x = _mm512_sub_ps(from(kx, ox), _mm512_mul_ps(sx, z));
                let y = _mm512_sub_ps(from(ky, oy), _mm512_mul_ps(sy, z));
                (x, y, z)
            };
            let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(0), sheared(1), sheared(2));
            let cross =
                |px, qy, py, qx| _mm512_sub_ps(_mm512_mul_ps(px, qy), _mm512_mul_ps(py, qx));
            let u = cross(cx, by, cy, bx);
            let v = cross(ax, cy, ay, cx);
            let w = cross(bx, ay, by, ax);
            let zero = _mm512_setzero_ps();
            let below = |a| _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, zero);
            let above = |a| _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, zero);
            let on = |a| _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a, zero);
            let negative = below(u) | below(v) | below(w);
            let positive = above(u) | above(v) | above(w);
            let inside = lanes & !(negative & positive);
            let exact = inside & (on(u) | on(v) | on(w));
            let inside = inside & !exact;
            if inside != 0 {
                let det = _mm512_add_ps(_mm512_add_ps(u, v), w);
                let sum = _mm512_add_ps(
                    _mm512_add_ps(_mm512_mul_ps(u, az), _mm512_mul_ps(v, bz)),
                    _mm512_mul_ps(w, cz),
                );
                let t = _mm512_div_ps(_mm512_mul_ps(sum, Self::lanes(&self.shear[2], first)), det);
                let best = Self::lanes(&self.t, first);
                let good = _mm512_mask_cmp_ps_mask::<_CMP_NEQ_OQ>(inside, det, zero);
                let good =
                    _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(good, t, Self::lanes(&self.t_min, first));
                let apart = _mm512_abs_ps(_mm512_sub_ps(t, best));
                let near = _mm512_mul_ps(best, _mm512_set1_ps(CLOSE));
                let found = good & (self.found >> first) as u16;
                let close = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(found, apart, near);
                self.close |= u32::from(close) << first;
                let take = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(good, t, best);
                if take != 0 {
                    // SAFETY: sixteen places from one of two, as in `lanes`; no alignment needed.
                    unsafe {
                        let keep = |to: &mut Lanes, from| {
                            _mm512_mask_storeu_ps(to.as_mut_ptr().add(first), take, from);
                        };
                        keep(&mut self.t, t);
                        keep(&mut self.u, _mm512_div_ps(v, det));
                        keep(&mut self.v, _mm512_div_ps(w, det));
                        let number = _mm512_set1_epi32(block.primitive(i) as i32);
                        let to = self.primitive.as_mut_ptr().add(first);
                        _mm512_mask_storeu_epi32(to.cast(), take, number);
                    }
                    self.found |= u32::from(take) << first;
                }
            }
            for lane in bits(u32::from(exact) << first) {
                let corners = block.triangle(i);
                let hit = self
                    .ray(lane)
                    .triangle(&corners, self.t_min[lane], self.reach(lane));
                if let Some(hit) = hit {
                    self.take(lane, block.primitive(i), hit);
                }
            }
        }
    }
}
