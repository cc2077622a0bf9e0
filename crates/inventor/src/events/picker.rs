//! The interface through which a scene that plays learns where the pointer meets a shape.

use std::fmt::Debug;

use glam::{DVec2, DVec3};

use crate::iv::NodeRef;
use crate::pose::ViewRay;
use crate::snapshot::Corners;
use crate::traversal::State;

/// Where a ray meets a shape, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit {
    /// The distance along the ray.
    pub distance: f64,
    /// The point, in meters.
    pub point: DVec3,
    /// The surface's normal, of length 1, on the side that is seen.
    pub normal: DVec3,
    /// The texture coordinates of the point, before a `TextureTransform`.
    pub coordinates: DVec2,
}

/// Intersects rays with single shapes. The crate `ivcam-render`, which knows what shapes look like,
/// has one; `scene::snapshot` adds it to the options.
pub trait ShapePicker: Debug + Send + Sync {
    /// Returns the nearest point at which a ray meets the visible faces of a shape with its state.
    /// Lines and points are not met.
    fn hit<'a>(&self, shape: NodeRef<'a>, state: &State<'a>, ray: &ViewRay) -> Option<ShapeHit>;

    /// Returns whether the faces of a shape with its state come within a distance in meters of a
    /// point of the world.
    fn is_near<'a>(
        &self,
        shape: NodeRef<'a>,
        state: &State<'a>,
        point: DVec3,
        distance: f64,
    ) -> bool;

    /// Returns the bounding box of a shape with its state.
    fn bounds<'a>(&self, shape: NodeRef<'a>, state: &State<'a>) -> Option<Corners>;
}
