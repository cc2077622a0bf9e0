//! Interpolation between two polygons.
//!
//! Every area in a mixture of two polygons is a quadratic of the mixing parameter, whose
//! coefficients are computed once. An aim from a film point between two measured ones then costs
//! one search among the triangles.

use glam::DVec2;

use crate::lens::pupil::sides::{Outline, SIDES, TriangleTable, share};

/// The interpolated pupils of all film points between two from which the pupil was measured.
#[derive(Clone, Debug)]
pub struct Span {
    low: Outline,
    high: Outline,
    corners: [Corner; SIDES + 1],
    triangles: TriangleTable,
}

/// A corner as a function of the mixing parameter. It fills a line of the processor's cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Corner {
    /// The vector from the center to the corner, and how it changes.
    offset: [DVec2; 2],
    /// Twice the area of the triangles before the corner, as the coefficients of a quadratic.
    before: [f64; 3],
}

impl Corner {
    /// The vector from the center at the mixing parameter `t`.
    #[inline(always)]
    fn offset(&self, t: f64) -> DVec2 {
        let [start, change] = self.offset;
        start + t * change
    }
}

impl Span {
    /// The span between two polygons, at the mixing parameters 0 and 1.
    pub fn new(low: Outline, high: Outline) -> Self {
        let mut corners: [Corner; SIDES + 1] = std::array::from_fn(|j| {
            let start = low.corner_offset(j);
            Corner {
                offset: [start, high.corner_offset(j) - start],
                before: [0.0; 3],
            }
        });
        for j in 0..SIDES {
            let ([p, dp], [q, dq]) = (corners[j].offset, corners[j + 1].offset);
            let twice = [
                p.perp_dot(q),
                p.perp_dot(dq) + dp.perp_dot(q),
                dp.perp_dot(dq),
            ];
            corners[j + 1].before = std::array::from_fn(|i| corners[j].before[i] + twice[i]);
        }
        let triangles = TriangleTable::new(|j| {
            let [a, b, c] = corners[j].before;
            a + b / 2.0 + c / 3.0
        });
        Self {
            low,
            high,
            corners,
            triangles,
        }
    }

    /// Twice the area of the triangles before a corner, at the mixing parameter `t`, in square
    /// millimeters.
    #[inline(always)]
    fn twice_area_before(&self, j: usize, t: f64) -> f64 {
        let [a, b, c] = self.corners[j].before;
        a + t * (b + t * c)
    }

    /// The polygon at the mixing parameter `t`.
    pub(super) fn outline(&self, t: f64) -> Outline {
        self.low.mix(&self.high, t)
    }

    /// The area of the polygon at the mixing parameter `t`, in square millimeters.
    #[inline(always)]
    pub fn area(&self, t: f64) -> f64 {
        0.5 * self.twice_area_before(SIDES, t)
    }

    /// The point at the share `u` of the area, counted around the center, and at the share `out` of
    /// the distance from the center to the rim, in the polygon at the mixing parameter `t`.
    #[inline(always)]
    pub fn point(&self, t: f64, u: f64, out: f64) -> DVec2 {
        let place = u * self.twice_area_before(SIDES, t);
        let mut j = self.triangles.lookup(u);
        let before = |j: usize| self.twice_area_before(j, t);
        let (mut start, mut end) = (before(j), before(j + 1));
        // The tabulated triangle nearly always contains the point.
        if !(start <= place && place < end) {
            j = self.search(j, t, place);
            (start, end) = (before(j), before(j + 1));
        }
        let [p, q] = [j, j + 1].map(|j| self.corners[j].offset(t));
        let center = self.low.center + t * (self.high.center - self.low.center);
        center + out * (p + share(place, start, end) * (q - p))
    }

    /// Searches for the triangle that contains a place, starting from a neighbor.
    #[cold]
    #[inline(never)]
    fn search(&self, from: usize, t: f64, place: f64) -> usize {
        let mut j = from;
        while j > 0 && self.twice_area_before(j, t) > place {
            j -= 1;
        }
        while j < SIDES - 1 && self.twice_area_before(j + 1, t) <= place {
            j += 1;
        }
        j
    }
}
