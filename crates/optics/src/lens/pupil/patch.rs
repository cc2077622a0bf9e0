//! The interpolated pupil polygons of one region of the film, prepared for aiming.
//!
//! A region is an interval of film radii, with one coordinate, or a rectangle in polar coordinates,
//! with two. The sides of all polygons have the same normals, so their corners are linear in each
//! coordinate of the film point, and areas are quadratic in each. Their coefficients are computed
//! once, and an aim from any film point of the region costs one search among triangles.

use std::ops::Range;

use glam::DVec2;
use ivcam_base::math::lanes::{LANES, Lane, fused};

use crate::lens::pupil::support::{PolygonCorners, SIDES};
use crate::lens::pupil::symmetry::WedgeCopy;

/// A patch over an interval of film radii. The second coordinate is not used.
pub(super) type RadialPatch = PupilPatch<2, 3>;

/// A patch over a rectangle in polar coordinates.
pub(super) type PolarPatch = PupilPatch<4, 9>;

/// The polygons at which rays are aimed from the film points of one region.
///
/// A function that is linear in each coordinate has `L` coefficients: those of 1 and u, or of 1, u,
/// v and uv. One that is quadratic in each has `Q`: those of uⁱ, or of uⁱvʲ at the index 3j + i.
#[derive(Clone, Debug)]
pub(super) struct PupilPatch<const L: usize, const Q: usize> {
    /// The number of the patch in its table.
    pub number: usize,
    /// The least film coordinates.
    low: [f64; 2],
    /// The least film coordinates beyond the region.
    high: [f64; 2],
    /// The reciprocals of the region's sides; 0 for a side of length 0.
    inverse: [f64; 2],
    /// The center of the outline, relative to the direction of the film point.
    center: [DVec2; L],
    /// The center of the polygon, relative to that of the outline.
    middle: [DVec2; L],
    /// The corners of the polygon. The first is repeated at the end.
    corners: [PolygonCorner<L, Q>; SIDES + 1],
    /// The triangle that contains the middle of each of [`STARTS`] equal parts of the mean area.
    /// The search for a triangle starts there, and nearly always ends there.
    starts: [u8; STARTS],
    /// The unvignetted fraction of the area for each lens of the table; empty if it is not known,
    /// or not stored here.
    pub unvignetted: Vec<[f64; Q]>,
}

/// The number of equal parts of the area in the table that finds a triangle.
const STARTS: usize = 1024;

/// A corner as a function of the coordinates. With one coordinate it fills a line of the
/// processor's cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct PolygonCorner<const L: usize, const Q: usize> {
    /// The corner relative to the center of the polygon.
    offset: [DVec2; L],
    /// Twice the area of the triangles before the corner.
    before: [f64; Q],
}

/// Evaluates a function that is linear in each coordinate.
#[inline(always)]
fn linear<const FUSED: bool, const L: usize>(all: &[DVec2; L], [u, v]: [f64; 2]) -> DVec2 {
    if L == 2 {
        return all[0] + u * all[1];
    }
    let axis = |k: usize| {
        let low = fused::<FUSED>(u, all[1][k], all[0][k]);
        let high = fused::<FUSED>(u, all[3][k], all[2][k]);
        fused::<FUSED>(v, high, low)
    };
    DVec2::new(axis(0), axis(1))
}

/// Evaluates a function that is quadratic in each coordinate.
#[inline(always)]
fn quadratic<const FUSED: bool, const Q: usize>(all: &[f64; Q], [u, v]: [f64; 2]) -> f64 {
    if Q == 3 {
        return all[0] + u * (all[1] + u * all[2]);
    }
    let row = |k: usize| {
        let rest = fused::<FUSED>(u, all[k + 2], all[k + 1]);
        fused::<FUSED>(u, rest, all[k])
    };
    let (low, middle, high) = (row(0), row(3), row(6));
    fused::<FUSED>(v, fused::<FUSED>(v, high, middle), low)
}

/// The coefficients of a function that is linear in each coordinate and has the given values at 0
/// and 1, or at (0, 0), (1, 0), (0, 1) and (1, 1).
fn linear_through<const L: usize>(values: [DVec2; L]) -> [DVec2; L] {
    std::array::from_fn(|k| match k {
        0 => values[0],
        3 => values[3] - values[2] - values[1] + values[0],
        _ => values[k] - values[0],
    })
}

/// The coefficients of the cross product of two functions that are linear in each coordinate.
fn cross<const L: usize, const Q: usize>(p: &[DVec2; L], q: &[DVec2; L]) -> [f64; Q] {
    let mut all = [0.0; Q];
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

/// The coefficients of the biquadratic through its values at the coordinates 0, 1/2 and 1, in the
/// order of the coefficients.
pub(super) fn biquadratic_through(values: [f64; 9]) -> [f64; 9] {
    let rows = [0, 3, 6].map(|k| quadratic_through([0, 1, 2].map(|i| values[k + i])));
    let columns = [0, 1, 2].map(|i| quadratic_through(rows.map(|row| row[i])));
    std::array::from_fn(|k| columns[k % 3][k / 3])
}

impl<const L: usize, const Q: usize> PupilPatch<L, Q> {
    /// The patch of a region from its least film coordinates to the least beyond it. At its
    /// corners the outlines have the given centers and, around those, the polygons. The
    /// unvignetted fraction is not known yet.
    pub(super) fn new(
        number: usize,
        (low, high): ([f64; 2], [f64; 2]),
        inverse: [f64; 2],
        centers: [DVec2; L],
        polygons: [&PolygonCorners; L],
    ) -> Self {
        let mut corners: [PolygonCorner<L, Q>; SIDES + 1] =
            std::array::from_fn(|j| PolygonCorner {
                offset: linear_through(polygons.map(|polygon| polygon.offset(j))),
                before: [0.0; Q],
            });
        for j in 0..SIDES {
            let twice: [f64; Q] = cross(&corners[j].offset, &corners[j + 1].offset);
            corners[j + 1].before = std::array::from_fn(|k| corners[j].before[k] + twice[k]);
        }
        Self {
            number,
            low,
            high,
            inverse,
            center: linear_through(centers),
            middle: linear_through(polygons.map(|polygon| polygon.center)),
            starts: starts(&corners),
            corners,
            unvignetted: Vec::new(),
        }
    }

    /// Whether film coordinates are in the region.
    #[inline(always)]
    pub(super) fn contains(&self, film: [f64; 2]) -> bool {
        let inside = |k: usize| (film[k] >= self.low[k]) & (film[k] < self.high[k]);
        inside(0) & inside(1)
    }

    /// The coordinates in the patch, 0 to 1, of film coordinates.
    #[inline(always)]
    pub(super) fn coordinates(&self, film: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| (film[k] - self.low[k]) * self.inverse[k])
    }

    /// The area of the polygon, in square millimeters.
    #[inline(always)]
    pub(super) fn area<const FUSED: bool>(&self, at: [f64; 2]) -> f64 {
        0.5 * quadratic::<FUSED, Q>(&self.corners[SIDES].before, at)
    }

    /// The center of the polygon from a film point in a direction.
    #[inline(always)]
    pub(super) fn center<const FUSED: bool>(&self, at: [f64; 2], direction: DVec2) -> DVec2 {
        let center = direction.rotate(linear::<FUSED, L>(&self.center, at));
        center + linear::<FUSED, L>(&self.middle, at)
    }

    /// The point of the rim, relative to the center, at the fraction `around` of the area, counted
    /// around the center. `area` is [`Self::area`].
    #[inline(always)]
    pub(super) fn rim<const FUSED: bool>(&self, at: [f64; 2], area: f64, around: f64) -> DVec2 {
        let before = |j: usize| quadratic::<FUSED, Q>(&self.corners[j].before, at);
        let before_rim = 2.0 * around * area;
        let mut j = usize::from(self.starts[(around * STARTS as f64) as usize & (STARTS - 1)]);
        let (mut from, mut to) = (before(j), before(j + 1));
        // The tabulated triangle nearly always contains the point.
        while j > 0 && before_rim < from {
            j -= 1;
            (from, to) = (before(j), from);
        }
        while j < SIDES - 1 && before_rim >= to {
            j += 1;
            (from, to) = (to, before(j + 1));
        }
        let [p, q] = [j, j + 1].map(|j| linear::<FUSED, L>(&self.corners[j].offset, at));
        // A triangle of no area is entered in its middle.
        let part = match to > from {
            true => ((before_rim - from) / (to - from)).clamp(0.0, 1.0),
            false => 0.5,
        };
        p + part * (q - p)
    }

    /// The corners of the polygon from a film point in a direction.
    pub(super) fn polygon(&self, at: [f64; 2], direction: DVec2) -> PolygonCorners {
        let center = self.center::<false>(at, direction);
        let corner = |c: &PolygonCorner<L, Q>| center + linear::<false, L>(&c.offset, at);
        PolygonCorners {
            center,
            all: self.corners.each_ref().map(corner),
        }
    }
}

/// The triangle that contains the middle of each of [`STARTS`] equal parts of the area, averaged
/// over a patch.
fn starts<const L: usize, const Q: usize>(
    corners: &[PolygonCorner<L, Q>; SIDES + 1],
) -> [u8; STARTS] {
    let mean = |j: usize| -> f64 {
        let terms = corners[j].before.iter().enumerate();
        terms
            .map(|(k, c)| c / ((k % 3 + 1) * (k / 3 + 1)) as f64)
            .sum()
    };
    let all = mean(SIDES).max(f64::MIN_POSITIVE);
    let before: [f64; SIDES + 1] = std::array::from_fn(|j| mean(j) / all);
    let mut j = 0;
    std::array::from_fn(|i| {
        let fraction = (i as f64 + 0.5) / STARTS as f64;
        while j < SIDES - 1 && before[j + 1] <= fraction {
            j += 1;
        }
        j as u8
    })
}

/// Evaluates the unvignetted fractions of an area at the coordinates of some lanes: their sum with
/// the given weights of the lenses, or 0 if one is not known.
#[inline(always)]
pub(super) fn unvignetted_at<const FUSED: bool, const Q: usize>(
    fractions: &[[f64; Q]],
    weights: &[f64],
    at: &[Lane; 2],
    lanes: Range<usize>,
    sums: &mut Lane,
) {
    sums[lanes.clone()].fill(0.0);
    let mut is_known = [true; LANES];
    for (fraction, weight) in fractions.iter().zip(weights) {
        for i in lanes.clone() {
            let fraction = quadratic::<FUSED, Q>(fraction, [at[0][i], at[1][i]]);
            sums[i] = fused::<FUSED>(*weight, fraction, sums[i]);
            is_known[i] &= fraction > 0.0;
        }
    }
    for i in lanes {
        sums[i] = if is_known[i] { sums[i] } else { 0.0 };
    }
}

/// A film point in a table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Located<'a, const L: usize, const Q: usize> {
    pub patch: &'a PupilPatch<L, Q>,
    /// The coordinates in the patch.
    pub at: [f64; 2],
    /// The direction of the film point in the first wedge.
    pub direction: DVec2,
    /// The rotation and reflection of the first wedge that contains the film point.
    pub copy: WedgeCopy,
}

impl<const L: usize, const Q: usize> Located<'_, L, Q> {
    /// The point at the fraction `around` of the area, counted around the center, and at the
    /// fraction `out` of the distance from the center to the rim. `area` is that of the polygon.
    pub(super) fn point(&self, area: f64, around: f64, out: f64) -> DVec2 {
        let center = self.patch.center::<false>(self.at, self.direction);
        center + out * self.patch.rim::<false>(self.at, area, around)
    }
}
