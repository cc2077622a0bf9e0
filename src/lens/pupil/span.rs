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
    /// Twice the area of the triangles before each corner, as a quadratic of the mixing parameter.
    before: [[f64; 3]; SIDES + 1],
    wedges: [Wedge; SIDES],
    triangles: TriangleTable,
}

/// The quantities that a point in one of the triangles depends on, as quadratics of the mixing
/// parameter: the vectors from the center to the two corners, the center, and twice the areas
/// before those corners. The coefficients of one power are adjacent, so that all are evaluated as
/// one vector.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Wedge([[f64; 8]; 3]);

impl Wedge {
    /// The quantities at the mixing parameter `t`.
    #[inline(always)]
    fn at(&self, t: f64) -> [f64; 8] {
        let Self([a, b, c]) = self;
        let mut all = [0.0; 8];
        for i in 0..8 {
            all[i] = a[i] + t * (b[i] + t * c[i]);
        }
        all
    }
}

impl Span {
    /// The span between two polygons, at the mixing parameters 0 and 1.
    pub fn new(low: Outline, high: Outline) -> Self {
        let mut before = [[0.0; 3]; SIDES + 1];
        let from_center = |j: usize| {
            let start = low.corners[j] - low.center;
            (start, high.corners[j] - high.center - start)
        };
        for j in 0..SIDES {
            let ((p, dp), (q, dq)) = (from_center(j), from_center(j + 1));
            let twice = [
                p.perp_dot(q),
                p.perp_dot(dq) + dp.perp_dot(q),
                dp.perp_dot(dq),
            ];
            before[j + 1] = std::array::from_fn(|i| before[j][i] + twice[i]);
        }
        let (center, moved) = (low.center, high.center - low.center);
        let wedges = std::array::from_fn(|j| {
            let ((p, dp), (q, dq)) = (from_center(j), from_center(j + 1));
            let (from, to) = (before[j], before[j + 1]);
            Wedge([
                [p.x, p.y, q.x, q.y, center.x, center.y, from[0], to[0]],
                [dp.x, dp.y, dq.x, dq.y, moved.x, moved.y, from[1], to[1]],
                [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, from[2], to[2]],
            ])
        });
        let triangles = TriangleTable::new(|j| {
            let [a, b, c] = before[j];
            a + b / 2.0 + c / 3.0
        });
        Self {
            low,
            high,
            before,
            wedges,
            triangles,
        }
    }

    /// Twice the area of the triangles before a corner, at the mixing parameter `t`, in square
    /// millimeters.
    #[inline(always)]
    pub fn twice_area_before(&self, j: usize, t: f64) -> f64 {
        let [a, b, c] = self.before[j];
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
        let guess = self.triangles.lookup(u);
        let mut wedge = self.wedges[guess].at(t);
        // The tabulated triangle nearly always contains the point.
        if !(wedge[6] <= place && place < wedge[7]) {
            wedge = self.wedges[self.search(guess, t, place)].at(t);
        }
        let [px, py, qx, qy, x, y, start, end] = wedge;
        let at = share(place, start, end);
        DVec2::new(
            x + out * (px + at * (qx - px)),
            y + out * (py + at * (qy - py)),
        )
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
