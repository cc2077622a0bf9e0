//! Welds the corners of a shape to vertices, so that equal corners are one vertex.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::mesh::{Mesh, Primitives};
use crate::geometry::Corner;

/// The position, the normal, the texture coordinates and the material of a vertex, as bits.
type VertexBits = [u32; 9];

/// Which lists the meshes of a shape have.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lists {
    pub coordinates: bool,
    pub colors: bool,
}

/// Vertices under construction.
#[derive(Debug, Default)]
pub(super) struct WeldedVertices {
    numbers: HashMap<VertexBits, u32>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    coordinates: Vec<Vec2>,
    materials: Vec<u32>,
}

impl WeldedVertices {
    /// Returns the number of the vertex of a corner, which is added unless there is one already.
    pub(super) fn number(&mut self, corner: &Corner, lists: Lists) -> u32 {
        let (p, n) = (corner.position, corner.normal);
        let t = if lists.coordinates {
            corner.coordinates
        } else {
            Vec2::ZERO
        };
        let material = if lists.colors { corner.material } else { 0 };
        // −0 and 0 are the same number.
        let bits = |v: f32| (v + 0.0).to_bits();
        let [px, py, pz, nx, ny, nz, s, r] = [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y].map(bits);
        let next = self.positions.len() as u32;
        let key = [px, py, pz, nx, ny, nz, s, r, material];
        let number = *self.numbers.entry(key).or_insert(next);
        if number == next {
            self.positions.push(p);
            self.normals.push(n);
            self.coordinates.push(t);
            self.materials.push(material);
        }
        number
    }

    /// Makes a mesh of the vertices. `color` returns the color of a material.
    pub(super) fn into_mesh(
        self,
        primitives: Primitives,
        lists: Lists,
        color: impl Fn(u32) -> [f32; 4],
    ) -> Mesh {
        let zero = |n: &Vec3| *n == Vec3::ZERO;
        let is_lit = matches!(primitives, Primitives::Triangles(_));
        let has_normals = is_lit || !self.normals.iter().any(zero);
        Mesh {
            positions: self.positions,
            normals: if has_normals {
                self.normals
            } else {
                Vec::new()
            },
            coordinates: if lists.coordinates {
                self.coordinates
            } else {
                Vec::new()
            },
            colors: if lists.colors {
                self.materials.iter().map(|m| color(*m)).collect()
            } else {
                Vec::new()
            },
            primitives,
        }
    }
}
