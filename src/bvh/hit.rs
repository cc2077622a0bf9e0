//! A hit of one ray, and primitives that only the caller can intersect.

use super::triangle::PreparedRay;

/// Where a ray hit a primitive: which one, and where on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    /// The number of the box over which the tree was built.
    pub primitive: u32,
    /// Weight of a triangle's second corner.
    pub u: f32,
    /// Weight of a triangle's third corner.
    pub v: f32,
}

/// Hits nearer together than this share of their distance lie in one plane. That is about what a
/// depth buffer of 24 bits tells apart when its near plane is a tenth as far as the scene.
pub(crate) const COPLANAR: f32 = 1.0 / (1 << 20) as f32;

/// Intersects primitives that are not triangles.
pub(crate) trait NonTriangles {
    /// The distance of a ray's nearest hit on a primitive, between the two distances.
    fn intersect(&self, ray: &PreparedRay, primitive: u32, t_min: f32, t_max: f32) -> Option<f32>;
}
