//! The polygon at which rays from one film point are aimed.

use glam::DVec2;

use crate::lens::pupil::patch::Located;
use crate::lens::pupil::polar_table::PolarTable;
use crate::lens::pupil::radial_table::RadialTable;
use crate::lens::pupil::support::{PolygonCorners, SIDES};
use crate::lens::pupil::symmetry::WedgeCopy;

/// The polygon at which rays from one film point are aimed.
#[derive(Clone, Copy, Debug)]
pub struct PupilPolygon<'a> {
    shape: PolygonShape<'a>,
    /// The rotation and reflection of the shape.
    copy: WedgeCopy,
    /// The area in square millimeters.
    area: f64,
}

/// The polygon before it is rotated and mirrored.
#[derive(Clone, Copy, Debug)]
enum PolygonShape<'a> {
    Radial(&'a RadialTable, Located<'a, 2, 3>),
    Polar(Located<'a, 4, 9>),
}

impl<'a> PupilPolygon<'a> {
    /// The polygon of a film point in a table over the film's radius; none if it has no area.
    pub(super) fn radial(table: &'a RadialTable, film: DVec2) -> Option<Self> {
        let located = table.locate(film)?;
        let area = located.patch.area::<false>(located.at);
        Self::with_area(PolygonShape::Radial(table, located), located.copy, area)
    }

    /// The polygon of a film point in a table over film positions; none if it has no area.
    pub(super) fn polar(table: &'a PolarTable, film: DVec2) -> Option<Self> {
        Self::located(table.locate(film)?)
    }

    fn located(located: Located<'a, 4, 9>) -> Option<Self> {
        let area = located.patch.area::<false>(located.at);
        Self::with_area(PolygonShape::Polar(located), located.copy, area)
    }

    fn with_area(shape: PolygonShape<'a>, copy: WedgeCopy, area: f64) -> Option<Self> {
        (area > 0.0).then_some(Self { shape, copy, area })
    }

    /// The area in square millimeters.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The corners before rotation and reflection.
    fn unplaced(&self) -> PolygonCorners {
        match &self.shape {
            PolygonShape::Radial(table, film) => table.polygon(film.patch.number, film.at[0]),
            PolygonShape::Polar(film) => film.patch.polygon(film.at, film.direction),
        }
    }

    /// The mean of the corners, around which the polygon is divided into triangles.
    pub fn center(&self) -> DVec2 {
        self.copy.placed(self.unplaced().center)
    }

    /// The corners, for drawing.
    pub fn corners(&self) -> impl Iterator<Item = DVec2> {
        let corners = self.unplaced().all.map(|corner| self.copy.placed(corner));
        corners.into_iter().take(SIDES)
    }

    /// A point that is uniformly distributed over the area if `u` and `v` are uniformly distributed
    /// from 0 to 1. The direction from the center is given by `u`, and √`v` is the fraction of the
    /// distance to the rim.
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        let point = match &self.shape {
            PolygonShape::Radial(_, film) => film.point(self.area, u, v.sqrt()),
            PolygonShape::Polar(film) => film.point(self.area, u, v.sqrt()),
        };
        self.copy.placed(point)
    }

    /// Whether a point of the rear vertex plane lies in the polygon.
    pub fn contains(&self, point: DVec2) -> bool {
        let corners = self.unplaced().all;
        let p = self.copy.unfold(point);
        let size = self.area.sqrt();
        corners.windows(2).all(|edge| {
            let (a, b) = (edge[0], edge[1]);
            // The direction of an edge shorter than the rounding error is meaningless.
            (b - a).perp_dot(p - a) >= 0.0 || (b - a).length() < 1e-12 * (size + a.length())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::lens::pupil::patch::PolarPatch;
    use crate::lens::pupil::support::{Support, even_normals};

    /// The mean of x² over a polygon, from the integrals over its triangles.
    fn mean_square(polygon: &PupilPolygon<'_>) -> f64 {
        let c = polygon.center();
        let corners: Vec<DVec2> = polygon.corners().collect();
        let mut sum = 0.0;
        for j in 0..SIDES {
            let (a, b) = (corners[j], corners[(j + 1) % SIDES]);
            let twice = (a - c).perp_dot(b - c).abs();
            sum += twice / 12.0
                * (a.x * a.x + b.x * b.x + c.x * c.x + a.x * b.x + b.x * c.x + c.x * a.x);
        }
        sum / polygon.area()
    }

    fn check(polygon: &PupilPolygon<'_>) {
        let n = 200;
        let mut mean = DVec2::ZERO;
        let mut square = 0.0;
        for i in 0..n * n {
            let (u, v) = (
                (f64::from(i % n) + 0.5) / f64::from(n),
                (f64::from(i / n) + 0.5) / f64::from(n),
            );
            let p = polygon.point(u, v);
            assert!(polygon.contains(p), "{p}");
            mean += p / f64::from(n * n);
            square += p.x * p.x / f64::from(n * n);
        }
        assert!((mean - polygon.center()).length() < 1e-3, "{mean}");
        let exact = mean_square(polygon);
        assert!((square / exact - 1.0).abs() < 1e-3, "{square} {exact}");
    }

    #[test]
    fn points_of_a_polygon_are_even_and_inside_and_its_area_is_right() {
        let normals = even_normals();
        // Discs about (1, 0): of radius 1 to 3, so of 2 in their middle.
        let disc = |radius: f64| Support([radius; SIDES]).shifted(DVec2::X, &normals);
        let turn = DVec2::new(0.6, 0.8);
        let circumscribed = 4.0 * SIDES as f64 * libm::tan(PI / SIDES as f64);
        let table = RadialTable::new(vec![(0.0, disc(1.0)), (1.0, disc(3.0))], normals);
        let mut all = vec![PupilPolygon::radial(&table, 0.5 * turn).unwrap()];
        // Discs of radius 1 to 3 about (0, 0), with centers from (0, 0) to (2, 0) along a
        // direction.
        let polygons = [1.0, 1.0, 3.0, 3.0].map(|radius| {
            let support = Support([radius; SIDES]);
            PolygonCorners::new(&support, &normals)
        });
        let center = |k: usize| DVec2::new([0.0, 2.0][k % 2], 0.0);
        let patch = PolarPatch::new(
            0,
            ([0.25, 0.5], [0.375, 0.75]),
            [8.0, 4.0],
            std::array::from_fn(center),
            polygons.each_ref(),
        );
        let film = [0.3125, 0.625];
        assert!(patch.contains(film) && !patch.contains([0.375, 0.625]));
        for mirror in [DVec2::ONE, DVec2::new(-1.0, 1.0), DVec2::new(-1.0, -1.0)] {
            let copy = WedgeCopy { turn, mirror };
            for angle in [0.0, 1.0] {
                let located = Located {
                    patch: &patch,
                    at: patch.coordinates(film),
                    direction: DVec2::from_angle(angle),
                    copy,
                };
                all.push(PupilPolygon::located(located).unwrap());
            }
        }
        for polygon in all {
            assert!((polygon.area() - circumscribed).abs() < 1e-12);
            let direction = match polygon.shape {
                PolygonShape::Radial(..) => DVec2::X,
                PolygonShape::Polar(film) => film.direction,
            };
            let center = polygon.copy.mirror * turn.rotate(direction);
            assert!((polygon.center() - center).length() < 1e-12);
            check(&polygon);
        }
    }

    /// A pupil that is cut off from one side, so that corners merge.
    #[test]
    fn points_between_two_different_pupils_are_even_and_inside() {
        let normals = even_normals();
        let round = Support([1.5; SIDES]).shifted(DVec2::X, &normals);
        let cut = normals.map(|n| (1.5 + n.x).min(1.5 - 0.5 * n.x));
        // The minimum of two supports is not a support itself: take that of the corners.
        let lens = PolygonCorners::new(&Support(cut), &normals);
        let cut = Support(normals.map(|normal| {
            let reach = lens.all.iter().map(|c| c.dot(normal));
            reach.fold(f64::NEG_INFINITY, f64::max)
        }));
        let table = RadialTable::new(vec![(0.0, round), (1.0, cut)], normals);
        for t in [0.0, 0.3, 1.0] {
            check(&PupilPolygon::radial(&table, t * DVec2::X).unwrap());
        }
    }
}
