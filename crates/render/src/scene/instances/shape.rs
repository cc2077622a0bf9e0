//! The primitives of one shape, as ranges of the scene's lists.

use std::ops::Range;

use glam::{DAffine3, DVec3, Vec3};

use crate::geometry::Quadric;
use crate::geometry::quadric::exact_bounds;

/// The primitives of the shape with one surface.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct ShapePrimitives {
    /// The number of the first one in order of drawing, or `None` for a shape of a prototype, which
    /// has such a number in each instance.
    pub first: Option<u64>,
    /// The triangles.
    pub triangles: Range<u32>,
    /// The round surfaces.
    pub quadrics: Range<u32>,
    /// The lines and points.
    pub strokes: Range<u32>,
}

impl ShapePrimitives {
    /// The number of primitives.
    pub(in crate::scene) fn len(&self) -> u64 {
        let all = [&self.triangles, &self.quadrics, &self.strokes];
        all.iter().map(|r| u64::from(r.end - r.start)).sum()
    }
}

/// The triangles and round surfaces of a scene. Primitives are numbered in this order, and strokes
/// follow. Those of prototypes are in the object space of their shape.
#[derive(Clone, Copy)]
pub(in crate::scene) struct ShapeLists<'a> {
    /// The corners of triangles.
    pub triangles: &'a [[Vec3; 3]],
    /// The round surfaces.
    pub quadrics: &'a [Quadric],
}

impl ShapeLists<'_> {
    /// The numbers of the triangles and round surfaces of a shape.
    pub(in crate::scene) fn numbers(self, shape: &ShapePrimitives) -> impl Iterator<Item = u32> {
        let before = self.triangles.len() as u32;
        let quadrics = before + shape.quadrics.start..before + shape.quadrics.end;
        shape.triangles.clone().chain(quadrics)
    }

    /// The number of a primitive in its shape.
    pub(in crate::scene) fn local(self, shape: &ShapePrimitives, primitive: u32) -> u32 {
        let (triangles, quadrics) = (self.triangles.len() as u32, self.quadrics.len() as u32);
        let count = |range: &Range<u32>| range.end - range.start;
        if primitive < triangles {
            return primitive - shape.triangles.start;
        }
        let other = primitive - triangles;
        if other < quadrics {
            return count(&shape.triangles) + other - shape.quadrics.start;
        }
        let stroke = other - quadrics - shape.strokes.start;
        count(&shape.triangles) + count(&shape.quadrics) + stroke
    }

    /// The box around a triangle or a round surface under a matrix.
    pub(in crate::scene) fn around(self, primitive: u32, matrix: &DAffine3) -> (DVec3, DVec3) {
        if let Some(corners) = self.triangles.get(primitive as usize) {
            let [a, b, c] = corners.map(|p| matrix.transform_point3(p.as_dvec3()));
            return (a.min(b).min(c), a.max(b).max(c));
        }
        let quadric = &self.quadrics[primitive as usize - self.triangles.len()];
        exact_bounds(quadric.kind, matrix)
    }
}
