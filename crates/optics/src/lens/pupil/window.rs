//! The part of the rear vertex plane at which rays from one film point are aimed.

use std::f64::consts::PI;

use glam::DVec2;

use crate::lens::pupil::polygon::PupilPolygon;
use crate::sampling::DiscMap;

/// The fraction of the aims that are uniformly distributed over a disc, if light may come through
/// secondary openings. It makes the density a defensive mixture (Hesterberg 1995), so that every
/// ray that gets through has a known density above 0. Most of these rays are lost, so it is
/// small: doubling it loses another 2.5% of the rays, and halving it doubles the variance of the
/// light through secondary openings. The mean is right for any value
/// (docs/decisions/0011-measuring-a-pupil.md).
const DEFENSIVE_FRACTION: f64 = 0.025;

/// The part of the rear vertex plane at which rays from one film point are aimed. It lives on the
/// stack for one pixel, where a box would cost more.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub enum PupilWindow<'a> {
    /// A disc about the axis.
    Disc {
        /// The radius in millimeters.
        radius: f64,
        /// The map from the unit square to the disc.
        map: DiscMap,
    },
    /// A polygon that contains the pupil.
    Polygon(PupilPolygon<'a>),
    /// A mixture of a polygon and, with the fraction `DEFENSIVE_FRACTION`, a disc about the axis
    /// whose radius is given in millimeters: there may be secondary openings outside the polygon.
    Defensive(PupilPolygon<'a>, f64),
    /// No light reaches the film point.
    Closed,
}

impl PupilWindow<'_> {
    /// The point of the rear vertex plane, in millimeters, for a point of the unit square.
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
                let mut density = 0.0;
                if point.length_squared() <= radius * radius {
                    density += DEFENSIVE_FRACTION / (PI * radius * radius);
                }
                if polygon.contains(point) {
                    density += (1.0 - DEFENSIVE_FRACTION) / polygon.area();
                }
                density
            }
            Self::Closed => 0.0,
        }
    }

    /// Whether no light reaches the film point.
    pub fn is_closed(&self) -> bool {
        matches!(self, Self::Closed)
    }

    /// Whether [`Self::point`] can return a point of the rear vertex plane.
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

/// The window of a disc about the axis.
pub(super) fn disc(radius: f64) -> PupilWindow<'static> {
    PupilWindow::Disc {
        radius,
        map: DiscMap::Concentric,
    }
}
