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

    /// Whether the backs of triangles can be seen from outside: some edge has no triangle on its
    /// other side, or the mesh is inside out.
    pub fn shows_backs(&self) -> bool {
        // The difference of the sums of edges in both directions, by hashes of their ends. Of an
        // open mesh it is 0 by chance once in 2⁶⁴.
        let mut open = 0_u64;
        let mut volume = 0.0;
        for triangle in self.triangles() {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (from, to) = (hash_of(from), hash_of(to));
                open = open
                    .wrapping_add(mixed(from, to))
                    .wrapping_sub(mixed(to, from));
            }
            let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
            volume += a.dot(b.cross(c));
        }
        open != 0 || volume < 0.0
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
/// Returns a hash of a position. The two zeros are one.
fn hash_of(position: Vec3) -> u64 {
    let numbers = (position + Vec3::ZERO)
        .to_array()
        .map(|v| u64::from(v.to_bits()));
    numbers.into_iter().fold(0, mixed)
}

/// Mixes a number into a hash, by the finalizer of SplitMix64 (Steele, Lea and Flood, 2014).
fn mixed(hash: u64, number: u64) -> u64 {
    let z = (hash ^ number)
        .wrapping_add(hash.rotate_left(32))
        .wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
