//! The mesh of a shape: triangles, lines or points over shared vertices, in object space.

use glam::{DAffine3, DVec3, Vec2, Vec3};

/// The primitives of a mesh, as indices of its vertices.
#[derive(Clone, Debug, PartialEq)]
pub enum Primitives {
    /// Triangles. Their corners run counterclockwise as seen from the front.
    Triangles(Vec<[u32; 3]>),
    /// Lines between two vertices.
    Lines(Vec<[u32; 2]>),
    /// Every vertex is a point.
    Points,
}

/// A mesh. The lists other than `positions` are empty, or have one entry for each vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The positions of the vertices.
    pub positions: Vec<Vec3>,
    /// The normals, of length 1; empty for lines and points without normals.
    pub normals: Vec<Vec3>,
    /// The texture coordinates s and t, with t upward; empty without a texture.
    pub coordinates: Vec<Vec2>,
    /// The diffuse colors and opacities, which replace those of the material; empty if the shape
    /// has one color.
    pub colors: Vec<[f32; 4]>,
    /// The primitives.
    pub primitives: Primitives,
}

impl Mesh {
    /// The triangles; none for lines and points.
    pub fn triangles(&self) -> &[[u32; 3]] {
        match &self.primitives {
            Primitives::Triangles(list) => list,
            _ => &[],
        }
    }

    /// The smallest and the largest corner of the bounding box after a matrix, or `None` without
    /// vertices.
    pub fn bounds(&self, matrix: &DAffine3) -> Option<(DVec3, DVec3)> {
        let placed = self.positions.iter();
        let mut placed = placed.map(|p| matrix.transform_point3(p.as_dvec3()));
        let first = placed.next()?;
        Some(placed.fold((first, first), |(a, b), p| (a.min(p), b.max(p))))
    }
}
