//! Normals for shapes that have none, by crease angle, as Coin makes them.
//!
//! A corner's normal starts with its own face's and adds those of the other faces at the vertex
//! whose normals are within the crease angle of it. All are of length 1 first, so a large face
//! counts no more than a small one.

use std::collections::HashMap;

use glam::Vec3;

/// The normal of a polygon: of a triangle by its edges, of others by Newell's sums.
pub fn face_normal(points: &[Vec3], counterclockwise: bool) -> Vec3 {
    let normal = match points {
        [a, b, c] => (*c - *b).cross(*a - *b),
        _ => newell(points),
    };
    let normal = unit(normal);
    if counterclockwise { normal } else { -normal }
}

pub fn newell(points: &[Vec3]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (i, &a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        sum += Vec3::new(
            (a.y - b.y) * (a.z + b.z),
            (a.z - b.z) * (a.x + b.x),
            (a.x - b.x) * (a.y + b.y),
        );
    }
    sum
}

/// Of length 1, or zero where there is no direction; small faces do not vanish.
pub fn unit(v: Vec3) -> Vec3 {
    let wide = v.as_dvec3();
    let length = wide.length();
    if length > 0.0 && length.is_finite() {
        (wide / length).as_vec3()
    } else {
        Vec3::ZERO
    }
}

/// Faces over shared vertices.
#[derive(Default)]
pub struct Faces {
    pub normals: Vec<Vec3>,
    /// Vertex and face of each corner.
    pub corners: Vec<(u32, u32)>,
}

/// More faces than this at one vertex, and their mean serves for all: the time would grow with
/// the square.
const CROWD: usize = 4096;

impl Faces {
    /// The faces at each vertex, whose normals are to be made smooth.
    pub fn around(&self, crease_angle: f32) -> Around<'_> {
        let count = self.corners.iter().map(|c| c.0 as usize + 1).max();
        let count = count.unwrap_or(0);
        let mut starts = vec![0u32; count + 1];
        for (vertex, _) in &self.corners {
            starts[*vertex as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut at_vertex = vec![0u32; self.corners.len()];
        for (vertex, face) in &self.corners {
            let slot = &mut next[*vertex as usize];
            at_vertex[*slot as usize] = *face;
            *slot += 1;
        }
        Around {
            normals: &self.normals,
            starts,
            at_vertex,
            threshold: libm::cosf(crease_angle.clamp(0.0, std::f32::consts::PI)),
        }
    }
}

/// The faces around vertices.
pub struct Around<'f> {
    normals: &'f [Vec3],
    /// Where the faces of each vertex begin: one list behind the other.
    starts: Vec<u32>,
    at_vertex: Vec<u32>,
    /// Cosine of the crease angle.
    threshold: f32,
}

impl Around<'_> {
    /// The normal at a vertex as seen from a face.
    pub fn normal(&self, vertex: u32, face: u32) -> Vec3 {
        let own = self.normals[face as usize];
        let start = |v: usize| {
            self.starts
                .get(v)
                .map_or(self.at_vertex.len(), |&s| s as usize)
        };
        let around = &self.at_vertex[start(vertex as usize)..start(vertex as usize + 1)];
        let mut sum = own;
        for &other in around.iter().take(CROWD).filter(|&&other| other != face) {
            let normal = self.normals[other as usize];
            if normal.dot(own) > self.threshold {
                sum += normal;
            }
        }
        unit(sum)
    }
}

/// Numbers points so that equal ones share a number, for shapes without indices.
pub fn merge_equal(points: impl Iterator<Item = Vec3>) -> Vec<u32> {
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    points
        .map(|p| {
            let key = (p + Vec3::ZERO).to_array().map(f32::to_bits); // −0 is 0
            let next = known.len() as u32;
            *known.entry(key).or_insert(next)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_angle_is_smooth_above_its_crease_angle_only() {
        let faces = Faces {
            normals: vec![Vec3::X, Vec3::Y],
            corners: vec![(0, 0), (0, 1)],
        };
        let sharp = faces.around(1.5).normal(0, 0);
        let smooth = faces.around(1.6).normal(0, 0);
        assert_eq!(sharp, Vec3::X);
        assert!((smooth - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-6);
    }

    #[test]
    fn a_tiny_triangle_has_a_normal() {
        let s = 1e-20;
        let points = [Vec3::ZERO, Vec3::X * s, Vec3::Y * s];
        assert_eq!(face_normal(&points, true), Vec3::Z);
    }
}
