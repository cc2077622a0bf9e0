//! The primitive that a ray has hit, placed in the scene.
//!
//! A primitive of the scene itself is stored there. One of a prototype is in object space, and is
//! placed by the instance that the hit tells.

use std::borrow::Cow;

use glam::Vec3;

use super::instances::ShapeLists;
use super::looks::Surface;
use super::render_scene::RenderScene;
use crate::bvh::Hit;
use crate::geometry::{Quadric, Stroke};

/// A primitive in the scene. It lives on the stack while one hit is shaded, so its size costs
/// nothing.
#[allow(clippy::large_enum_variant)]
pub(super) enum Primitive<'a> {
    /// A triangle, by its corners.
    Triangle([Vec3; 3]),
    /// A round surface.
    Quadric(Cow<'a, Quadric>),
    /// A line or a point.
    Stroke(&'a Stroke),
}

impl RenderScene {
    /// The triangles and round surfaces of the scene and of its prototypes.
    pub(super) fn lists(&self) -> ShapeLists<'_> {
        ShapeLists {
            triangles: &self.triangles,
            quadrics: &self.quadrics,
        }
    }

    /// Returns the primitive of a hit.
    #[inline]
    pub(super) fn primitive(&self, hit: &Hit) -> Primitive<'_> {
        if let Some(corners) = self.corners(hit.primitive, hit.place) {
            return Primitive::Triangle(corners);
        }
        let index = hit.primitive as usize - self.triangles.len();
        let Some(quadric) = self.quadrics.get(index) else {
            return Primitive::Stroke(&self.strokes[index - self.quadrics.len()]);
        };
        let instances = self.instances.as_ref().filter(|_| hit.place != 0);
        let placed = instances.and_then(|all| all.quadric(quadric, hit.place));
        Primitive::Quadric(placed.map_or(Cow::Borrowed(quadric), Cow::Owned))
    }

    /// Whether hits may be on primitives of prototypes.
    pub(crate) fn has_instances(&self) -> bool {
        self.instances.is_some()
    }

    /// Whether the shape with a surface is in a prototype, so that it is drawn only by instances.
    pub(super) fn is_in_prototype(&self, surface: u32) -> bool {
        let instances = self.instances.as_ref();
        instances.is_some_and(|all| all.has_shape(surface))
    }

    /// The corners of a hit primitive, or `None` if it is not a triangle.
    #[inline(always)]
    pub(crate) fn corners(&self, primitive: u32, place: u64) -> Option<[Vec3; 3]> {
        let corners = *self.triangles.get(primitive as usize)?;
        Some(match place {
            0 => corners,
            _ => self.placed_corners(corners, place),
        })
    }

    /// The directions of a picture on a hit triangle, of length 1: toward those who see it
    /// unmirrored, and upward in it along the surface. Returns `None` without coordinates of a
    /// texture.
    pub fn photograph_at(&self, hit: &Hit) -> Option<[Vec3; 2]> {
        let surface = self.surface(hit);
        surface.texture.as_ref()?;
        let [a, b, c] = self.corners(hit.primitive, hit.place)?;
        let local = hit.primitive.checked_sub(surface.first)? as usize;
        let [ta, tb, tc] = *surface.coordinates.get(local)?;
        let ((p, q), (s, t)) = ((b - a, c - a), (tb - ta, tc - ta));
        let turn = s.perp_dot(t);
        let outward = (turn.signum() * p.cross(q)).try_normalize()?;
        // The point of the surface moves by this while the second coordinate grows.
        let upward = (turn.signum() * (s.x * q - t.x * p)).try_normalize()?;
        (turn != 0.0).then_some([outward, upward])
    }

    /// The corners of a triangle of a prototype, placed in the scene.
    #[cold]
    #[inline(never)]
    fn placed_corners(&self, corners: [Vec3; 3], place: u64) -> [Vec3; 3] {
        let Some(instances) = &self.instances else {
            return corners;
        };
        let placement = instances.placement(place);
        corners.map(|p| placement.point(p))
    }

    /// The normals of the corners of a surface's triangle, or `None` if its face is flat.
    #[inline(always)]
    pub(crate) fn normals(
        &self,
        surface: &Surface,
        triangle: usize,
        place: u64,
    ) -> Option<[Vec3; 3]> {
        let normals = surface.normals.get(triangle)?;
        Some(match place {
            0 => normals,
            _ => self.placed_normals(normals, place),
        })
    }

    /// The normals of a triangle of a prototype, turned into the scene.
    #[cold]
    #[inline(never)]
    fn placed_normals(&self, normals: [Vec3; 3], place: u64) -> [Vec3; 3] {
        let Some(instances) = &self.instances else {
            return normals;
        };
        let placement = instances.placement(place);
        normals.map(|normal| placement.normal(normal))
    }

    /// The number of a primitive's surface.
    #[inline(always)]
    pub(crate) fn owner(&self, primitive: u32) -> u32 {
        self.owners[primitive as usize]
    }

    /// Whether a hit is on a triangle.
    #[inline(always)]
    pub(super) fn is_triangle(&self, hit: &Hit) -> bool {
        (hit.primitive as usize) < self.triangles.len()
    }
}
