//! Packets of rays side by side, and their hits.

use super::hit::{Hit, NonTriangles};
use super::nodes::Bvh;
use super::prepared_packet::PreparedPacket;
use super::ray::{Ray, direction_octant};
use crate::math::lanes::{LANES, Lanes, SimdKernel, Vec3Lanes, bits, dispatch, of_lane, set_lane};

/// Rays side by side. Those of neighboring pixels or towards one light go through the tree
/// together.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct RayPacket {
    pub origin: Vec3Lanes,
    /// Need not be of length 1; distances are multiples of its length.
    pub direction: Vec3Lanes,
    pub t_max: Lanes<f32>,
    /// Which lanes hold a ray: bits. The numbers in other lanes mean nothing.
    pub mask: u32,
}

impl Default for RayPacket {
    fn default() -> Self {
        Self {
            origin: [[0.0; LANES]; 3],
            direction: [[1.0; LANES]; 3],
            t_max: [f32::INFINITY; LANES],
            mask: 0,
        }
    }
}

impl RayPacket {
    /// Whether this processor traces packets faster than their rays one by one.
    pub fn is_fast() -> bool {
        PreparedPacket::is_fast()
    }

    pub fn ray(&self, lane: usize) -> Ray {
        Ray {
            t_max: self.t_max[lane],
            ..Ray::new(of_lane(&self.origin, lane), of_lane(&self.direction, lane))
        }
    }

    /// Stores a ray, which starts at distance 0 whatever its `t_min`.
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        set_lane(&mut self.origin, lane, ray.origin);
        set_lane(&mut self.direction, lane, ray.direction);
        self.t_max[lane] = ray.t_max;
        self.mask |= 1 << lane;
    }

    fn octant(&self, lane: usize) -> u32 {
        direction_octant(self.direction.map(|axis| axis[lane]))
    }

    /// Has `work` done on packets of rays that have one direction octant.
    fn by_octant(&self, mut work: impl FnMut(&Self, Origin<'_>)) {
        if self.mask == 0 {
            return;
        }
        if dispatch(OneOctant(self)) {
            return work(self, Origin::SameLanes);
        }
        let mut left = self.mask;
        while left != 0 {
            let octant = self.octant(left.trailing_zeros() as usize);
            let (mut part, mut lanes, mut count) = (Self::default(), [0; LANES], 0);
            for lane in bits(left) {
                if self.octant(lane) == octant {
                    part.set(count, &self.ray(lane));
                    lanes[count] = lane as u8;
                    count += 1;
                    left &= !(1 << lane);
                }
            }
            work(&part, Origin::Lanes(&lanes[..count]));
        }
    }
}

/// The lanes of a packet from which the rays of a part of it are.
#[derive(Clone, Copy)]
enum Origin<'a> {
    SameLanes,
    Lanes(&'a [u8]),
}

impl Origin<'_> {
    /// Bits of the part as bits of the whole packet.
    fn spread(self, part: u32) -> u32 {
        match self {
            Self::SameLanes => part,
            Self::Lanes(lanes) => bits(part).fold(0, |mask, i| mask | 1 << lanes[i]),
        }
    }
}

/// Whether all rays of a packet have one direction octant.
struct OneOctant<'a>(&'a RayPacket);

impl SimdKernel for OneOctant<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> bool {
        let Self(rays) = self;
        let [x, y, z] = &rays.direction;
        let mut octants = [0u32; LANES];
        for i in 0..LANES {
            octants[i] = direction_octant([x[i], y[i], z[i]]);
        }
        let first = octants[rays.mask.trailing_zeros() as usize % LANES];
        let mut differ = 0;
        for (i, octant) in octants.iter().enumerate() {
            differ |= if rays.mask >> i & 1 == 1 {
                octant ^ first
            } else {
                0
            };
        }
        differ == 0
    }
}

/// The hits of a packet's rays, side by side.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct PacketHits {
    pub t: Lanes<f32>,
    pub u: Lanes<f32>,
    pub v: Lanes<f32>,
    pub primitive: Lanes<u32>,
    /// Which rays hit something: bits.
    pub mask: u32,
}

impl Default for PacketHits {
    fn default() -> Self {
        Self::NONE
    }
}

impl PacketHits {
    pub(super) const NONE: Self = Self {
        t: [0.0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
        primitive: [0; LANES],
        mask: 0,
    };

    pub(crate) fn hit(&self, lane: usize) -> Option<Hit> {
        (self.mask >> lane & 1 == 1).then(|| Hit {
            t: self.t[lane],
            primitive: self.primitive[lane],
            u: self.u[lane],
            v: self.v[lane],
        })
    }

    pub(crate) fn set(&mut self, lane: usize, hit: Option<Hit>) {
        self.mask &= !(1 << lane);
        if let Some(hit) = hit {
            (self.t[lane], self.u[lane], self.v[lane]) = (hit.t, hit.u, hit.v);
            self.primitive[lane] = hit.primitive;
            self.mask |= 1 << lane;
        }
    }

    /// Takes the hits of a part of the packet.
    fn take(&mut self, part: &Self, origin: Origin<'_>) {
        match origin {
            Origin::SameLanes => self.clone_from(part),
            Origin::Lanes(lanes) => {
                for (i, lane) in lanes.iter().enumerate() {
                    self.set(usize::from(*lane), part.hit(i));
                }
            }
        }
    }
}

impl Bvh {
    /// Finds the nearest hit of every ray. Returns, as bits, the rays that have two hits so near
    /// together that a caller may prefer the other one: trace those by themselves.
    pub(crate) fn nearest_hits(
        &self,
        rays: &RayPacket,
        non_triangles: &impl NonTriangles,
        hits: &mut PacketHits,
    ) -> u32 {
        hits.mask = 0;
        let mut close = 0;
        let mut packet = PreparedPacket::empty();
        rays.by_octant(|part, origin| {
            packet.load(part);
            self.walk_packet::<false>(&mut packet, non_triangles);
            hits.take(&packet.hits, origin);
            close |= origin.spread(packet.hits.mask & packet.close);
        });
        close
    }

    /// Finds the rays that hit anything, as the hits' `mask`, and one `primitive` of each.
    pub(crate) fn any_hits(
        &self,
        rays: &RayPacket,
        non_triangles: &impl NonTriangles,
        hits: &mut PacketHits,
    ) {
        hits.mask = 0;
        let mut packet = PreparedPacket::empty();
        rays.by_octant(|part, origin| {
            packet.load(part);
            self.walk_packet::<true>(&mut packet, non_triangles);
            hits.take(&packet.hits, origin);
        });
    }
}
