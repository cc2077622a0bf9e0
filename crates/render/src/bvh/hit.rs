//! The hit of one ray, and the interface to primitives that only the caller can intersect.

use glam::Vec3;
use ivcam_base::math::lanes::{Lanes, RaysInLanes};

/// The primitive that a ray hit, and the place on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The distance along the ray, as a multiple of its direction's length.
    pub t: f32,
    /// The primitive's number: the index of its box when the tree was built.
    pub primitive: u32,
    /// The weight of a triangle's second corner.
    pub u: f32,
    /// The weight of a triangle's third corner.
    pub v: f32,
    /// The use of a primitive that the caller has stored once and uses many times; 0 for a
    /// primitive of the tree.
    pub place: u64,
}

impl Hit {
    /// Returns a hit at a distance. On a triangle it is the first corner.
    #[inline]
    pub(crate) fn on(primitive: u32, place: u64, t: f32) -> Self {
        Self {
            t,
            primitive,
            u: 0.0,
            v: 0.0,
            place,
        }
    }
}

/// Two hits that differ by less than this fraction of their distance lie in the same plane. A
/// 24-bit depth buffer resolves about the same difference if its near plane is at a tenth of the
/// distance.
pub const COPLANAR: f32 = 1.0 / (1 << 20) as f32;

/// Two hits that differ by at most this fraction of their distance are close. It is twice the
/// thickness of a plane ([`COPLANAR`]).
pub(super) const CLOSE: f32 = 2.0 * COPLANAR;

/// What a traversal asks about primitives: their transmittance, and the hits on those that are not
/// triangles. A ray hits such a primitive at up to two distances; a distance without a hit is NaN.
pub trait Primitives {
    /// Returns the distances at which a ray hits a primitive, near and far. Distances beyond
    /// `t_max` may be NaN.
    fn distances(&self, origin: Vec3, direction: Vec3, primitive: u32, t_max: f32) -> [f32; 2];

    /// Computes the distances for the rays of some lanes. Returns a bit mask of the lanes that may
    /// have a hit before their `t_max`; only these lanes of `distances` are set.
    fn distances_in_lanes(
        &self,
        rays: RaysInLanes<'_>,
        primitive: u32,
        lanes: u32,
        distances: &mut [Lanes<f32>; 2],
    ) -> u32;

    /// The fraction of light that a primitive transmits; NaN if it differs from place to place.
    fn transmittance_of(&self, primitive: u32) -> f32;

    /// Whether [`Primitives::is_culled`] can be true of a primitive, so that a packet need not ask
    /// for every ray. Default: no.
    fn may_be_culled(&self, _primitive: u32) -> bool {
        false
    }

    /// Whether a primitive is culled as seen from the light that a ray leads to, where the ray hits
    /// it at the distance `t`. Default: no.
    fn is_culled(&self, _origin: Vec3, _toward_light: Vec3, _primitive: u32, _t: f32) -> bool {
        false
    }
}
