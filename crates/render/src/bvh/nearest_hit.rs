//! Traces one ray of a packet alone.

use glam::Vec3;
use ivcam_base::math::lanes::bits;

use super::block::{Block, BlockHits};
use super::hit::{CLOSE, Hit, Primitives};
use super::nodes::{Bvh, Child};
use super::triangle::PreparedRay;

/// The nearest hit of a ray so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearestHit {
    /// Its distance; without a hit the farthest distance of interest.
    pub(super) t: f32,
    /// The weights of the triangle's second and third corner.
    pub(super) weights: [f32; 2],
    pub(super) primitive: u32,
    pub(super) is_hit: bool,
    /// Whether the caller must trace the ray by itself: it has two hits within [`CLOSE`] of each
    /// other or, toward a light, meets a primitive whose transmittance differs from place to place.
    pub(super) is_unsure: bool,
    /// The fraction of light that the primitives on the way to a light transmit, so far.
    pub(super) through: f32,
}

impl NearestHit {
    /// No hit before a distance.
    pub(super) fn before(t_max: f32) -> Self {
        Self {
            t: t_max.min(f32::MAX),
            weights: [0.0; 2],
            primitive: 0,
            is_hit: false,
            is_unsure: false,
            through: 1.0,
        }
    }

    /// The hit, if there is one.
    pub(super) fn hit(&self) -> Option<Hit> {
        let [u, v] = self.weights;
        self.is_hit.then_some(Hit {
            t: self.t,
            primitive: self.primitive,
            u,
            v,
            place: 0,
        })
    }

    /// Keeps a hit if it is nearer than the nearest so far, and records whether the two are close.
    #[inline(always)]
    pub(super) fn take(&mut self, primitive: u32, (t, u, v): (f32, f32, f32)) {
        self.is_unsure |= self.is_hit && (t - self.t).abs() <= self.t * CLOSE;
        if t < self.t {
            (self.t, self.weights, self.primitive) = (t, [u, v], primitive);
            self.is_hit = true;
        }
    }

    /// Keeps the hits on a primitive that is not a triangle.
    pub(super) fn take_distances(&mut self, primitive: u32, distances: [f32; 2]) {
        let mut from = 0.0;
        for t in distances {
            if t > from && t < self.reach() {
                self.take(primitive, (t, 0.0, 0.0));
                from = t;
            }
        }
    }

    /// Lets the light of a ray toward a light through a primitive with a transmittance. The ray has
    /// a hit if no light is left.
    #[inline(always)]
    pub(super) fn dim(&mut self, transmittance: f32) {
        self.is_hit |= transmittance == 0.0;
        self.is_unsure |= transmittance.is_nan();
        self.through *= transmittance;
    }

    /// Does what [`NearestHit::dim`] does at each hit of a ray, given by its origin and direction,
    /// on a primitive that is not a triangle.
    pub(super) fn dim_at(
        &mut self,
        distances: [f32; 2],
        primitive: u32,
        (origin, toward_light): (Vec3, Vec3),
        primitives: &impl Primitives,
    ) {
        let mut from = 0.0;
        for t in distances {
            if t > from && t < self.t {
                if !primitives.is_culled(origin, toward_light, primitive, t) {
                    self.dim(primitives.transmittance_of(primitive));
                }
                from = t;
            }
        }
    }

    /// The farthest distance at which a further hit still matters.
    #[inline(always)]
    pub(super) fn reach(&self) -> f32 {
        match self.is_hit {
            true => self.t + self.t * CLOSE,
            false => self.t,
        }
    }
}

impl Bvh {
    /// Traces a ray through the subtree `from`. With `TO_LIGHT` it is a ray toward a light.
    #[inline(always)]
    pub(super) fn walk_alone<const TO_LIGHT: bool>(
        &self,
        from: Child,
        ray: &PreparedRay,
        nearest: &mut NearestHit,
        primitives: &impl Primitives,
    ) {
        let (t_min, t_max) = (0.0, nearest.reach());
        let visit = |block: &Block, hits: &BlockHits, _: f32| {
            if TO_LIGHT {
                let (origin, direction) = (ray.origin, ray.direction);
                for primitive in bits(hits.mask).map(|i| block.primitive(i)) {
                    if !primitives.is_culled(origin, direction, primitive, 0.0) {
                        nearest.dim(primitives.transmittance_of(primitive));
                    }
                }
                for i in bits(block.non_triangles()) {
                    let primitive = block.primitive(i);
                    let found = primitives.distances(origin, direction, primitive, nearest.t);
                    nearest.dim_at(found, primitive, (origin, direction), primitives);
                }
                return match nearest.is_hit {
                    true => f32::NEG_INFINITY,
                    false => nearest.t,
                };
            }
            for i in bits(hits.mask) {
                nearest.take(block.primitive(i), (hits.t[i], hits.u[i], hits.v[i]));
            }
            for i in bits(block.non_triangles()) {
                let (primitive, end) = (block.primitive(i), nearest.reach());
                let found = primitives.distances(ray.origin, ray.direction, primitive, end);
                nearest.take_distances(primitive, found);
            }
            nearest.reach()
        };
        match TO_LIGHT {
            true => self.walk_from::<false>(from, ray, t_min, t_max, visit),
            false => self.walk_from::<true>(from, ray, t_min, t_max, visit),
        }
    }
}
