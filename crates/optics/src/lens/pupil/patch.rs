//! The interpolated pupils of a quarter of a cell, prepared for aiming.
//!
//! The corners of the polygons are bilinear in the place of the film point, because the sides of
//! all polygons have the same directions. Areas are then biquadratic. Their coefficients are
//! computed once, and an aim from any film point of the quarter costs one search among triangles.

use std::ops::Range;

use glam::DVec2;
use ivcam_base::math::lanes::{LANES, Lane, fused};

use crate::lens::pupil::sides::{Outline, SIDES, Support, TriangleTable, share};
use crate::lens::pupil::symmetry::WedgeCopy;

/// The coefficients of 1, u, v and uv.
type Bilinear = [DVec2; 4];

/// The coefficients of uⁱvʲ, at the index 3j + i.
pub(super) type Biquadratic = [f64; 9];

/// The polygons at which rays are aimed from the film points of a rectangle of places.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// The least place.
    low: [f64; 2],
    /// The least place beyond the rectangle.
    high: [f64; 2],
    /// The reciprocals of the sides.
    inverse: [f64; 2],
    /// The corners of the polygon, relative to its middle. The first is repeated at the end.
    corners: [Bilinear; SIDES + 1],
    /// The middle of the polygon, relative to the center of the figure.
    middle: Bilinear,
    /// The center of the figure, relative to the direction of the film point.
    center: Bilinear,
    /// Twice the area of the triangles before each corner.
    before: [Biquadratic; SIDES + 1],
    triangles: TriangleTable,
    /// The open share of the area for each lens of the table; empty if it is not known.
    open_shares: Vec<Biquadratic>,
}

/// The position in a patch, 0 to 1 from its least place to its greatest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Position {
    pub u: f64,
    pub v: f64,
}

impl Position {
    /// Evaluates a biquadratic.
    #[inline(always)]
    pub(super) fn quadratic<const FUSED: bool>(self, all: &Biquadratic) -> f64 {
        let [a, b, c, d, e, f, g, h, i] = *all;
        let row = |a, b, c| fused::<FUSED>(self.u, fused::<FUSED>(self.u, c, b), a);
        let (low, middle, high) = (row(a, b, c), row(d, e, f), row(g, h, i));
        fused::<FUSED>(self.v, fused::<FUSED>(self.v, high, middle), low)
    }

    /// Evaluates a bilinear function.
    #[inline(always)]
    fn bilinear<const FUSED: bool>(self, [a, b, c, d]: &Bilinear) -> DVec2 {
        let of = |a: f64, b: f64, c: f64, d: f64| {
            let (low, high) = (fused::<FUSED>(self.u, b, a), fused::<FUSED>(self.u, d, c));
            fused::<FUSED>(self.v, high, low)
        };
        DVec2::new(of(a.x, b.x, c.x, d.x), of(a.y, b.y, c.y, d.y))
    }
}

/// The coefficients of a bilinear function with the given values at (0, 0), (1, 0), (0, 1) and
/// (1, 1).
fn bilinear([a, b, c, d]: [DVec2; 4]) -> Bilinear {
    [a, b - a, c - a, d - c - b + a]
}

/// The coefficients of the cross product of two bilinear functions.
fn cross(p: &Bilinear, q: &Bilinear) -> Biquadratic {
    let mut all = [0.0; 9];
    for (k, p) in p.iter().enumerate() {
        for (l, q) in q.iter().enumerate() {
            all[3 * (k / 2 + l / 2) + k % 2 + l % 2] += p.perp_dot(*q);
        }
    }
    all
}

/// The coefficients of the quadratic through its values at 0, 1/2 and 1, constant first.
pub(super) fn quadratic_through([low, middle, high]: [f64; 3]) -> [f64; 3] {
    let bend = 2.0 * (low + high) - 4.0 * middle;
    [low, high - low - bend, bend]
}

/// The coefficients of the biquadratic through its values at the positions 0, 1/2 and 1 of u and v,
/// in the order of the coefficients.
pub(super) fn biquadratic_through(values: Biquadratic) -> Biquadratic {
    let rows = [0, 3, 6].map(|k| quadratic_through([0, 1, 2].map(|i| values[k + i])));
    let columns = [0, 1, 2].map(|i| quadratic_through(rows.map(|row| row[i])));
    std::array::from_fn(|k| columns[k % 3][k / 3])
}

impl Patch {
    /// The patch between `low` and `high` whose figures have the given centers and supports, at
    /// (0, 0), (1, 0), (0, 1) and (1, 1), and sides with the normals `sides`. The open share is not
    /// known yet.
    pub(super) fn new(
        low: [f64; 2],
        size: [f64; 2],
        figures: [(DVec2, &Support); 4],
        sides: &[DVec2; SIDES],
    ) -> Self {
        let outlines = figures.map(|(_, support)| Outline::of(support, sides));
        let corner = |j: usize| bilinear(outlines.each_ref().map(|o| o.corner_offset(j)));
        let corners: [Bilinear; SIDES + 1] = std::array::from_fn(corner);
        let mut before = [[0.0; 9]; SIDES + 1];
        for j in 0..SIDES {
            let twice = cross(&corners[j], &corners[j + 1]);
            before[j + 1] = std::array::from_fn(|k| before[j][k] + twice[k]);
        }
        let mean = |j: usize| {
            let terms = before[j].iter().enumerate();
            terms
                .map(|(k, c)| c / ((k % 3 + 1) * (k / 3 + 1)) as f64)
                .sum()
        };
        let end = |k: usize| match low[k] + size[k] {
            // The greatest place is 1, and belongs to the last patch.
            high if high >= 1.0 => f64::INFINITY,
            high => high,
        };
        Self {
            low,
            high: [0, 1].map(end),
            inverse: size.map(f64::recip),
            triangles: TriangleTable::new(mean),
            corners,
            middle: bilinear(outlines.each_ref().map(Outline::center)),
            center: bilinear(figures.map(|(center, _)| center)),
            before,
            open_shares: Vec::new(),
        }
    }

    /// The patch with the open shares of the table's lenses; empty if they are not known.
    pub(super) fn with_open_shares(self, open_shares: Vec<Biquadratic>) -> Self {
        Self {
            open_shares,
            ..self
        }
    }

    /// The open shares of the area at the positions of some lanes, with the given weights of the
    /// lenses; 0 if one is not known.
    #[inline(always)]
    pub(super) fn open_shares<const FUSED: bool>(
        &self,
        at: &[Lane; 2],
        lanes: Range<usize>,
        weights: &[f64],
        shares: &mut Lane,
    ) {
        shares[lanes.clone()].fill(0.0);
        let mut is_known = [true; LANES];
        for (share, weight) in self.open_shares.iter().zip(weights) {
            for i in lanes.clone() {
                let at = Position {
                    u: at[0][i],
                    v: at[1][i],
                };
                let share = at.quadratic::<FUSED>(share);
                shares[i] = fused::<FUSED>(*weight, share, shares[i]);
                is_known[i] &= share > 0.0;
            }
        }
        for i in lanes {
            shares[i] = if is_known[i] { shares[i] } else { 0.0 };
        }
    }

    /// Whether a place is in the patch.
    #[inline(always)]
    pub(super) fn contains(&self, place: [f64; 2]) -> bool {
        let inside = |k: usize| (place[k] >= self.low[k]) & (place[k] < self.high[k]);
        inside(0) & inside(1)
    }

    /// The position of a place.
    #[inline(always)]
    pub(super) fn position(&self, place: [f64; 2]) -> Position {
        let [u, v] = [0, 1].map(|k| (place[k] - self.low[k]) * self.inverse[k]);
        Position { u, v }
    }

    /// The area of the polygon, in square millimeters.
    #[inline(always)]
    pub(super) fn area<const FUSED: bool>(&self, at: Position) -> f64 {
        0.5 * at.quadratic::<FUSED>(&self.before[SIDES])
    }

    /// The polygon from a film point in a direction.
    pub(super) fn outline(&self, at: Position, direction: DVec2) -> Outline {
        let center = self.middle::<false>(at, direction);
        Outline {
            center,
            corners: self
                .corners
                .each_ref()
                .map(|c| center + at.bilinear::<false>(c)),
        }
    }

    /// The middle of the polygon from a film point in a direction.
    #[inline(always)]
    pub(super) fn middle<const FUSED: bool>(&self, at: Position, direction: DVec2) -> DVec2 {
        let center = direction.rotate(at.bilinear::<FUSED>(&self.center));
        center + at.bilinear::<FUSED>(&self.middle)
    }

    /// The point of the rim, relative to the middle, at the share `around` of the area, counted
    /// around the middle. `area` is [`Self::area`].
    #[inline(always)]
    pub(super) fn rim<const FUSED: bool>(&self, at: Position, area: f64, around: f64) -> DVec2 {
        let before = |j: usize| at.quadratic::<FUSED>(&self.before[j]);
        let place = 2.0 * around * area;
        let mut j = self.triangles.lookup(around);
        let (mut from, mut to) = (before(j), before(j + 1));
        // The tabulated triangle nearly always contains the point.
        while j > 0 && place < from {
            j -= 1;
            (from, to) = (before(j), from);
        }
        while j < SIDES - 1 && place >= to {
            j += 1;
            (from, to) = (to, before(j + 1));
        }
        let [p, q] = [j, j + 1].map(|j| at.bilinear::<FUSED>(&self.corners[j]));
        p + share(place, from, to) * (q - p)
    }

    /// The point at the share `around` of the area, counted around the middle, and at the share
    /// `out` of the distance from the middle to the rim. `direction` is that of the film point.
    pub(super) fn point(&self, at: Position, direction: DVec2, around: f64, out: f64) -> DVec2 {
        let area = self.area::<false>(at);
        self.middle::<false>(at, direction) + out * self.rim::<false>(at, area, around)
    }
}

/// A film point in a table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Located<'a> {
    pub patch: &'a Patch,
    pub at: Position,
    /// The direction of the film point in the first wedge.
    pub direction: DVec2,
    pub copy: WedgeCopy,
}
