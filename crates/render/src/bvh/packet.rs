//! Packets of rays in lanes, and their hits.

use ivcam_base::math::lanes::{
    LANES, Lanes, SimdKernel, Vec3Lanes, bits, dispatch, of_lane, set_lane,
};

use super::hit::{Hit, Primitives};
use super::nearest_hit::NearestHit;
use super::nodes::{Bvh, Child};
use super::prepared_packet::PreparedPacket;
use super::ray::{OCTANTS, Ray, direction_octant};
use super::triangle::{PreparedRay, axes};

/// The largest number of rays of an octant that are traced one by one if a packet has rays of
/// several octants. Packets of rays in all directions are 1.5 times as fast as with 0, and take
/// with AVX2 1.02 to 1.08 times as long as their rays one by one
/// (docs/decisions/0007-bundles-of-32-rays.md). Hits have the same bits with any value.
const FEW_OF_OCTANT: u32 = 8;

/// Rays in lanes. Rays of neighboring pixels, or toward the same light, are traced together.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct RayPacket {
    /// The rays' origins; the rays start there, at distance 0.
    pub origin: Vec3Lanes,
    /// The rays' directions, of any length; distances are multiples of it.
    pub direction: Vec3Lanes,
    /// Farther hits are ignored.
    pub t_max: Lanes<f32>,
    /// A bit mask of the lanes that hold a ray. Other lanes have arbitrary values.
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
    /// The ray in a lane.
    pub(crate) fn ray(&self, lane: usize) -> Ray {
        Ray {
            t_max: self.t_max[lane],
            ..Ray::new(of_lane(&self.origin, lane), of_lane(&self.direction, lane))
        }
    }

    /// Stores a ray in a lane. Its `t_min` is ignored: the ray starts at distance 0.
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        set_lane(&mut self.origin, lane, ray.origin);
        set_lane(&mut self.direction, lane, ray.direction);
        self.t_max[lane] = ray.t_max;
        self.mask |= 1 << lane;
    }

    /// Calls `work` with packets in which all rays have the same direction octant, and with the
    /// rays of octants that have few.
    fn by_octant(&self, mut work: impl FnMut(OctantPart<'_>)) {
        if self.mask == 0 {
            return;
        }
        let (octants, is_one) = dispatch(Octants(self));
        if is_one {
            return work(OctantPart::Packet(self, Origin::SameLanes));
        }
        let mut lanes_of = [0u32; OCTANTS];
        let mut present = 0u32;
        for lane in bits(self.mask) {
            let octant = octants[lane] as usize % OCTANTS;
            lanes_of[octant] |= 1 << lane;
            present |= 1 << octant;
        }
        for octant in bits(present) {
            let same = lanes_of[octant];
            let first = same.trailing_zeros() as usize;
            if same.count_ones() <= FEW_OF_OCTANT {
                let axes = axes(self.ray(first).direction);
                for lane in bits(same) {
                    work(OctantPart::Ray(
                        lane,
                        &PreparedRay::with_axes(&self.ray(lane), axes),
                    ));
                }
                continue;
            }
            let (mut part, mut lanes, mut count) = (Self::default(), [0; LANES], 0);
            for lane in bits(same) {
                part.set(count, &self.ray(lane));
                lanes[count] = lane as u8;
                count += 1;
            }
            work(OctantPart::Packet(&part, Origin::Lanes(&lanes[..count])));
        }
    }
}

/// A part of a packet.
enum OctantPart<'a> {
    /// Rays with the same direction octant.
    Packet(&'a RayPacket, Origin<'a>),
    /// The ray of a lane.
    Ray(usize, &'a PreparedRay),
}

/// The lanes of the whole packet from which the rays of a part were taken.
#[derive(Clone, Copy)]
enum Origin<'a> {
    /// The part is the whole packet.
    SameLanes,
    /// The lane of each ray of the part.
    Lanes(&'a [u8]),
}

impl Origin<'_> {
    /// Converts a bit mask of the part's lanes to one of the whole packet's lanes.
    fn spread(self, part: u32) -> u32 {
        match self {
            Self::SameLanes => part,
            Self::Lanes(lanes) => bits(part).fold(0, |mask, i| mask | 1 << lanes[i]),
        }
    }
}

/// Computes the direction octant of each ray of a packet.
struct Octants<'a>(&'a RayPacket);

impl SimdKernel for Octants<'_> {
    /// The octants, and whether those of all rays are the same.
    type Output = (Lanes<u32>, bool);

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> (Lanes<u32>, bool) {
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
        (octants, differ == 0)
    }
}

/// The hits of a packet's rays, in lanes: see [`Hit`].
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct PacketHits {
    /// The distances along the rays.
    pub t: Lanes<f32>,
    /// The weights of the triangles' second corners.
    pub u: Lanes<f32>,
    /// The weights of the triangles' third corners.
    pub v: Lanes<f32>,
    /// The primitives that were hit.
    pub primitive: Lanes<u32>,
    /// The use of each primitive, where it is drawn more than once: see [`Hit::place`].
    pub place: Lanes<u64>,
    /// The fraction of light that rays toward a light bring through the primitives on their way.
    pub through: Lanes<f32>,
    /// A bit mask of the rays that hit something. A ray toward a light hits only what lets no light
    /// through.
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
        place: [0; LANES],
        through: [1.0; LANES],
        mask: 0,
    };

    /// The hit of the ray in a lane.
    pub(crate) fn hit(&self, lane: usize) -> Option<Hit> {
        (self.mask >> lane & 1 == 1).then(|| Hit {
            t: self.t[lane],
            primitive: self.primitive[lane],
            u: self.u[lane],
            v: self.v[lane],
            place: self.place[lane],
        })
    }

    /// Stores the hit of the ray in a lane, or that there is none.
    pub(crate) fn set(&mut self, lane: usize, hit: Option<Hit>) {
        self.mask &= !(1 << lane);
        if let Some(hit) = hit {
            (self.t[lane], self.u[lane], self.v[lane]) = (hit.t, hit.u, hit.v);
            self.primitive[lane] = hit.primitive;
            self.place[lane] = hit.place;
            self.mask |= 1 << lane;
        }
    }

    /// Copies the hits of a part of the packet to the lanes of its rays. With `TO_LIGHT` it copies
    /// which rays hit something, and their transmittances.
    fn take<const TO_LIGHT: bool>(&mut self, part: &Self, origin: Origin<'_>) {
        match origin {
            Origin::SameLanes if TO_LIGHT => {
                (self.mask, self.through) = (part.mask, part.through);
            }
            Origin::SameLanes => {
                (self.mask, self.primitive, self.place) = (part.mask, part.primitive, part.place);
                (self.t, self.u, self.v) = (part.t, part.u, part.v);
            }
            Origin::Lanes(lanes) => {
                for (i, lane) in lanes.iter().map(|lane| usize::from(*lane)).enumerate() {
                    self.set(lane, part.hit(i));
                    self.through[lane] = part.through[i];
                }
            }
        }
    }
}

impl Bvh {
    /// Finds the nearest hit of every ray. Returns a bit mask of the rays that have two hits so
    /// close together that a caller may prefer the farther one. The caller traces those rays one by
    /// one.
    pub fn nearest_hits(
        &self,
        rays: &RayPacket,
        primitives: &impl Primitives,
        hits: &mut PacketHits,
    ) -> u32 {
        self.find_hits::<false>(rays, primitives, hits)
    }

    /// Finds how much light each ray toward a light brings: sets the hits' `mask` and `through`.
    /// Returns a bit mask of the rays that meet a primitive whose transmittance differs from place
    /// to place. The caller traces those rays one by one, unless they are in `mask`.
    pub fn transmittances(
        &self,
        rays: &RayPacket,
        primitives: &impl Primitives,
        hits: &mut PacketHits,
    ) -> u32 {
        self.find_hits::<true>(rays, primitives, hits)
    }

    fn find_hits<const TO_LIGHT: bool>(
        &self,
        rays: &RayPacket,
        primitives: &impl Primitives,
        hits: &mut PacketHits,
    ) -> u32 {
        hits.mask = 0;
        if self.nodes.is_empty() {
            hits.through = [1.0; LANES];
            return 0;
        }
        let mut unsure = 0;
        let mut packet = PreparedPacket::empty();
        rays.by_octant(|part| match part {
            OctantPart::Packet(part, origin) => {
                packet.load(part);
                self.walk_packet::<TO_LIGHT>(&mut packet, primitives);
                hits.take::<TO_LIGHT>(&packet.hits, origin);
                unsure |= origin.spread(packet.unsure);
            }
            OctantPart::Ray(lane, ray) => {
                let mut nearest = NearestHit::before(rays.t_max[lane]);
                self.walk_alone::<TO_LIGHT>(Child::ROOT, ray, &mut nearest, primitives);
                hits.set(lane, nearest.hit());
                hits.through[lane] = nearest.through;
                unsure |= u32::from(nearest.is_unsure) << lane;
            }
        });
        unsure
    }
}
