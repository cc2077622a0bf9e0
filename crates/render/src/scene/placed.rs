//! The primitive that a ray has hit, placed in the scene.
//!
//! A primitive of the scene itself is stored there. One of a prototype is placed by the path of
//! uses that the hit tells.

use std::borrow::Cow;

use glam::Vec3;

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
    /// Returns the primitive of a hit.
    #[inline]
    pub(super) fn primitive(&self, hit: &Hit) -> Primitive<'_> {
        if let Some(corners) = self.corners(hit.primitive, hit.place) {
            return Primitive::Triangle(corners);
        }
        if hit.place != 0
            && let Some(instances) = &self.instances
            && let Some(quadric) = instances.quadric(hit.primitive, hit.place)
        {
            return Primitive::Quadric(Cow::Owned(quadric));
        }
        let index = hit.primitive as usize - self.triangles.len();
        match self.quadrics.get(index) {
            Some(quadric) => Primitive::Quadric(Cow::Borrowed(quadric)),
            None => Primitive::Stroke(&self.strokes[index - self.quadrics.len()]),
        }
    }

    /// Whether hits may be on primitives of prototypes.
    pub(crate) fn has_instances(&self) -> bool {
        self.instances.is_some()
    }

    /// The corners of a hit primitive, or `None` if it is not a triangle.
    #[inline(always)]
    pub(crate) fn corners(&self, primitive: u32, place: u64) -> Option<[Vec3; 3]> {
        if place != 0 {
            return self.placed_corners(primitive, place);
        }
        self.triangles.get(primitive as usize).copied()
    }

    /// The corners of a triangle of a prototype, placed in the scene.
    #[cold]
    #[inline(never)]
    fn placed_corners(&self, primitive: u32, place: u64) -> Option<[Vec3; 3]> {
        self.instances.as_ref()?.corners(primitive, place)
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

    /// The number of a hit primitive's surface.
    #[inline(always)]
    pub(crate) fn owner(&self, primitive: u32, place: u64) -> u32 {
        match &self.instances {
            Some(instances) if place != 0 => instances.owners[primitive as usize],
            _ => self.owners[primitive as usize],
        }
    }

    /// Whether a hit is on a triangle.
    #[inline(always)]
    pub(super) fn is_triangle(&self, hit: &Hit) -> bool {
        let triangles = match &self.instances {
            Some(instances) if hit.place != 0 => instances.triangles.len(),
            _ => self.triangles.len(),
        };
        (hit.primitive as usize) < triangles
    }
}
