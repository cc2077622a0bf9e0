//! The directions of the sides of all pupil polygons, and the corners between them.
//!
//! The sides of all polygons have the same directions. So the corners of a mixture of two polygons
//! are the mixtures of their corners.

use std::f64::consts::TAU;

use glam::DVec2;

/// The number of sides of every pupil polygon.
pub(crate) const SIDES: usize = 32;

/// The support function of a convex figure in [`SIDES`] directions: the distance of its supporting
/// line from the axis, in millimeters. A mixture of two supports is the support of their Minkowski
/// mixture, which is convex too, so pupils interpolate well in this form.
pub(crate) type Support = [f64; SIDES];

/// The outward normals of the sides, counterclockwise. The first is +x.
pub(super) fn directions() -> [DVec2; SIDES] {
    std::array::from_fn(|j| {
        let (sin, cos) = libm::sincos(TAU * j as f64 / SIDES as f64);
        DVec2::new(cos, sin)
    })
}

/// The normals of the sides, with the nearest one rotated onto the normal of each edge of an iris.
/// Opposite sides stay parallel.
pub(super) fn directions_along(edges: &[DVec2]) -> [DVec2; SIDES] {
    const HALF: usize = SIDES / 2;
    let mut sides = directions();
    for edge in edges {
        let normal = edge.normalize();
        let angle = libm::atan2(normal.y, normal.x) / TAU * SIDES as f64;
        let slot = (angle.round() as isize).rem_euclid(HALF as isize) as usize;
        let normal = normal * normal.dot(sides[slot]).signum();
        let [before, after] = [slot + SIDES - 1, slot + 1].map(|j| sides[j % SIDES]);
        // The corner between two nearly parallel sides is ill-conditioned. Neighboring normals are
        // 11° apart; one that would come within 1° of another is not rotated.
        if before.perp_dot(normal) > 0.02 && normal.perp_dot(after) > 0.02 {
            (sides[slot], sides[slot + HALF]) = (normal, -normal);
        }
    }
    sides
}

/// The corners of a polygon, which is divided into triangles around a point inside.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    pub(super) center: DVec2,
    /// The corners, counterclockwise. The first is repeated at the end.
    pub(super) corners: [DVec2; SIDES + 1],
}

impl Outline {
    /// The polygon of a support, whose sides have the normals `sides`.
    pub fn of(support: &Support, sides: &[DVec2; SIDES]) -> Self {
        let mut corners = [DVec2::ZERO; SIDES + 1];
        let mut center = DVec2::ZERO;
        for j in 0..SIDES {
            // Where side j meets side j + 1.
            let (side, next) = (sides[j], sides[(j + 1) % SIDES]);
            let (sin, cos) = (side.perp_dot(next), side.dot(next));
            let along = (support[(j + 1) % SIDES] - support[j] * cos) / sin;
            corners[j] = support[j] * side + along * side.perp();
            center += corners[j];
        }
        corners[SIDES] = corners[0];
        center /= SIDES as f64;
        Self { center, corners }
    }

    /// The mean of the corners.
    pub(super) fn center(&self) -> DVec2 {
        self.center
    }

    /// A corner relative to the mean of all.
    pub(super) fn corner_offset(&self, j: usize) -> DVec2 {
        self.corners[j] - self.center
    }

    /// Interpolates linearly between two polygons.
    pub(super) fn mix(&self, other: &Self, t: f64) -> Self {
        Self {
            center: self.center.lerp(other.center, t),
            corners: std::array::from_fn(|j| self.corners[j].lerp(other.corners[j], t)),
        }
    }
}

/// The number of entries in a [`TriangleTable`].
const STARTS: usize = 1024;

/// A table from a share of the area to a triangle, for areas averaged over a span. The search for a
/// triangle starts there, and nearly always ends there.
#[derive(Clone, Debug)]
pub(super) struct TriangleTable {
    /// The triangle that contains the middle of each of [`STARTS`] equal parts of the area.
    starts: [u8; STARTS],
}

impl TriangleTable {
    /// Makes the table from the mean area before each corner, which `area` returns.
    pub(super) fn new(area: impl Fn(usize) -> f64) -> Self {
        let all = area(SIDES).max(f64::MIN_POSITIVE);
        let before: [f64; SIDES + 1] = std::array::from_fn(|j| area(j) / all);
        let mut starts = [0; STARTS];
        let mut j = 0;
        for (i, start) in starts.iter_mut().enumerate() {
            let share = (i as f64 + 0.5) / STARTS as f64;
            while j < SIDES - 1 && before[j + 1] <= share {
                j += 1;
            }
            *start = j as u8;
        }
        Self { starts }
    }

    /// The triangle in which a share of the area ends, or a neighbor of it.
    #[inline(always)]
    pub(super) fn lookup(&self, share: f64) -> usize {
        usize::from(self.starts[(share * STARTS as f64) as usize & (STARTS - 1)])
    }
}

/// The position of a place between two others, 0 to 1; the middle for a triangle of no area.
#[inline(always)]
pub(super) fn share(place: f64, before: f64, behind: f64) -> f64 {
    if behind > before {
        ((place - before) / (behind - before)).clamp(0.0, 1.0)
    } else {
        0.5
    }
}
