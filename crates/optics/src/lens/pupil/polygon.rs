//! The polygon at which rays from one film point are aimed.

use glam::DVec2;

use crate::lens::pupil::patch::{Located, Patch, Position};
use crate::lens::pupil::sides::{Outline, SIDES};
use crate::lens::pupil::span::Span;
use crate::lens::pupil::symmetry::WedgeCopy;

/// The polygon at which rays from one film point are aimed.
#[derive(Clone, Copy, Debug)]
pub struct Polygon<'a> {
    figure: Figure<'a>,
    /// The rotation and reflection of the figure.
    copy: WedgeCopy,
    /// The area in square millimeters.
    area: f64,
}

/// The shape of a polygon before it is rotated and mirrored.
#[derive(Clone, Copy, Debug)]
enum Figure<'a> {
    /// The polygon at a mixing parameter of a span.
    Between(&'a Span, f64),
    /// The polygon at a position in a patch, from a film point in a direction.
    Within(&'a Patch, Position, DVec2),
}

impl<'a> Polygon<'a> {
    /// The polygon at the parameter `t` of a span; none if it has no area.
    #[inline]
    pub fn between(span: &'a Span, t: f64, turn: DVec2) -> Option<Self> {
        let area = span.area(t);
        (area > 0.0).then_some(Self {
            figure: Figure::Between(span, t),
            copy: WedgeCopy {
                turn,
                ..WedgeCopy::NONE
            },
            area,
        })
    }

    /// The polygon of a film point in a patch; none if it has no area.
    pub(super) fn within(film: &Located<'a>) -> Option<Self> {
        let area = film.patch.area::<false>(film.at);
        (area > 0.0).then_some(Self {
            figure: Figure::Within(film.patch, film.at, film.direction),
            copy: film.copy,
            area,
        })
    }

    /// The area in square millimeters.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The outline before rotation and reflection.
    fn outline(&self) -> Outline {
        match &self.figure {
            Figure::Between(span, t) => span.outline(*t),
            Figure::Within(patch, at, direction) => patch.outline(*at, *direction),
        }
    }

    /// The mean of the corners, around which the polygon is divided into triangles.
    pub fn center(&self) -> DVec2 {
        self.copy.placed(self.outline().center)
    }

    /// The corners, for drawing.
    pub fn corners(&self) -> impl Iterator<Item = DVec2> {
        let corners = self
            .outline()
            .corners
            .map(|corner| self.copy.placed(corner));
        corners.into_iter().take(SIDES)
    }

    /// A point that is uniformly distributed over the area if `u` and `v` are uniformly distributed
    /// from 0 to 1. The direction from the center is given by `u`, and √`v` is the share of the
    /// distance to the rim.
    #[inline]
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        let point = match &self.figure {
            Figure::Between(span, t) => span.point(*t, u, v.sqrt()),
            Figure::Within(patch, at, direction) => patch.point(*at, *direction, u, v.sqrt()),
        };
        self.copy.placed(point)
    }

    /// Whether a point of the rear vertex plane lies in the polygon.
    pub fn contains(&self, point: DVec2) -> bool {
        let outline = self.outline();
        let p = self.copy.unfold(point);
        let size = self.area.sqrt();
        (0..SIDES).all(|j| {
            let (a, b) = (outline.corners[j], outline.corners[j + 1]);
            // The direction of an edge shorter than the rounding error is meaningless.
            (b - a).perp_dot(p - a) >= 0.0 || (b - a).length() < 1e-12 * (size + a.length())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::lens::pupil::sides::{Support, directions};

    /// The mean of x² over a polygon, from the integrals over its triangles.
    fn mean_square(polygon: &Polygon<'_>) -> f64 {
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

    fn check(polygon: &Polygon<'_>) {
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
        let sides = directions();
        // Discs about (1, 0): of radius 1 to 3, so of 2 in their middle.
        let disc = |radius: f64| Outline::of(&std::array::from_fn(|j| radius + sides[j].x), &sides);
        let turn = DVec2::new(0.6, 0.8);
        let circumscribed = 4.0 * SIDES as f64 * libm::tan(PI / SIDES as f64);
        let span = Span::new(disc(1.0), disc(3.0));
        let mut all = vec![Polygon::between(&span, 0.5, turn).unwrap()];
        // Discs of radius 1 to 3 about (0, 0), with centers from (0, 0) to (2, 0) along a
        // direction.
        let supports = [1.0, 1.0, 3.0, 3.0].map(|radius| [radius; SIDES]);
        let center = |k: usize| DVec2::new([0.0, 2.0][k % 2], 0.0);
        let figures = std::array::from_fn(|k| (center(k), &supports[k]));
        let patch = Patch::new([0.25, 0.5], [0.125, 0.25], figures, &sides);
        let place = [0.3125, 0.625];
        assert!(patch.contains(place) && !patch.contains([0.375, 0.625]));
        for mirror in [DVec2::ONE, DVec2::new(-1.0, 1.0), DVec2::new(-1.0, -1.0)] {
            let copy = WedgeCopy { turn, mirror };
            let at = patch.position(place);
            for angle in [0.0, 1.0] {
                let direction = DVec2::from_angle(angle);
                let located = Located {
                    patch: &patch,
                    at,
                    direction,
                    copy,
                };
                all.push(Polygon::within(&located).unwrap());
            }
        }
        for polygon in all {
            assert!((polygon.area() - circumscribed).abs() < 1e-12);
            let direction = match polygon.figure {
                Figure::Between(..) => DVec2::X,
                Figure::Within(_, _, direction) => direction,
            };
            let center = polygon.copy.mirror * turn.rotate(direction);
            assert!((polygon.center() - center).length() < 1e-12);
            check(&polygon);
        }
    }

    /// A pupil that is cut off from one side, so that corners merge.
    #[test]
    fn points_between_two_different_pupils_are_even_and_inside() {
        let sides = directions();
        let round: Support = std::array::from_fn(|j| 1.5 + sides[j].x);
        let cut: Support = std::array::from_fn(|j| (1.5 + sides[j].x).min(1.5 - 0.5 * sides[j].x));
        let outline = |s: &Support| Outline::of(s, &sides);
        // The minimum of two supports is not a support itself: take that of the corners.
        let lens = outline(&cut);
        let cut = std::array::from_fn(|j| {
            let reach = lens.corners.iter().map(|c| c.dot(sides[j]));
            reach.fold(f64::NEG_INFINITY, f64::max)
        });
        let span = Span::new(outline(&round), outline(&cut));
        for t in [0.0, 0.3, 1.0] {
            check(&Polygon::between(&span, t, DVec2::X).unwrap());
        }
    }
}
