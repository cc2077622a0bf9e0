//! Convex figures by how far they reach in a row of directions, and what can be made of two.

use glam::DVec2;

use super::polygon::{SIDES, Support};

pub fn mix(a: &Support, b: &Support, t: f64) -> Support {
    std::array::from_fn(|j| a[j] + t * (b[j] - a[j]))
}

/// The support of the smallest convex figure around two.
pub fn hull(a: &Support, b: &Support) -> Support {
    std::array::from_fn(|j| a[j].max(b[j]))
}

/// A support widened by a share of the figure's own half width in each direction.
pub fn widened(support: &Support, share: f64) -> Support {
    std::array::from_fn(|j| {
        let opposite = support[(j + SIDES / 2) % SIDES];
        support[j] + share * 0.5 * (support[j] + opposite)
    })
}

/// How far `inner` sticks out of `outer`, as a share of `outer`'s half width; negative if inside.
pub fn excess(inner: &Support, outer: &Support) -> f64 {
    (0..SIDES)
        .map(|j| {
            let half = 0.5 * (outer[j] + outer[(j + SIDES / 2) % SIDES]);
            (inner[j] - outer[j]) / half.max(f64::MIN_POSITIVE)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// How much wider than measured, on each side, as a share of the pupil's own half width.
pub(super) const MARGIN: f64 = 0.004;

/// A support and where it goes: +x becomes `turn`, then it is mirrored.
pub(super) struct Figure {
    pub support: Support,
    pub turn: DVec2,
    pub mirror: DVec2,
}
