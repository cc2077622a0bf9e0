//! Bezier patches of a surface, with bounds of their derivatives.

use glam::{DVec3, DVec4};

use super::basis::Basis;
use super::control::largest;

/// How much the second derivatives inside a small patch may exceed those at its corners.
const CORNER_MARGIN: f64 = 1.25;
/// The largest order for which the derivatives at the corners of small patches count.
const HIGHEST_BY_CORNERS: usize = 5;

/// A knot span that is not empty, with the matrix from the control points that act in it to the
/// control points of the same polynomial in Bezier form.
pub(super) struct BezierSpan {
    /// The smallest and the largest parameter.
    pub(super) ends: (f64, f64),
    /// The first control point that acts in the span.
    first: usize,
    order: usize,
    /// The matrix, row by row.
    matrix: Vec<f64>,
}

impl BezierSpan {
    /// The direction across a curve, in which it has one point.
    pub(super) fn across_curve() -> Self {
        Self {
            ends: (0.0, 1.0),
            first: 0,
            order: 1,
            matrix: vec![1.0],
        }
    }

    /// Returns all spans of a basis.
    pub(super) fn all(basis: &Basis) -> Vec<Self> {
        let (order, knots) = (basis.order, &basis.knots);
        let spans = (order - 1..basis.count).filter(|&s| knots[s + 1] > knots[s]);
        let span = |s: usize| {
            let near = &knots[s + 1 - order..];
            let ends = (knots[s], knots[s + 1]);
            let entry = |k: usize| blossom(near, ends, k / order, unit(order, k % order));
            Self {
                ends,
                first: s + 1 - order,
                order,
                matrix: (0..order * order).map(entry).collect(),
            }
        };
        spans.map(span).collect()
    }

    /// Returns a Bezier control point, of control points that act in the span.
    fn combine(&self, number: usize, point: impl Fn(usize) -> DVec4) -> DVec4 {
        let row = &self.matrix[number * self.order..][..self.order];
        row.iter().enumerate().map(|(j, &m)| m * point(j)).sum()
    }
}

fn unit(length: usize, one: usize) -> Vec<f64> {
    (0..length).map(|i| f64::from(i == one)).collect()
}

/// Evaluates the blossom of a polynomial with the given control points by de Boor's algorithm, at
/// `at_end` copies of the end of a span and otherwise at its start. `near` are the knots from the
/// first that acts in the span (Piegl and Tiller, The NURBS Book, section 5.2).
fn blossom(near: &[f64], ends: (f64, f64), at_end: usize, mut points: Vec<f64>) -> f64 {
    let degree = points.len() - 1;
    for r in 1..=degree {
        let t = if r <= at_end { ends.1 } else { ends.0 };
        for m in (r..=degree).rev() {
            let share = (t - near[m]) / (near[degree + 1 + m - r] - near[m]);
            points[m] = (1.0 - share) * points[m - 1] + share * points[m];
        }
    }
    points[degree]
}

/// A part of a surface as a Bezier patch with positive weights, or a part of a curve, with one row.
pub(super) struct BezierPatch {
    /// The control points, row by row. A row is along the first direction.
    points: Vec<DVec4>,
    columns: usize,
    rows: usize,
    /// The extents of the patch in both directions, in knot spans.
    spans: [f64; 2],
}

/// Bounds of a patch and of its derivatives. The parameters go from 0 to 1 in the patch.
pub(super) struct PatchBounds {
    /// The smallest and the largest corner of a box that contains the patch.
    pub(super) corners: (DVec3, DVec3),
    /// The largest length of the derivatives in the two directions.
    pub(super) first: [f64; 2],
    /// The largest length of the second derivative in the first direction.
    second: f64,
    /// The largest length of the mixed second derivative.
    mixed: f64,
    /// Whether the weights differ.
    is_rational: bool,
}

impl BezierPatch {
    /// Makes the patch of two spans.
    pub(super) fn new(
        along: &BezierSpan,
        across: &BezierSpan,
        point: &dyn Fn(usize, usize) -> DVec4,
    ) -> Self {
        let (columns, rows) = (along.order, across.order);
        let lines: Vec<DVec4> = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .map(|(i, j)| along.combine(i, |k| point(along.first + k, across.first + j)))
            .collect();
        let points = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .map(|(i, j)| across.combine(j, |k| lines[k * columns + i]))
            .collect();
        Self {
            points,
            columns,
            rows,
            spans: [1.0; 2],
        }
    }

    /// Returns the two halves along the first direction.
    pub(super) fn halves(&self) -> [Self; 2] {
        self.split(0, self.columns, 1, self.columns)
    }

    /// Returns the two halves across the first direction, or the part of a curve as it is.
    pub(super) fn halves_across(self) -> Vec<Self> {
        if self.rows == 1 {
            return vec![self];
        }
        self.split(1, self.rows, self.columns, 1).into()
    }

    /// Splits the patch in a direction in which it has `count` control points, with a step from
    /// each to the next. `next_line` is the step from a line of control points to the next line.
    fn split(&self, axis: usize, count: usize, step: usize, next_line: usize) -> [Self; 2] {
        let (mut low, mut high) = (self.points.clone(), self.points.clone());
        for line in 0..self.points.len() / count {
            let at = |i: usize| line * next_line + i * step;
            for k in 1..count {
                // After k rounds of de Casteljau's algorithm point k of the lower half is known;
                // the upper half is what remains.
                for i in 0..count - k {
                    high[at(i)] = 0.5 * (high[at(i)] + high[at(i + 1)]);
                }
                low[at(k)] = high[at(0)];
            }
        }
        let mut spans = self.spans;
        spans[axis] *= 0.5;
        [low, high].map(|points| Self {
            points,
            columns: self.columns,
            rows: self.rows,
            spans,
        })
    }

    /// Returns the bounds of the patch.
    ///
    /// For the homogeneous patch A with weight w, and S = A / w, the derivatives are
    /// S' = (A' − w' S) / w and S'' = (A'' − 2 w' S' − w'' S) / w. Each is bounded by the largest
    /// differences of control points, with the origin at the middle of the box.
    pub(super) fn bounds(&self) -> PatchBounds {
        let flat = self.points.iter().map(|p| p.truncate() / p.w);
        let (low, high) = flat
            .clone()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
                (low.min(p), high.max(p))
            });
        let middle = 0.5 * (low + high);
        let reach = largest(flat.map(|p| p.distance(middle)));
        let weight = self.points.iter().fold(f64::INFINITY, |w, p| w.min(p.w));
        let point = |i: usize, j: usize| self.points[j * self.columns + i];
        let (columns, rows) = (self.columns, self.rows);
        let (du, dv) = (columns as f64 - 1.0, rows as f64 - 1.0);
        let size =
            |columns: usize, rows: usize, factor: f64, of: &dyn Fn(usize, usize) -> DVec4| {
                let all = (0..rows).flat_map(|j| (0..columns).map(move |i| of(i, j)));
                all.fold([0.0_f64; 2], |[a, w], d| {
                    let length = (d.truncate() - d.w * middle).length();
                    [a.max(factor * length), w.max(factor * d.w.abs())]
                })
            };
        let [u, wu] = size(columns - 1, rows, du, &|i, j| point(i + 1, j) - point(i, j));
        let [v, wv] = size(columns, rows - 1, dv, &|i, j| point(i, j + 1) - point(i, j));
        let [uu, wuu] = size(columns.saturating_sub(2), rows, du * (du - 1.0), &|i, j| {
            point(i, j) - 2.0 * point(i + 1, j) + point(i + 2, j)
        });
        let [uv, wuv] = size(columns - 1, rows - 1, du * dv, &|i, j| {
            point(i, j) - point(i + 1, j) - point(i, j + 1) + point(i + 1, j + 1)
        });
        let (su, sv) = ((u + wu * reach) / weight, (v + wv * reach) / weight);
        PatchBounds {
            corners: (low, high),
            first: [su, sv],
            second: (uu + 2.0 * wu * su + wuu * reach) / weight,
            mixed: (uv + wu * sv + wv * su + wuv * reach) / weight,
            is_rational: wu.max(wv) > 0.0,
        }
    }

    /// Returns the patch's part in a bound of eight times its distance from a mesh, if it is not
    /// cut in the first direction. `is_small` says that the patch is a small part of its span.
    ///
    /// In a cell of extents h and k the distance is at most (h² S_uu + 2 h k S_uv + k² S_vv) / 8
    /// (Filip, Magedson and Markot, Surface algorithms using bounds on derivatives, 1986). With
    /// 2 h k ≤ h² + k², in knot spans, each direction has a part that does not depend on the cuts
    /// in the other one.
    ///
    /// If the weights differ, terms that cancel make the bound too large, such as for the straight
    /// lines of a cylinder. For a small patch of low order it is then replaced by the exact
    /// derivatives at the corners, times [`CORNER_MARGIN`], if that is less.
    pub(super) fn bend(&self, bounds: &PatchBounds, is_small: bool) -> f64 {
        let ratio = self.spans[0] / self.spans[1];
        let bound = bounds.second + bounds.mixed * ratio;
        if !is_small || !bounds.is_rational || self.columns.max(self.rows) > HIGHEST_BY_CORNERS {
            return bound;
        }
        let corners = [(false, false), (true, false), (false, true), (true, true)];
        let bends = corners.map(|corner| self.bend_at(corner, ratio));
        bound.min(CORNER_MARGIN * largest(bends.into_iter()))
    }

    /// Returns the sum of the second derivative at a corner and of the mixed one times a ratio.
    /// `ends` says for both directions whether the corner is at their end.
    fn bend_at(&self, ends: (bool, bool), ratio: f64) -> f64 {
        // Seen from the corner, derivatives have the same lengths.
        let inward = |count: usize, at_end: bool, i: usize| if at_end { count - 1 - i } else { i };
        let point = |i: usize, j: usize| {
            let (i, j) = (
                inward(self.columns, ends.0, i),
                inward(self.rows, ends.1, j),
            );
            self.points[j * self.columns + i]
        };
        let (du, dv) = (self.columns as f64 - 1.0, self.rows as f64 - 1.0);
        let a = point(0, 0);
        let au = du * (point(1, 0) - a);
        let (av, auv) = match self.rows {
            1 => (DVec4::ZERO, DVec4::ZERO),
            _ => (
                dv * (point(0, 1) - a),
                du * dv * (point(1, 1) - point(1, 0) - point(0, 1) + a),
            ),
        };
        let auu = match self.columns {
            2 => DVec4::ZERO,
            _ => du * (du - 1.0) * (point(2, 0) - 2.0 * point(1, 0) + a),
        };
        let s = a.truncate() / a.w;
        let su = (au.truncate() - au.w * s) / a.w;
        let sv = (av.truncate() - av.w * s) / a.w;
        let suu = (auu.truncate() - 2.0 * au.w * su - auu.w * s) / a.w;
        let suv = (auv.truncate() - au.w * sv - av.w * su - auv.w * s) / a.w;
        suu.length() + ratio * suv.length()
    }
}
