//! Convex outlines on the rear vertex plane, given by their support function in 32 directions, and
//! the polygons that the supporting lines make.
//!
//! The outlines of one lens have the same normals. So the corners of a mixture of two polygons are
//! the mixtures of their corners.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::lens::pupil::symmetry::unit;

/// The number of sides of every pupil polygon.
pub(crate) const SIDES: usize = 32;

/// The fraction of its half width by which a pupil is widened on each side. It covers what
/// interpolation and the search cut off: of 4.95 million rays through the shipped lenses none is
/// cut, and 1 to 2% of the aimed rays are lost for it (docs/accuracy.md).
pub(super) const MARGIN: f64 = 0.004;

/// The outward unit normals of the sides, counterclockwise.
pub(crate) type SideNormals = [DVec2; SIDES];

/// The normals for a lens without straight iris edges. The first is +x.
pub(super) fn even_normals() -> SideNormals {
    std::array::from_fn(|j| unit(TAU * j as f64 / SIDES as f64))
}

/// The normals with the nearest one rotated onto the normal of each edge of an iris. Opposite sides
/// stay parallel.
pub(super) fn normals_along(edges: &[DVec2]) -> SideNormals {
    const HALF: usize = SIDES / 2;
    let mut normals = even_normals();
    for edge in edges {
        let normal = edge.normalize();
        let angle = libm::atan2(normal.y, normal.x) / TAU * SIDES as f64;
        let slot = (angle.round() as isize).rem_euclid(HALF as isize) as usize;
        let normal = normal * normal.dot(normals[slot]).signum();
        let [before, after] = [slot + SIDES - 1, slot + 1].map(|j| normals[j % SIDES]);
        // The corner between two nearly parallel sides is ill-conditioned. Neighboring normals are
        // 11° apart; one that would come within 1° of another is not rotated.
        if before.perp_dot(normal) > 0.02 && normal.perp_dot(after) > 0.02 {
            (normals[slot], normals[slot + HALF]) = (normal, -normal);
        }
    }
    normals
}

/// The support function of a convex outline: the distance of the supporting line of each normal
/// from the axis, in millimeters. A mixture of two supports is the support of their Minkowski
/// mixture, which is convex too, so pupils interpolate well in this form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support(pub [f64; SIDES]);

impl Support {
    /// The Minkowski mixture of two outlines, at the mixing parameter `t`.
    pub(super) fn mix(&self, other: &Self, t: f64) -> Self {
        self.map(|j, own| own + t * (other.0[j] - own))
    }

    /// The support of the convex hull of two outlines.
    pub(super) fn hull(&self, other: &Self) -> Self {
        self.map(|j, own| own.max(other.0[j]))
    }

    /// The outline widened by a fraction of its own half width in each direction.
    pub(super) fn widened(&self, fraction: f64) -> Self {
        self.map(|j, own| own + fraction * self.half_width(j))
    }

    /// The outline moved by a vector.
    pub(super) fn shifted(&self, by: DVec2, normals: &SideNormals) -> Self {
        self.map(|j, own| own + by.dot(normals[j]))
    }

    /// The greatest distance by which this outline extends beyond another, as a fraction of the
    /// half width of the other. It is negative if this one lies inside.
    pub(super) fn excess(&self, outer: &Self) -> f64 {
        (0..SIDES)
            .map(|j| (self.0[j] - outer.0[j]) / outer.half_width(j).max(f64::MIN_POSITIVE))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether a point lies outside the outline.
    pub(super) fn is_outside(&self, p: DVec2, normals: &SideNormals) -> bool {
        let mut sides = normals.iter().zip(&self.0);
        sides.any(|(normal, reach)| p.dot(*normal) > *reach)
    }

    /// Half of the width between a side and the opposite one.
    fn half_width(&self, j: usize) -> f64 {
        0.5 * (self.0[j] + self.0[(j + SIDES / 2) % SIDES])
    }

    fn map(&self, change: impl Fn(usize, f64) -> f64) -> Self {
        Self(std::array::from_fn(|j| change(j, self.0[j])))
    }
}

/// The corners of the polygon of a support, which is divided into triangles around a point inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct PolygonCorners {
    /// The mean of the corners.
    pub center: DVec2,
    /// The corners, counterclockwise. The first is repeated at the end.
    pub all: [DVec2; SIDES + 1],
}

impl PolygonCorners {
    /// The corners between the supporting lines of a support.
    pub(super) fn new(support: &Support, normals: &SideNormals) -> Self {
        let mut all = [DVec2::ZERO; SIDES + 1];
        let mut center = DVec2::ZERO;
        for j in 0..SIDES {
            // Where side j meets side j + 1.
            let k = (j + 1) % SIDES;
            let (normal, next) = (normals[j], normals[k]);
            let (sin, cos) = (normal.perp_dot(next), normal.dot(next));
            let along = (support.0[k] - support.0[j] * cos) / sin;
            all[j] = support.0[j] * normal + along * normal.perp();
            center += all[j];
        }
        all[SIDES] = all[0];
        center /= SIDES as f64;
        Self { center, all }
    }

    /// A corner relative to the center.
    pub(super) fn offset(&self, j: usize) -> DVec2 {
        self.all[j] - self.center
    }

    /// Interpolates linearly between two polygons.
    pub(super) fn mix(&self, other: &Self, t: f64) -> Self {
        Self {
            center: self.center.lerp(other.center, t),
            all: std::array::from_fn(|j| self.all[j].lerp(other.all[j], t)),
        }
    }
}

/// The difference between an interpolated outline and the measured one.
#[derive(Clone, Copy)]
pub(super) struct InterpolationError {
    /// What interpolation cuts off, as a fraction of the half width.
    pub cut: f64,
    /// The greater of two ratios, of what is cut off and of what is added to their bounds.
    pub ratio: f64,
}

impl InterpolationError {
    pub(super) const NONE: Self = Self {
        cut: 0.0,
        ratio: 0.0,
    };
    /// The error where light reaches only some of the film points.
    pub(super) const INFINITE: Self = Self {
        cut: 0.0,
        ratio: f64::INFINITY,
    };

    /// The error of an interpolated outline. The bounds are fractions of the half width.
    pub(super) fn new(mixed: &Support, measured: &Support, [cut, added]: [f64; 2]) -> Self {
        let is_cut = measured.excess(mixed).max(0.0);
        Self {
            cut: is_cut,
            ratio: (is_cut / cut).max(mixed.excess(measured) / added),
        }
    }

    /// The greater of two errors.
    pub(super) fn max(&self, other: &Self) -> Self {
        Self {
            cut: self.cut.max(other.cut),
            ratio: self.ratio.max(other.ratio),
        }
    }
}
