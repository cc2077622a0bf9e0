//! Traces a packet of rays through the tree.
//!
//! A node's eight boxes are first tested against an interval around all rays. The boxes that pass
//! are tested against every ray, a vector of rays at a time. A triangle is tested against all rays
//! together with the operations of a single ray, so a hit has the same bits. When few rays are left
//! they continue one by one.

use ivcam_base::math::lanes::{
    LANES, RaysInLanes, VectorKernel, Vectors, bits, dispatch_vectors, of_lane,
};

use super::block::{BLOCK, Block};
use super::hit::{CLOSE, Primitives};
use super::nodes::{Bvh, Child, WIDTH, WideNode};
use super::prepared_packet::{Interval, PreparedPacket};
use super::stack::{StackStorage, TraversalStack};
use super::walk::WIDENING;

/// The largest number of rays that are traced one by one. Hits have the same bits with any value. A
/// test of a box or a triangle in lanes takes as long for one ray as for all, so that for a few
/// rays single tests are faster. Larger numbers were tried
/// (docs/decisions/0010-how-a-ray-walks-the-tree.md).
const FEW: u32 = 3;

/// A box that some rays of a packet still have to visit.
#[derive(Clone, Copy)]
struct PacketStackEntry {
    /// The distance of the nearest entry of any ray, or less.
    near: f32,
    child: Child,
    /// A bit mask of the rays that enter it.
    lanes: u32,
}

impl PacketStackEntry {
    /// Whether this box is visited before another one: the nearer one first, or with `TO_LIGHT` the
    /// one that more rays enter, in which more of them may end.
    #[inline(always)]
    fn is_before<const TO_LIGHT: bool>(&self, other: &Self) -> bool {
        match TO_LIGHT {
            true => self.lanes.count_ones() > other.lanes.count_ones(),
            false => self.near < other.near,
        }
    }
}

/// Traces the rays of a packet: see [`Bvh::walk_packet`].
struct PacketWalk<'a, P, const TO_LIGHT: bool> {
    tree: &'a Bvh,
    packet: &'a mut PreparedPacket,
    primitives: &'a P,
}

impl<P: Primitives, const TO_LIGHT: bool> VectorKernel for PacketWalk<'_, P, TO_LIGHT> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vectors, E: Vectors>(self, v: V, eight: E) {
        let (tree, packet, primitives) = (self.tree, self.packet, self.primitives);
        let mut storage = StackStorage::new();
        let mut stack = storage.stack(tree.stack_size);
        let mut current = PacketStackEntry {
            near: 0.0,
            child: Child::ROOT,
            lanes: packet.live,
        };
        let mut limit = packet.limit(v);
        loop {
            if TO_LIGHT {
                current.lanes &= !packet.hits.mask;
            }
            if current.lanes.count_ones() <= FEW {
                for lane in bits(current.lanes) {
                    tree.walk_one::<TO_LIGHT>(current.child, lane, packet, primitives);
                }
                if !TO_LIGHT {
                    limit = packet.limit(v);
                }
            } else if current.child.is_leaf() {
                for block in &tree.blocks[current.child.place()..] {
                    packet.intersect_block::<V, TO_LIGHT>(v, block, current.lanes, primitives);
                    if block.last {
                        break;
                    }
                }
                if !TO_LIGHT {
                    limit = packet.limit(v);
                }
            } else {
                let node = &tree.nodes[current.child.place()];
                if packet.enter::<V, E, TO_LIGHT>((v, eight), node, limit, &mut current, &mut stack)
                {
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

impl Bvh {
    /// Finds the nearest hit of every ray of a packet that is not `unsure`. With `TO_LIGHT` it
    /// finds how much light every ray brings from a light.
    pub(super) fn walk_packet<const TO_LIGHT: bool>(
        &self,
        packet: &mut PreparedPacket,
        primitives: &impl Primitives,
    ) {
        if packet.live == 0 {
            return;
        }
        dispatch_vectors(PacketWalk::<_, TO_LIGHT> {
            tree: self,
            packet,
            primitives,
        });
    }

    /// Traces the ray of a lane alone through the subtree `from`.
    #[inline(never)]
    pub(super) fn walk_one<const TO_LIGHT: bool>(
        &self,
        from: Child,
        lane: usize,
        packet: &mut PreparedPacket,
        primitives: &impl Primitives,
    ) {
        let mut nearest = packet.nearest(lane);
        self.walk_alone::<TO_LIGHT>(from, &packet.ray(lane), &mut nearest, primitives);
        packet.set_nearest(lane, &nearest);
    }
}

impl PreparedPacket {
    /// The farthest distance of interest for any of the rays, widened by rounding errors. It is
    /// finite, because an empty box is at infinity.
    #[inline(always)]
    fn limit<V: Vectors>(&self, v: V) -> f32 {
        let mut reach = v.load(&self.hits.t, 0);
        for first in (V::LANES..LANES).step_by(V::LANES) {
            reach = v.max(reach, v.load(&self.hits.t, first));
        }
        let t = v.greatest(reach);
        (t + t.abs() * (WIDENING + CLOSE)).min(f32::MAX)
    }

    /// A bit mask of the boxes of a node that some ray may enter, and a lower bound of the distance
    /// to each. The interval contains all rays. Rounding is monotonic, so no ray enters nearer or
    /// leaves farther than the interval's ends.
    #[inline(always)]
    fn candidates<E: Vectors>(&self, e: E, node: &WideNode, limit: f32) -> (u32, [f32; WIDTH]) {
        const { assert!(E::LANES == WIDTH) }
        let (mut n, mut f) = (e.splat(0.0), e.splat(f32::INFINITY));
        for axis in 0..3 {
            let Interval { origin, inverse } = &self.interval[axis];
            let [slow, fast] = [e.splat(inverse[0]), e.splat(inverse[1])];
            let entry = e.sub(e.load(&node.planes[self.near[axis]], 0), e.splat(origin[0]));
            n = e.max_num(e.min(e.mul(entry, slow), e.mul(entry, fast)), n);
            let exit = e.sub(e.load(&node.planes[self.far[axis]], 0), e.splat(origin[1]));
            f = e.min_num(e.max(e.mul(exit, slow), e.mul(exit, fast)), f);
        }
        let f = e.add(f, e.mul(e.abs(f), e.splat(WIDENING)));
        let f = e.min_num(f, e.splat(limit));
        let mut near = [0.0; WIDTH];
        e.store(&mut near, 0, u32::MAX, n);
        (e.at_most(n, f), near)
    }

    /// A bit mask of the rays, out of `lanes`, that enter box `i` of a node.
    #[inline(always)]
    fn enter_box<V: Vectors>(&self, v: V, node: &WideNode, i: usize, lanes: u32) -> u32 {
        let mut entering = 0;
        for first in (0..LANES).step_by(V::LANES) {
            entering |= self.enter_from(v, node, i, first) << first;
        }
        entering & lanes
    }

    /// A bit mask of the rays of a vector that enter box `i` of a node.
    #[inline(always)]
    fn enter_from<V: Vectors>(&self, v: V, node: &WideNode, i: usize, first: usize) -> u32 {
        let (mut n, mut f) = (v.splat(0.0), v.load(&self.hits.t, first));
        for axis in 0..3 {
            let inverse = v.load(&self.inverse[axis], first);
            let near = v.splat(node.planes[self.near[axis]][i]);
            let far = v.splat(node.planes[self.far[axis]][i]);
            // The sum is NaN after an overflow, for example.
            n = v.max_num(
                v.multiply_add(near, inverse, v.load(&self.near_from[axis], first)),
                n,
            );
            f = v.min_num(
                v.multiply_add(far, inverse, v.load(&self.far_from[axis], first)),
                f,
            );
        }
        let wide = v.multiply_add(v.abs(f), v.splat(WIDENING + CLOSE), f);
        v.at_most(n, wide)
    }

    /// Makes the first of the entered boxes current and pushes the others. Returns false if no ray
    /// enters any box.
    #[inline(always)]
    fn enter<V: Vectors, E: Vectors, const TO_LIGHT: bool>(
        &self,
        (v, eight): (V, E),
        node: &WideNode,
        limit: f32,
        current: &mut PacketStackEntry,
        stack: &mut TraversalStack<'_, PacketStackEntry>,
    ) -> bool {
        let (candidates, near) = self.candidates(eight, node, limit);
        let mut first: Option<PacketStackEntry> = None;
        // Sorted by insertion, the last one first.
        let mut sorted = [*current; WIDTH];
        let mut count = 0;
        // If only one box may be entered and it holds a node, its rays are not tested: the boxes of
        // that node are.
        let alone = candidates.is_power_of_two();
        for i in bits(candidates) {
            let lanes = if alone && !node.children[i].is_leaf() {
                current.lanes
            } else {
                self.enter_box(v, node, i, current.lanes)
            };
            if lanes == 0 {
                continue;
            }
            let new = PacketStackEntry {
                near: near[i],
                child: node.children[i],
                lanes,
            };
            let Some(best) = first else {
                first = Some(new);
                continue;
            };
            let put = if new.is_before::<TO_LIGHT>(&best) {
                first = Some(new);
                best
            } else {
                new
            };
            let mut at = count;
            while at > 0 && sorted[at - 1].is_before::<TO_LIGHT>(&put) {
                sorted[at] = sorted[at - 1];
                at -= 1;
            }
            sorted[at] = put;
            count += 1;
        }
        for entry in &sorted[..count] {
            stack.push(*entry);
        }
        if let Some(next) = first {
            *current = next;
            return true;
        }
        false
    }

    #[inline(always)]
    fn intersect_block<V: Vectors, const TO_LIGHT: bool>(
        &mut self,
        v: V,
        block: &Block,
        lanes: u32,
        primitives: &impl Primitives,
    ) {
        for i in 0..BLOCK {
            // The lane is empty or holds another primitive.
            if block.corners[0][0][i].is_nan() {
                continue;
            }
            if TO_LIGHT {
                let lanes =
                    self.intersect_triangle::<V, true>(v, block, i, lanes & !self.hits.mask);
                if lanes != 0 {
                    self.dim_triangle(lanes, block.primitive(i), primitives);
                }
            } else {
                self.intersect_triangle::<V, false>(v, block, i, lanes);
            }
        }
        for i in bits(block.non_triangles()) {
            let lanes = if TO_LIGHT {
                lanes & !self.hits.mask
            } else {
                lanes
            };
            self.intersect_non_triangle::<TO_LIGHT>(block.primitive(i), lanes, primitives);
        }
    }

    /// Intersects the rays of some lanes with a primitive that is not a triangle.
    #[inline(never)]
    fn intersect_non_triangle<const TO_LIGHT: bool>(
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
            if TO_LIGHT {
                let (origin, toward) =
                    (of_lane(&self.origin, lane), of_lane(&self.direction, lane));
                nearest.dim_at(found, primitive, (origin, toward), primitives);
            } else {
                nearest.take_distances(primitive, found);
            }
            self.set_nearest(lane, &nearest);
        }
    }

    /// Lets the light of some rays, which hit a triangle, through it.
    #[inline]
    fn dim_triangle(&mut self, lanes: u32, primitive: u32, primitives: &impl Primitives) {
        let mut lit = lanes;
        if primitives.may_be_culled(primitive) {
            for lane in bits(lanes) {
                let (origin, toward) =
                    (of_lane(&self.origin, lane), of_lane(&self.direction, lane));
                lit &= !(u32::from(primitives.is_culled(origin, toward, primitive, 0.0)) << lane);
            }
        }
        self.dim(lit, primitives.transmittance_of(primitive));
    }

    /// Lets the light of some rays through a primitive with a transmittance.
    #[inline]
    fn dim(&mut self, lanes: u32, transmittance: f32) {
        if transmittance == 0.0 {
            self.hits.mask |= lanes;
        } else if transmittance.is_nan() {
            self.unsure |= lanes;
        } else {
            bits(lanes).for_each(|lane| self.hits.through[lane] *= transmittance);
        }
    }

    /// Intersects all rays with a triangle by the operations of [`PreparedRay::triangle`], in the
    /// same order. With `TO_LIGHT` it only returns a bit mask of the rays that hit the triangle.
    ///
    /// [`PreparedRay::triangle`]: super::triangle::PreparedRay::triangle
    #[inline(always)]
    fn intersect_triangle<V: Vectors, const TO_LIGHT: bool>(
        &mut self,
        v: V,
        block: &Block,
        i: usize,
        lanes: u32,
    ) -> u32 {
        let mut hit = 0;
        for first in (0..LANES).step_by(V::LANES) {
            let some = lanes >> first & (u32::MAX >> (u32::BITS as usize - V::LANES));
            if some != 0 {
                hit |= self.intersect_from::<V, TO_LIGHT>(v, block, i, first, some) << first;
            }
        }
        hit
    }

    /// Does that for the rays of one vector.
    #[inline(always)]
    fn intersect_from<V: Vectors, const TO_LIGHT: bool>(
        &mut self,
        v: V,
        block: &Block,
        i: usize,
        first: usize,
        lanes: u32,
    ) -> u32 {
        let mut hit = 0;
        let [kx, ky, kz] = self.axes;
        let origin = [
            v.load(&self.origin[kx], first),
            v.load(&self.origin[ky], first),
            v.load(&self.origin[kz], first),
        ];
        let (sx, sy) = (v.load(&self.shear[0], first), v.load(&self.shear[1], first));
        let mut corners = [origin; 3];
        for (to, corner) in corners.iter_mut().zip(&block.corners) {
            let z = v.sub(v.splat(corner[kz][i]), origin[2]);
            let x = v.sub(v.splat(corner[kx][i]), origin[0]);
            let y = v.sub(v.splat(corner[ky][i]), origin[1]);
            *to = [v.sub(x, v.mul(sx, z)), v.sub(y, v.mul(sy, z)), z];
        }
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;
        let a = v.sub(v.mul(cx, by), v.mul(cy, bx));
        let b = v.sub(v.mul(ax, cy), v.mul(ay, cx));
        let c = v.sub(v.mul(bx, ay), v.mul(by, ax));
        let zero = v.splat(0.0);
        let [least, most] = [v.min(v.min(a, b), c), v.max(v.max(a, b), c)];
        let inside = lanes & !(v.less(least, zero) & v.less(zero, most));
        if inside == 0 {
            return 0;
        }
        let exact = inside & (v.equal(a, zero) | v.equal(b, zero) | v.equal(c, zero));
        let inside = inside & !exact;
        if inside != 0 {
            let det = v.add(v.add(a, b), c);
            let sum = v.add(v.add(v.mul(a, az), v.mul(b, bz)), v.mul(c, cz));
            let t = v.div(v.mul(sum, v.load(&self.shear[2], first)), det);
            let best = v.load(&self.hits.t, first);
            let good = inside & v.less(zero, v.abs(det)) & v.less(zero, t);
            let take = good & v.less(t, best);
            hit |= take;
            if !TO_LIGHT {
                let apart = v.abs(v.sub(t, best));
                let close = v.at_most(apart, v.mul(best, v.splat(CLOSE)));
                self.unsure |= (close & good & self.hits.mask >> first) << first;
                if take != 0 {
                    v.store(&mut self.hits.t, first, take, t);
                    v.store(&mut self.hits.u, first, take, v.div(b, det));
                    v.store(&mut self.hits.v, first, take, v.div(c, det));
                    v.fill(&mut self.hits.primitive, first, take, block.primitive(i));
                    self.hits.mask |= take << first;
                }
            }
        }
        for lane in bits(exact << first) {
            let corners = block.triangle(i);
            let mut nearest = self.nearest(lane);
            let found = self.ray(lane).triangle(&corners, 0.0, nearest.reach());
            if let Some(found) = found {
                hit |= 1 << (lane - first);
                if !TO_LIGHT {
                    nearest.take(block.primitive(i), found);
                    self.set_nearest(lane, &nearest);
                }
            }
        }
        hit
    }
}
