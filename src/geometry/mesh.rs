//! Triangles in a shape's own space, as text, NURBS and VRML97's shapes make them.

use glam::{Vec2, Vec3};

/// Triangles over shared vertices. `positions`, `normals` and `texcoords` have one entry a vertex;
/// front faces are counterclockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub texcoords: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
    /// The part of each triangle, for materials by part; empty where there is one part.
    pub parts: Vec<u8>,
    /// Which of the shape's colors each vertex has; empty where the shape has none of its own.
    pub colors: Vec<u32>,
}

impl Mesh {
    pub(crate) fn vertex(&mut self, position: Vec3, normal: Vec3, texcoord: Vec2) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.normals.push(normal);
        self.texcoords.push(texcoord);
        index
    }

    /// The materials of a triangle's corners: its part's, or those that the vertices have.
    pub(crate) fn materials(&self, triangle: usize, by_part: bool) -> [u32; 3] {
        if by_part {
            return [self.parts.get(triangle).map_or(0, |&p| u32::from(p)); 3];
        }
        self.triangles[triangle].map(|v| self.colors.get(v as usize).copied().unwrap_or(0))
    }

    /// The smallest and largest corner; `None` for no vertices.
    #[cfg(test)]
    pub(crate) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(
            self.positions
                .iter()
                .fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p))),
        )
    }

    /// Whether every number is finite and every index has its vertex.
    pub(crate) fn is_sound(&self) -> bool {
        let n = self.positions.len();
        n == self.normals.len()
            && n == self.texcoords.len()
            && (self.parts.is_empty() || self.parts.len() == self.triangles.len())
            && (self.colors.is_empty() || self.colors.len() == n)
            && self
                .positions
                .iter()
                .chain(&self.normals)
                .all(|v| v.is_finite())
            && self.triangles.iter().flatten().all(|&i| (i as usize) < n)
    }
}

/// The corners of a quadrilateral of a grid, as steps along the columns and the rows.
pub(super) const QUAD_CORNERS: [(usize, usize); 4] = [(0, 0), (1, 0), (1, 1), (0, 1)];

#[cfg(test)]
impl Mesh {
    /// Signed volume by the divergence theorem: positive where a closed mesh faces outward.
    pub(crate) fn volume(&self) -> f64 {
        let p = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles
            .iter()
            .map(|&[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0)
            .sum()
    }

    pub(crate) fn area(&self) -> f64 {
        let p = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (p(b) - p(a)).cross(p(c) - p(a)).length())
            .sum()
    }
}
