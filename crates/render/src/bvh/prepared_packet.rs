//! A packet of rays, prepared for the traversal in `packet_walk`.

use ivcam_base::math::lanes::{LANES, Lanes, SimdKernel, Vec3Lanes, dispatch, of_lane};

use super::nearest_hit::NearestHit;
use super::packet::{PacketHits, RayPacket};
use super::triangle::{PreparedRay, axes, invert};

/// A packet during its traversal: rays from distance 0 with the same direction octant.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct PreparedPacket {
    pub(super) origin: Vec3Lanes,
    pub(super) direction: Vec3Lanes,
    pub(super) inverse: Vec3Lanes,
    /// −origin·inverse minus its rounding error, for the planes where a ray enters a box.
    pub(super) near_from: Vec3Lanes,
    /// −origin·inverse plus its rounding error, for the planes where a ray leaves a box.
    pub(super) far_from: Vec3Lanes,
    pub(super) shear: Vec3Lanes,
    /// The nearest hits so far. For a ray without a hit, `t` is the farthest distance of interest.
    pub(super) hits: PacketHits,
    /// A bit mask of the rays that the caller must trace one by one: see
    /// [`NearestHit::is_unsure`].
    pub(super) unsure: u32,
    /// A bit mask of the lanes that hold a ray.
    pub(super) live: u32,
    /// The axes as in [`PreparedRay`], the same for all rays.
    pub(super) axes: [usize; 3],
    /// For each axis, the index of the node's planes where the rays enter.
    pub(super) near: [usize; 3],
    /// For each axis, the index of the node's planes where the rays leave.
    pub(super) far: [usize; 3],
    /// For each axis, bounds over the rays.
    pub(super) interval: [Interval; 3],
}

/// Bounds over the rays of a packet, on one axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Interval {
    /// The origin with the nearest entry, then the origin with the farthest exit.
    pub(super) origin: [f32; 2],
    /// The smallest and the largest inverse.
    pub(super) inverse: [f32; 2],
}

impl PreparedPacket {
    pub(super) const fn empty() -> Self {
        Self {
            origin: [[0.0; LANES]; 3],
            direction: [[1.0; LANES]; 3],
            inverse: [[1.0; LANES]; 3],
            near_from: [[0.0; LANES]; 3],
            far_from: [[0.0; LANES]; 3],
            shear: [[1.0; LANES]; 3],
            hits: PacketHits::NONE,
            unsure: 0,
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

    /// Prepares the rays of a packet, which has at least one.
    pub(super) fn load(&mut self, rays: &RayPacket) {
        dispatch(Load { packet: self, rays });
    }

    #[inline(always)]
    fn copy_rays(&mut self, rays: &RayPacket) {
        let live = rays.mask;
        // A lane without a ray copies another lane's ray, so that it does not widen the interval.
        let some = live.trailing_zeros() as usize;
        for axis in 0..3 {
            let (from, to) = (&rays.origin[axis], &rays.direction[axis]);
            let (other_from, other_to) = (from[some], to[some]);
            for lane in 0..LANES {
                let on = live >> lane & 1 == 1;
                self.origin[axis][lane] = if on { from[lane] } else { other_from };
                let d = if on { to[lane] } else { other_to };
                self.direction[axis][lane] = d + 0.0; // turns −0.0 into +0.0
            }
        }
        for (lane, t_max) in rays.t_max.iter().enumerate() {
            let end = if *t_max < f32::MAX { *t_max } else { f32::MAX };
            let on = live >> lane & 1 == 1;
            self.hits.t[lane] = if on { end } else { f32::NEG_INFINITY };
        }
        self.live = live;
        self.hits.through = [1.0; LANES];
        (self.hits.mask, self.unsure) = (0, 0);
    }

    /// Computes for all rays what [`PreparedRay::new`] computes for one. Without a fused
    /// multiply-add the product with a plane is rounded too, which twice the error covers.
    #[inline(always)]
    fn prepare<const FUSED: bool>(&mut self) {
        let error = f32::EPSILON * if FUSED { 1.0 } else { 2.0 };
        self.axes = axes(of_lane(&self.direction, 0));
        let [kx, ky, kz] = self.axes;
        for axis in 0..3 {
            for lane in 0..LANES {
                let inverse = invert(self.direction[axis][lane]);
                let from = self.origin[axis][lane] * inverse;
                self.inverse[axis][lane] = inverse;
                self.near_from[axis][lane] = -from - from.abs() * error;
                self.far_from[axis][lane] = -from + from.abs() * error;
            }
            let back = self.inverse[axis][0] < 0.0;
            self.near[axis] = if back { axis + 3 } else { axis };
            self.far[axis] = if back { axis } else { axis + 3 };
            let (low, high) = bounds(&self.origin[axis]);
            let (slow, fast) = bounds(&self.inverse[axis]);
            self.interval[axis] = Interval {
                origin: if back { [low, high] } else { [high, low] },
                inverse: [slow, fast],
            };
        }
        for lane in 0..LANES {
            let z = self.direction[kz][lane];
            self.shear[0][lane] = self.direction[kx][lane] / z;
            self.shear[1][lane] = self.direction[ky][lane] / z;
            self.shear[2][lane] = 1.0 / z;
        }
    }

    /// The ray in a lane.
    pub(super) fn ray(&self, lane: usize) -> PreparedRay {
        PreparedRay {
            origin: of_lane(&self.origin, lane),
            direction: of_lane(&self.direction, lane),
            inverse: of_lane(&self.inverse, lane),
            axes: self.axes,
            shear: of_lane(&self.shear, lane),
        }
    }

    /// The nearest hit so far of the ray in a lane.
    pub(super) fn nearest(&self, lane: usize) -> NearestHit {
        NearestHit {
            t: self.hits.t[lane],
            weights: [self.hits.u[lane], self.hits.v[lane]],
            primitive: self.hits.primitive[lane],
            is_hit: self.hits.mask >> lane & 1 == 1,
            is_unsure: self.unsure >> lane & 1 == 1,
            through: self.hits.through[lane],
        }
    }

    /// Stores the nearest hit of the ray in a lane.
    pub(super) fn set_nearest(&mut self, lane: usize, hit: &NearestHit) {
        self.hits.t[lane] = hit.t;
        [self.hits.u[lane], self.hits.v[lane]] = hit.weights;
        self.hits.primitive[lane] = hit.primitive;
        self.hits.through[lane] = hit.through;
        self.hits.mask |= u32::from(hit.is_hit) << lane;
        self.unsure |= u32::from(hit.is_unsure) << lane;
    }
}

/// The smallest and the largest value.
#[inline(always)]
fn bounds(lanes: &Lanes<f32>) -> (f32, f32) {
    let (mut low, mut high) = (*lanes, *lanes);
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            let (a, b) = (low[i + half], high[i + half]);
            low[i] = if a < low[i] { a } else { low[i] };
            high[i] = if b > high[i] { b } else { high[i] };
        }
        half /= 2;
    }
    (low[0], high[0])
}

/// The kernel of [`PreparedPacket::load`].
struct Load<'a> {
    packet: &'a mut PreparedPacket,
    rays: &'a RayPacket,
}

impl SimdKernel for Load<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        self.packet.copy_rays(self.rays);
        self.packet.prepare::<FUSED>();
    }
}
