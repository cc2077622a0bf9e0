//! Polygons in space.

use glam::DVec3;

/// The normal of a polygon whose corners run counterclockwise, by Newell's method. Its length is
/// twice the area; it is zero for fewer than three corners.
pub fn polygon_normal(corners: impl IntoIterator<Item = DVec3>) -> DVec3 {
    let mut corners = corners.into_iter();
    let Some(first) = corners.next() else {
        return DVec3::ZERO;
    };
    let edges = corners.map(|corner| corner - first);
    let (sum, _) = edges.fold((DVec3::ZERO, DVec3::ZERO), |(sum, last), edge| {
        (sum + last.cross(edge), edge)
    });
    sum
}
