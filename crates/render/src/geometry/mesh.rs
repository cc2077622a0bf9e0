//! Triangle meshes in object space, which text, NURBS and VRML97's shapes generate.

use glam::{Vec2, Vec3};

/// Triangles over shared vertices. `positions`, `normals` and `texcoords` have one entry for each
/// vertex. Front faces are counterclockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// The vertices' positions.
    pub positions: Vec<Vec3>,
    /// The vertices' normals, of length 1 or 0.
    pub normals: Vec<Vec3>,
    /// The vertices' texture coordinates.
    pub texcoords: Vec<Vec2>,
    /// The vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The part of each triangle, for materials bound to parts; empty if there is one part.
    pub parts: Vec<u8>,
    /// The index of each vertex's color; empty if the shape has no colors of its own.
    pub colors: Vec<u32>,
}

impl TriangleMesh {
    /// Adds a vertex and returns its index.
    pub(crate) fn vertex(&mut self, position: Vec3, normal: Vec3, texcoord: Vec2) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.normals.push(normal);
        self.texcoords.push(texcoord);
        index
    }

    /// Returns the memory of all lists in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        let vertices = size_of_val(&self.positions[..]) + size_of_val(&self.normals[..]);
        let triangles = size_of_val(&self.triangles[..]) + self.parts.len();
        let colors = size_of_val(&self.texcoords[..]) + size_of_val(&self.colors[..]);
        (vertices + triangles + colors) as u64
    }

    /// Removes all vertices and triangles, and keeps their memory.
    pub(crate) fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.texcoords.clear();
        self.triangles.clear();
        self.parts.clear();
        self.colors.clear();
    }

    /// The material indices of a triangle's corners: its part if `by_part`, else the vertices'
    /// colors.
    pub(crate) fn materials(&self, triangle: usize, by_part: bool) -> [u32; 3] {
        if by_part {
            return [self.parts.get(triangle).map_or(0, |&p| u32::from(p)); 3];
        }
        self.triangles[triangle].map(|v| self.colors.get(v as usize).copied().unwrap_or(0))
    }

    /// The smallest and the largest corner of the bounding box, or `None` without vertices.
    #[cfg(test)]
    pub(crate) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(
            self.positions
                .iter()
                .fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p))),
        )
    }

    /// Whether every position and normal is finite, every index is in range and all lists have the
    /// right length.
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
impl TriangleMesh {
    /// The signed volume by the divergence theorem, positive if a closed mesh faces outward.
    pub(crate) fn volume(&self) -> f64 {
        let p = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles
            .iter()
            .map(|&[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0)
            .sum()
    }

    /// The total area of the triangles.
    pub(crate) fn area(&self) -> f64 {
        let p = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (p(b) - p(a)).cross(p(c) - p(a)).length())
            .sum()
    }
}
