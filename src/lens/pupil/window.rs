//! What one film point aims at.

use std::f64::consts::PI;

use glam::DVec2;

use super::polygon::Polygon;
use crate::sampling::DiscMap;

/// The share of the aims that go anywhere where light may come from beside the pupil.
const ASIDE: f64 = 0.025;

/// What one film point aims at. It lives on the stack for one pixel; a box would cost more.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub enum PupilWindow<'a> {
    Disc {
        radius: f64,
        map: DiscMap,
    },
    Polygon(Polygon<'a>),
    /// The polygon, but for a share [`ASIDE`] of the aims that go anywhere in a disc: light may come
    /// from beside the polygon.
    Beside(Polygon<'a>, f64),
    /// Nothing gets through from here.
    Closed,
}

impl PupilWindow<'_> {
    /// A point of the rear vertex plane for a pair of numbers in the unit square.
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        match self {
            Self::Disc { radius, map } => *radius * DVec2::from_array(map.point([u, v])),
            Self::Polygon(polygon) => polygon.point(u, v),
            Self::Beside(_, radius) if u < ASIDE => disc(*radius).point(u / ASIDE, v),
            Self::Beside(polygon, _) => polygon.point((u - ASIDE) / (1.0 - ASIDE), v),
            Self::Closed => DVec2::ZERO,
        }
    }

    /// How many of the points of [`Self::point`] fall on a square millimeter there.
    pub fn density(&self, point: DVec2) -> f64 {
        match self {
            Self::Disc { radius, .. } => 1.0 / (PI * radius * radius),
            Self::Polygon(polygon) => 1.0 / polygon.area(),
            Self::Beside(polygon, radius) => {
                let share = |inside: bool, of: f64, area: f64| match inside {
                    true => of / area,
                    false => 0.0,
                };
                let disc = PI * radius * radius;
                share(point.length_squared() <= radius * radius, ASIDE, disc)
                    + share(polygon.contains(point), 1.0 - ASIDE, polygon.area())
            }
            Self::Closed => 0.0,
        }
    }

    /// Whether there is nothing to aim at.
    pub fn is_closed(&self) -> bool {
        matches!(self, Self::Closed)
    }

    /// Whether a point of the rear vertex plane can come out of [`Self::point`].
    pub fn contains(&self, point: DVec2) -> bool {
        match self {
            Self::Disc { radius, .. } => point.length_squared() <= radius * radius,
            Self::Polygon(polygon) => polygon.contains(point),
            Self::Beside(polygon, radius) => {
                polygon.contains(point) || disc(*radius).contains(point)
            }
            Self::Closed => false,
        }
    }
}

/// All of a disc.
pub(super) fn disc(radius: f64) -> PupilWindow<'static> {
    PupilWindow::Disc {
        radius,
        map: DiscMap::Concentric,
    }
}
