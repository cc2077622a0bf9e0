//! The part of the rear vertex plane that rays from one film point are aimed at.

use std::f64::consts::PI;

use glam::DVec2;

use crate::lens::pupil::polygon::Polygon;
use crate::sampling::DiscMap;

/// The share of the aims that go anywhere in a disc, if light may come through secondary openings: a
/// defensive mixture, so that every ray that gets through has a known density above 0. It is
/// small, for most of these rays are lost.
const DEFENSIVE_FRACTION: f64 = 0.025;

/// The part of the rear vertex plane that rays from one film point are aimed at. It lives on the
/// stack for one pixel; a box would cost more.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub enum PupilWindow<'a> {
    Disc {
        radius: f64,
        map: DiscMap,
    },
    Polygon(Polygon<'a>),
    /// The polygon, but for the share [`DEFENSIVE_FRACTION`] of the aims, which go anywhere in a disc
    /// of this radius: there may be secondary openings outside the polygon.
    Defensive(Polygon<'a>, f64),
    /// No light reaches the film point.
    Closed,
}

impl PupilWindow<'_> {
    /// A point of the rear vertex plane for a pair of numbers in the unit square.
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        match self {
            Self::Disc { radius, map } => *radius * DVec2::from_array(map.point([u, v])),
            Self::Polygon(polygon) => polygon.point(u, v),
            Self::Defensive(_, radius) if u < DEFENSIVE_FRACTION => {
                disc(*radius).point(u / DEFENSIVE_FRACTION, v)
            }
            Self::Defensive(polygon, _) => {
                polygon.point((u - DEFENSIVE_FRACTION) / (1.0 - DEFENSIVE_FRACTION), v)
            }
            Self::Closed => DVec2::ZERO,
        }
    }

    /// The probability density of [`Self::point`] at a point, per square millimeter.
    pub fn density(&self, point: DVec2) -> f64 {
        match self {
            Self::Disc { radius, .. } => 1.0 / (PI * radius * radius),
            Self::Polygon(polygon) => 1.0 / polygon.area(),
            Self::Defensive(polygon, radius) => {
                let share = |inside: bool, of: f64, area: f64| match inside {
                    true => of / area,
                    false => 0.0,
                };
                let disc = PI * radius * radius;
                share(
                    point.length_squared() <= radius * radius,
                    DEFENSIVE_FRACTION,
                    disc,
                ) + share(
                    polygon.contains(point),
                    1.0 - DEFENSIVE_FRACTION,
                    polygon.area(),
                )
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
            Self::Defensive(polygon, radius) => {
                polygon.contains(point) || disc(*radius).contains(point)
            }
            Self::Closed => false,
        }
    }
}

/// A whole disc.
pub(super) fn disc(radius: f64) -> PupilWindow<'static> {
    PupilWindow::Disc {
        radius,
        map: DiscMap::Concentric,
    }
}
