//! Computes normals for shapes without them by the crease angle, as Coin does.
//!
//! A corner's normal is the sum of the unit normal of its own face and of those other faces at the
//! vertex whose normals are within the crease angle of it. All faces have the same weight, whatever
//! their size.

use std::collections::HashMap;

use glam::Vec3;

/// Returns the unit normal of a polygon, from the edges of a triangle and by Newell's method for
/// other polygons.
pub(crate) fn face_normal(points: &[Vec3], counterclockwise: bool) -> Vec3 {
    let normal = match points {
        [a, b, c] => (*c - *b).cross(*a - *b),
        _ => newell(points),
    };
    let normal = unit(normal);
    if counterclockwise { normal } else { -normal }
}

/// Returns the normal of a polygon by Newell's method. Its length is twice the area.
pub(crate) fn newell(points: &[Vec3]) -> Vec3 {
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

/// Normalizes a vector; a zero or infinite vector becomes zero. The length is computed in f64, so
/// that the normals of small faces do not underflow.
pub(crate) fn unit(v: Vec3) -> Vec3 {
    let wide = v.as_dvec3();
    let length = wide.length();
    if length > 0.0 && length.is_finite() {
        (wide / length).as_vec3()
    } else {
        Vec3::ZERO
    }
}

/// Faces that share vertices.
#[derive(Default)]
pub(crate) struct Faces {
    /// The unit normals of the faces.
    pub normals: Vec<Vec3>,
    /// The vertex and the face of each corner.
    pub corners: Vec<(u32, u32)>,
}

/// The largest number of faces that are summed for a corner. It bounds the time at a vertex, which
/// grows with the square of their number. Only the tip of a fan of thousands of triangles has more.
const MAX_FACES: usize = 4096;

impl Faces {
    /// Lists the faces around each vertex.
    pub(crate) fn around(&self, crease_angle: f32) -> CornerFan<'_> {
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
        CornerFan {
            normals: &self.normals,
            starts,
            at_vertex,
            threshold: libm::cosf(crease_angle.clamp(0.0, std::f32::consts::PI)),
        }
    }
}

/// The faces around each vertex.
pub(crate) struct CornerFan<'f> {
    normals: &'f [Vec3],
    /// The index in `at_vertex` of the first face of each vertex.
    starts: Vec<u32>,
    /// The faces, vertex by vertex.
    at_vertex: Vec<u32>,
    /// The cosine of the crease angle.
    threshold: f32,
}

impl CornerFan<'_> {
    /// Returns the normal of a face's corner at a vertex. A face counts once, however many of its
    /// triangles meet there; its corners follow each other.
    pub(crate) fn normal(&self, vertex: u32, face: u32) -> Vec3 {
        let own = self.normals[face as usize];
        let start = |v: usize| {
            self.starts
                .get(v)
                .map_or(self.at_vertex.len(), |&s| s as usize)
        };
        let around = &self.at_vertex[start(vertex as usize)..start(vertex as usize + 1)];
        let mut sum = own;
        let mut last = face;
        for &other in around.iter().take(MAX_FACES) {
            let is_new = other != face && other != last;
            last = other;
            let normal = self.normals[other as usize];
            if is_new && normal.dot(own) > self.threshold {
                sum += normal;
            }
        }
        unit(sum)
    }
}

/// Assigns vertex numbers to points, with the same number for equal points.
pub(crate) fn merge_equal(points: impl Iterator<Item = Vec3>) -> Vec<u32> {
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    points
        .map(|p| {
            let key = (p + Vec3::ZERO).to_array().map(f32::to_bits); // −0 becomes 0
            let next = known.len() as u32;
            *known.entry(key).or_insert(next)
        })
        .collect()
}

/// Returns the normals of the quadrilaterals between rows of `columns` points. Each is the normal
/// at the first corner, not the mean over the four (Coin).
pub(crate) fn grid_face_normals(
    points: &[Vec3],
    columns: usize,
    counterclockwise: bool,
) -> Vec<Vec3> {
    let rows: Vec<&[Vec3]> = points.chunks_exact(columns).collect();
    let mut out = Vec::with_capacity(rows.len().saturating_sub(1) * (columns - 1));
    for pair in rows.windows(2) {
        for (corners, &below) in pair[0].windows(2).zip(pair[1]) {
            let normal = unit((below - corners[0]).cross(corners[1] - corners[0]));
            out.push(if counterclockwise { normal } else { -normal });
        }
    }
    out
}

/// Returns the normals of a grid's vertices. Each is the mean of the normals of the quadrilaterals
/// at the vertex, with length 1. A grid is smooth whatever the crease angle (Coin).
pub(crate) fn grid_vertex_normals(faces: &[Vec3], rows: usize, columns: usize) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(rows * columns);
    for r in 0..rows {
        for c in 0..columns {
            let mut sum = Vec3::ZERO;
            for (dr, dc) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                if r >= dr && c >= dc && r - dr < rows - 1 && c - dc < columns - 1 {
                    sum += faces[(r - dr) * (columns - 1) + c - dc];
                }
            }
            out.push(unit(sum));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_angle_is_smooth_only_for_a_larger_crease_angle() {
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
