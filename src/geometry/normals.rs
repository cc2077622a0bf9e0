//! Normals by crease angle for shapes without normals, as Coin computes them.
//!
//! A corner's normal is the sum of its own face's unit normal and of those of the other faces at
//! the vertex that are within the crease angle of it. A large face therefore counts no more than a
//! small one.

use std::collections::HashMap;

use glam::Vec3;

/// Returns the unit normal of a polygon: of a triangle from its edges, of others by Newell's
/// method.
pub(crate) fn face_normal(points: &[Vec3], counterclockwise: bool) -> Vec3 {
    let normal = match points {
        [a, b, c] => (*c - *b).cross(*a - *b),
        _ => newell(points),
    };
    let normal = unit(normal);
    if counterclockwise { normal } else { -normal }
}

/// Returns the normal of a polygon by Newell's method; its length is twice the area.
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

/// Returns a vector of length 1, or zero where there is no direction. The length is computed in
/// f64, so that the normals of small faces do not underflow.
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
    pub normals: Vec<Vec3>,
    /// The vertex and the face of each corner.
    pub corners: Vec<(u32, u32)>,
}

/// At most this many faces are summed for a corner, because the time at a vertex grows with the
/// square of their number. No smooth surface has as many; it is the tip of a fan of thousands of
/// triangles.
const MAX_FACES: usize = 4096;

impl Faces {
    /// Lists the faces around each vertex.
    pub(crate) fn around(&self, crease_angle: f32) -> Around<'_> {
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

/// The faces around each vertex.
pub(crate) struct Around<'f> {
    normals: &'f [Vec3],
    /// Where the faces of each vertex begin in `at_vertex`.
    starts: Vec<u32>,
    at_vertex: Vec<u32>,
    /// The cosine of the crease angle.
    threshold: f32,
}

impl Around<'_> {
    /// Returns the normal of a face's corner at a vertex.
    pub(crate) fn normal(&self, vertex: u32, face: u32) -> Vec3 {
        let own = self.normals[face as usize];
        let start = |v: usize| {
            self.starts
                .get(v)
                .map_or(self.at_vertex.len(), |&s| s as usize)
        };
        let around = &self.at_vertex[start(vertex as usize)..start(vertex as usize + 1)];
        let mut sum = own;
        for &other in around
            .iter()
            .take(MAX_FACES)
            .filter(|&&other| other != face)
        {
            let normal = self.normals[other as usize];
            if normal.dot(own) > self.threshold {
                sum += normal;
            }
        }
        unit(sum)
    }
}

/// Numbers points so that equal points have equal numbers, for shapes without indices.
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

/// Returns the normals of the quadrilaterals between rows of `columns` points. The normal is that
/// of the plane at the first corner, not the mean over the four (Coin).
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

/// Returns the normals of a grid's vertices: the unit mean of the normals of the quadrilaterals
/// around each. A grid is smooth everywhere, whatever the crease angle (Coin).
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
