//! Convex figures by their support, the reach in 32 directions, and combinations of two.

use glam::DVec2;

use crate::lens::pupil::polygon::{SIDES, Support};

/// The Minkowski mixture of two figures.
pub(super) fn mix(a: &Support, b: &Support, t: f64) -> Support {
    std::array::from_fn(|j| a[j] + t * (b[j] - a[j]))
}

/// The support of the smallest convex figure around two.
pub(super) fn hull(a: &Support, b: &Support) -> Support {
    std::array::from_fn(|j| a[j].max(b[j]))
}

/// A figure widened by a share of its own half width in each direction.
pub(super) fn widened(support: &Support, share: f64) -> Support {
    std::array::from_fn(|j| {
        let opposite = support[(j + SIDES / 2) % SIDES];
        support[j] + share * 0.5 * (support[j] + opposite)
    })
}

/// The most by which `inner` reaches out of `outer`, as a share of the half width of `outer`. It is
/// negative if `inner` lies inside.
pub(super) fn excess(inner: &Support, outer: &Support) -> f64 {
    (0..SIDES)
        .map(|j| {
            let half = 0.5 * (outer[j] + outer[(j + SIDES / 2) % SIDES]);
            (inner[j] - outer[j]) / half.max(f64::MIN_POSITIVE)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// A pupil is made wider than measured by this share of its half width on each side. It covers what
/// interpolation and measuring cut off.
pub(super) const MARGIN: f64 = 0.004;

/// A figure and its place: it is rotated so that +x becomes `turn`, then mirrored.
pub(super) struct Figure {
    pub support: Support,
    pub turn: DVec2,
    pub mirror: DVec2,
}
