//! The hit of one ray, and the interface to primitives that only the caller can intersect.

use super::triangle::PreparedRay;

/// The primitive that a ray hit, and the place on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
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

/// Two hits that differ by less than this fraction of their distance lie in the same plane. A
/// 24-bit depth buffer resolves about the same difference if its near plane is at a tenth of the
/// distance.
pub(crate) const COPLANAR: f32 = 1.0 / (1 << 20) as f32;

/// Intersects primitives that are not triangles.
pub(crate) trait NonTriangles {
    /// Returns the distance of a ray's nearest hit on a primitive between `t_min` and `t_max`.
    fn intersect(&self, ray: &PreparedRay, primitive: u32, t_min: f32, t_max: f32) -> Option<f32>;
}
