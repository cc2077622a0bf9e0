//! Traces a packet with AVX-512, as two vectors of sixteen rays.

use std::arch::x86_64::*;

use super::block::{BLOCK, Block};
use super::hit::Primitives;
use super::nodes::{Bvh, Child, Node, WIDTH};
use super::packet::RayPacket;
use super::prepared_packet::{CLOSE, PreparedPacket};
use super::stack::{StackStorage, TraversalStack};
use super::walk::WIDENING;
use crate::math::lanes::{LANES, Lanes, RaysInLanes, Vec3Lanes, bits};
use crate::math::simd::{fill_some_16, load_8, load_16, store_8, store_some_16};

/// Lanes of a vector.
const VECTOR: usize = 16;
/// The largest number of rays that are traced one by one, chosen by trial.
const FEW: u32 = 3;

/// A box that some rays of a packet still have to visit.
#[derive(Clone, Copy)]
struct StackEntry {
    /// The distance of the nearest entry of any ray, or less.
    near: f32,
    child: Child,
    /// A bit mask of the rays that enter it.
    lanes: u32,
}

impl Bvh {
    /// Does what [`Bvh::walk_packet`] does, with AVX-512.
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,bmi1,bmi2,popcnt,lzcnt")]
    pub(super) fn walk_packet_avx512<const ANY: bool>(
        &self,
        packet: &mut PreparedPacket,
        primitives: &impl Primitives,
    ) {
        let mut storage = StackStorage::new();
        let mut stack = storage.stack(self.stack_size);
        let mut current = StackEntry {
            near: 0.0,
            child: Child::ROOT,
            lanes: packet.live,
        };
        let mut limit = packet.limit(packet.live);
        loop {
            if ANY {
                current.lanes &= !packet.hits.mask;
            }
            if current.lanes.count_ones() <= FEW {
                for lane in bits(current.lanes) {
                    self.walk_one::<ANY>(current.child, lane, packet, primitives);
                }
                limit = packet.limit(packet.live);
            } else if current.child.is_leaf() {
                for block in &self.blocks[current.child.place()..] {
                    packet.intersect_block::<ANY>(block, current.lanes, primitives);
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
                    Some(entry) if entry.near <= limit => break entry,
                    Some(_) => {}
                    None => return,
                }
            };
        }
    }
}

impl PreparedPacket {
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2")]
    pub(super) fn load_avx512(&mut self, rays: &RayPacket) {
        self.copy_rays(rays);
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

    /// Sixteen lanes, beginning with lane 0 or 16.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn lanes(of: &Lanes<f32>, first: usize) -> __m512 {
        const { assert!(LANES == 2 * VECTOR) }
        load_16(of, first)
    }

    /// The farthest distance of interest for any of the rays, widened by rounding errors. It is
    /// finite, because an empty box is at infinity.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn limit(&self, lanes: u32) -> f32 {
        let reach = |first: usize| {
            _mm512_mask_reduce_max_ps((lanes >> first) as u16, Self::lanes(&self.hits.t, first))
        };
        let t = reach(0).max(reach(VECTOR));
        (t + t.abs() * (WIDENING + CLOSE)).min(f32::MAX)
    }

    /// A bit mask of the boxes of a node that some ray may enter, and a lower bound of the distance
    /// to each. The interval contains all rays. Rounding is monotonic, so no ray enters nearer or
    /// leaves farther than the interval's ends.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vl,avx2")]
    fn candidates(&self, node: &Node, limit: f32) -> (u32, [f32; WIDTH]) {
        let at = |plane: usize, origin: f32, axis: usize| {
            let plane = load_8(&node.planes[plane]);
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
        store_8(&mut near, n);
        (u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(n, f)), near)
    }

    /// A bit mask of the rays, out of `lanes`, that enter box `i` of a node.
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
        let at = |plane: usize, axis: usize, from: &Vec3Lanes| {
            let plane = _mm512_set1_ps(node.planes[plane][i]);
            _mm512_fmadd_ps(
                plane,
                Self::lanes(&self.inverse[axis], first),
                Self::lanes(&from[axis], first),
            )
        };
        let entry = |axis: usize| at(self.near[axis], axis, &self.near_from);
        let exit = |axis: usize| at(self.far[axis], axis, &self.far_from);
        // `max` and `min` return the second operand if one is NaN, for example after an overflow.
        let n = _mm512_max_ps(entry(0), _mm512_setzero_ps());
        let n = _mm512_max_ps(entry(2), _mm512_max_ps(entry(1), n));
        let f = _mm512_min_ps(exit(0), Self::lanes(&self.hits.t, first));
        let f = _mm512_min_ps(exit(2), _mm512_min_ps(exit(1), f));
        let more = _mm512_set1_ps(WIDENING + CLOSE);
        let wide = _mm512_fmadd_ps(_mm512_abs_ps(f), more, f);
        _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(lanes, n, wide)
    }

    /// Makes the nearest of the entered boxes current and pushes the others. Returns false if no
    /// ray enters any box.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,bmi1,bmi2,popcnt,lzcnt")]
    fn enter(
        &self,
        node: &Node,
        limit: f32,
        current: &mut StackEntry,
        stack: &mut TraversalStack<'_, StackEntry>,
    ) -> bool {
        let (candidates, near) = self.candidates(node, limit);
        let mut nearest: Option<StackEntry> = None;
        // Sorted by insertion, farthest first.
        let mut sorted = [*current; WIDTH];
        let mut count = 0;
        // If only one box may be entered and it holds a node, its rays are not tested: the boxes of
        // that node are.
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
            let new = StackEntry {
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
        for entry in &sorted[..count] {
            stack.push(*entry);
        }
        if let Some(next) = nearest {
            *current = next;
            return true;
        }
        false
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,bmi1,bmi2,popcnt,lzcnt")]
    fn intersect_block<const ANY: bool>(
        &mut self,
        block: &Block,
        lanes: u32,
        primitives: &impl Primitives,
    ) {
        for i in 0..BLOCK {
            // The lane is empty or holds another primitive.
            if block.corners[0][0][i].is_nan() {
                continue;
            }
            if ANY {
                let lanes = self.intersect_triangle::<true>(block, i, lanes & !self.hits.mask);
                if lanes != 0 {
                    self.dim(lanes, primitives.transmittance_of(block.primitive(i)));
                }
            } else {
                self.intersect_triangle::<false>(block, i, lanes);
            }
        }
        for i in bits(block.non_triangles()) {
            let lanes = if ANY { lanes & !self.hits.mask } else { lanes };
            self.intersect_non_triangle::<ANY>(block.primitive(i), lanes, primitives);
        }
    }

    /// Intersects the rays of some lanes with a primitive that is not a triangle.
    #[inline(never)]
    fn intersect_non_triangle<const ANY: bool>(
        &mut self,
        primitive: u32,
        lanes: u32,
        primitives: &impl Primitives,
    ) {
        let t_max = self.hits.t.map(|t| t + t * CLOSE);
        let rays = RaysInLanes {
            origin: &self.origin,
            direction: &self.direction,
            t_max: &t_max,
        };
        let mut distances = [[0.0; LANES]; 2];
        let may = primitives.distances_in_lanes(rays, primitive, lanes, &mut distances);
        for lane in bits(may) {
            let mut nearest = self.nearest(lane);
            let found = [distances[0][lane], distances[1][lane]];
            if ANY {
                nearest.dim_at(found, primitives.transmittance_of(primitive));
            } else {
                nearest.take_distances(primitive, found);
            }
            self.set_nearest(lane, &nearest);
        }
    }

    /// Lets the light of some rays through a primitive with a transmittance.
    #[inline]
    fn dim(&mut self, lanes: u32, transmittance: f32) {
        if transmittance == 0.0 {
            self.hits.mask |= lanes;
        } else if transmittance.is_nan() {
            self.close |= lanes;
        } else {
            bits(lanes).for_each(|lane| self.hits.through[lane] *= transmittance);
        }
    }

    /// Intersects all rays with a triangle by the operations of [`PreparedRay::triangle`], in the
    /// same order. With `ANY` it only returns a bit mask of the rays that hit the triangle.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn intersect_triangle<const ANY: bool>(&mut self, block: &Block, i: usize, lanes: u32) -> u32 {
        let mut hit = 0;
        for first in [0, VECTOR] {
            let some = (lanes >> first) as u16;
            if some != 0 {
                hit |= u32::from(self.intersect_sixteen::<ANY>(block, i, first, some)) << first;
            }
        }
        hit
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn intersect_sixteen<const ANY: bool>(
        &mut self,
        block: &Block,
        i: usize,
        first: usize,
        lanes: u16,
    ) -> u16 {
        let mut hit = 0;
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
            let from =
                |axis: usize, o| _mm512_sub_ps(_mm512_set1_ps(block.corners[corner][axis][i]), o);
            let z = from(kz, oz);
            let x = _mm512_sub_ps(from(kx, ox), _mm512_mul_ps(sx, z));
            let y = _mm512_sub_ps(from(ky, oy), _mm512_mul_ps(sy, z));
            (x, y, z)
        };
        let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(0), sheared(1), sheared(2));
        let cross = |px, qy, py, qx| _mm512_sub_ps(_mm512_mul_ps(px, qy), _mm512_mul_ps(py, qx));
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
            let best = Self::lanes(&self.hits.t, first);
            let good = _mm512_mask_cmp_ps_mask::<_CMP_NEQ_OQ>(inside, det, zero);
            let good = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(good, t, _mm512_setzero_ps());
            let take = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(good, t, best);
            hit |= take;
            let apart = _mm512_abs_ps(_mm512_sub_ps(t, best));
            let near = _mm512_mul_ps(best, _mm512_set1_ps(CLOSE));
            let found = good & (self.hits.mask >> first) as u16;
            let close = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(found, apart, near);
            if !ANY {
                self.close |= u32::from(close) << first;
            }
            if !ANY && take != 0 {
                store_some_16(&mut self.hits.t, first, take, t);
                store_some_16(&mut self.hits.u, first, take, _mm512_div_ps(v, det));
                store_some_16(&mut self.hits.v, first, take, _mm512_div_ps(w, det));
                fill_some_16(&mut self.hits.primitive, first, take, block.primitive(i));
                self.hits.mask |= u32::from(take) << first;
            }
        }
        for lane in bits(u32::from(exact) << first) {
            let corners = block.triangle(i);
            let mut nearest = self.nearest(lane);
            let found = self.ray(lane).triangle(&corners, 0.0, nearest.reach());
            if let Some(found) = found {
                hit |= 1 << (lane - first);
                if !ANY {
                    nearest.take(block.primitive(i), found);
                    self.set_nearest(lane, &nearest);
                }
            }
        }
        hit
    }
}
