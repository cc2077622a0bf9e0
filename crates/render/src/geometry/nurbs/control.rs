//! Control points: their projection, and the number of pieces that their net needs.

use glam::{DVec3, DVec4};

/// The largest number of grid cells of one surface, and of points of one curve, which bounds
/// memory.
pub(crate) const MAX_CELLS: usize = 1 << 20;

/// Returns the number of pieces of each knot span, for a complexity from 0 to 1.
///
/// The smallest number is 4 · 8^complexity: 4 pieces at 0, 11 at 0.5 and 32 at 1. Coin makes 3, 6
/// and 31 pieces (a bicubic patch, measured at 0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9 and 1), so no
/// surface is coarser than Coin's. Where the control points bend there are up to four times as
/// many. The chord of a piece of length h is at most h²·|S''|/8 from the curve. This error is kept
/// below 0.004 · 0.02^complexity of the net's size (0.0006 at 0.5).
pub(super) fn pieces(complexity: f32, degree: usize, bend: f64, size: f64) -> usize {
    let c = clamped(complexity);
    if degree == 1 && bend == 0.0 {
        return 1;
    }
    let base = (4.0 * libm::pow(8.0, c)).round();
    let tolerance = size * 0.004 * libm::pow(0.02, c);
    let wanted = (0.125 * (degree * degree) as f64 * bend / tolerance)
        .sqrt()
        .ceil();
    let finest = 4.0 * base;
    (if wanted > base {
        wanted.min(finest)
    } else {
        base
    }) as usize
}

/// Returns the distance from a curve or surface that a complexity from 0 to 1 allows, in pixels of
/// the picture: 0.25 at 0.5, and by the law of [`pieces`] 1.8 at 0 and 0.035 at 1.
pub(crate) fn tolerance_in_pixels(complexity: f32) -> f64 {
    0.25 * libm::pow(0.02, clamped(complexity) - 0.5)
}

fn clamped(complexity: f32) -> f64 {
    if complexity.is_nan() {
        0.5
    } else {
        f64::from(complexity.clamp(0.0, 1.0))
    }
}

/// Projects a homogeneous point to space; returns `None` if it is at infinity.
pub(super) fn project(p: DVec4) -> Option<DVec3> {
    let q = p.truncate() / p.w;
    (p.w != 0.0 && q.is_finite()).then_some(q)
}

/// Returns the largest second difference along a row of control points. Times degree² it bounds the
/// second derivative of a curve with equal weights. If the weights vary it is not a bound, so the
/// largest first difference is used if it is larger.
pub(super) fn bend(row: impl Iterator<Item = DVec4>) -> f64 {
    let points: Vec<DVec4> = row.collect();
    let weights_vary = points.windows(2).any(|p| p[0].w != p[1].w);
    let flat: Vec<DVec3> = points.iter().filter_map(|&p| project(p)).collect();
    let second = largest(flat.windows(3).map(|p| (p[0] - 2.0 * p[1] + p[2]).length()));
    let first = largest(flat.windows(2).map(|p| p[0].distance(p[1])));
    if weights_vary {
        second.max(first)
    } else {
        second
    }
}

/// Returns the diagonal of the bounding box of the control points.
pub(super) fn size_of(points: &[DVec4]) -> f64 {
    let mut flat = points.iter().filter_map(|&p| project(p));
    let Some(first) = flat.next() else { return 0.0 };
    let (lo, hi) = flat.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)));
    lo.distance(hi)
}

/// Checks that all control points are finite.
pub(super) fn check_points(points: &[DVec4]) -> Result<(), String> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(format!("control point {i} is not finite")),
        None => Ok(()),
    }
}

/// Returns the largest of some numbers that are not negative, or 0 if there are none.
pub(super) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// The error for a point with weight 0.
pub(super) fn at_infinity() -> String {
    "a point is at infinity: its weight is 0".to_owned()
}
