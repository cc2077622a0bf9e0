//! Convex polygons to aim at, and interpolation between two that were measured.
//!
//! The sides of all polygons have the same directions. So the corners of a mixture of two polygons
//! are the mixtures of their corners, and every area in it is a quadratic of the mixing parameter,
//! whose coefficients are computed once. An aim from a film point between two measured ones then
//! costs one search among the triangles.

use std::f64::consts::TAU;

use glam::DVec2;

/// The number of sides of every pupil polygon.
pub(crate) const SIDES: usize = 32;

/// The support function of a convex figure in [`SIDES`] directions: the distance of its supporting
/// line from the axis, in millimeters. A mixture of two supports is the support of their Minkowski
/// mixture, which is convex too, so pupils interpolate well in this form.
pub(crate) type Support = [f64; SIDES];

/// The outward normals of the sides, counterclockwise. The first is +x.
pub(super) fn directions() -> [DVec2; SIDES] {
    std::array::from_fn(|j| {
        let (sin, cos) = libm::sincos(TAU * j as f64 / SIDES as f64);
        DVec2::new(cos, sin)
    })
}

/// The normals of the sides, with the nearest one rotated onto the normal of each edge of an iris.
/// Opposite sides stay parallel.
pub(super) fn directions_along(edges: &[DVec2]) -> [DVec2; SIDES] {
    const HALF: usize = SIDES / 2;
    let mut sides = directions();
    for edge in edges {
        let normal = edge.normalize();
        let angle = libm::atan2(normal.y, normal.x) / TAU * SIDES as f64;
        let slot = (angle.round() as isize).rem_euclid(HALF as isize) as usize;
        let normal = normal * normal.dot(sides[slot]).signum();
        let [before, after] = [slot + SIDES - 1, slot + 1].map(|j| sides[j % SIDES]);
        // The corner between two nearly parallel sides is ill-conditioned. Neighboring normals are
        // 11° apart; one that would come within 1° of another is not rotated.
        if before.perp_dot(normal) > 0.02 && normal.perp_dot(after) > 0.02 {
            (sides[slot], sides[slot + HALF]) = (normal, -normal);
        }
    }
    sides
}

/// The corners of a polygon, which is divided into triangles around a point inside.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    center: DVec2,
    /// The corners, counterclockwise. The first is repeated at the end.
    corners: [DVec2; SIDES + 1],
}

impl Outline {
    /// The polygon of a support, whose sides have the normals `sides`.
    pub fn of(support: &Support, sides: &[DVec2; SIDES]) -> Self {
        let mut corners = [DVec2::ZERO; SIDES + 1];
        let mut center = DVec2::ZERO;
        for j in 0..SIDES {
            // Where side j meets side j + 1.
            let (side, next) = (sides[j], sides[(j + 1) % SIDES]);
            let (sin, cos) = (side.perp_dot(next), side.dot(next));
            let along = (support[(j + 1) % SIDES] - support[j] * cos) / sin;
            corners[j] = support[j] * side + along * side.perp();
            center += corners[j];
        }
        corners[SIDES] = corners[0];
        center /= SIDES as f64;
        Self { center, corners }
    }

    /// Interpolates linearly between two polygons.
    fn mix(&self, other: &Self, t: f64) -> Self {
        Self {
            center: self.center.lerp(other.center, t),
            corners: std::array::from_fn(|j| self.corners[j].lerp(other.corners[j], t)),
        }
    }
}

/// The number of entries in a [`TriangleTable`].
const STARTS: usize = 1024;

/// The interpolated pupils of all film points between two from which the pupil was measured.
#[derive(Clone, Debug)]
pub struct Span {
    low: Outline,
    high: Outline,
    /// Twice the area of the triangles before each corner, as a quadratic of the mixing parameter.
    before: [[f64; 3]; SIDES + 1],
    wedges: [Wedge; SIDES],
    triangles: TriangleTable,
}

/// The quantities that a point in one of the triangles depends on, as quadratics of the mixing
/// parameter: the vectors from the center to the two corners, the center, and twice the areas
/// before those corners. The coefficients of one power are adjacent, so that all are evaluated as
/// one vector.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Wedge([[f64; 8]; 3]);

impl Wedge {
    /// The quantities at the mixing parameter `t`.
    #[inline(always)]
    fn at(&self, t: f64) -> [f64; 8] {
        let Self([a, b, c]) = self;
        let mut all = [0.0; 8];
        for i in 0..8 {
            all[i] = a[i] + t * (b[i] + t * c[i]);
        }
        all
    }
}

/// A table from a share of the area to a triangle, for areas averaged over a span. The search for a
/// triangle starts there, and nearly always ends there.
#[derive(Clone, Debug)]
struct TriangleTable {
    /// The triangle that contains the middle of each of [`STARTS`] equal parts of the area.
    starts: [u8; STARTS],
}

impl TriangleTable {
    /// Makes the table from the mean area before each corner, which `area` returns.
    fn new(area: impl Fn(usize) -> f64) -> Self {
        let all = area(SIDES).max(f64::MIN_POSITIVE);
        let before: [f64; SIDES + 1] = std::array::from_fn(|j| area(j) / all);
        let mut starts = [0; STARTS];
        let mut j = 0;
        for (i, start) in starts.iter_mut().enumerate() {
            let share = (i as f64 + 0.5) / STARTS as f64;
            while j < SIDES - 1 && before[j + 1] <= share {
                j += 1;
            }
            *start = j as u8;
        }
        Self { starts }
    }

    /// The triangle in which a share of the area ends, or a neighbor of it.
    #[inline(always)]
    fn lookup(&self, share: f64) -> usize {
        usize::from(self.starts[(share * STARTS as f64) as usize & (STARTS - 1)])
    }
}

impl Span {
    /// The span between two polygons, at the mixing parameters 0 and 1.
    pub fn new(low: Outline, high: Outline) -> Self {
        let mut before = [[0.0; 3]; SIDES + 1];
        let from_center = |j: usize| {
            let start = low.corners[j] - low.center;
            (start, high.corners[j] - high.center - start)
        };
        for j in 0..SIDES {
            let ((p, dp), (q, dq)) = (from_center(j), from_center(j + 1));
            let twice = [
                p.perp_dot(q),
                p.perp_dot(dq) + dp.perp_dot(q),
                dp.perp_dot(dq),
            ];
            before[j + 1] = std::array::from_fn(|i| before[j][i] + twice[i]);
        }
        let (center, moved) = (low.center, high.center - low.center);
        let wedges = std::array::from_fn(|j| {
            let ((p, dp), (q, dq)) = (from_center(j), from_center(j + 1));
            let (from, to) = (before[j], before[j + 1]);
            Wedge([
                [p.x, p.y, q.x, q.y, center.x, center.y, from[0], to[0]],
                [dp.x, dp.y, dq.x, dq.y, moved.x, moved.y, from[1], to[1]],
                [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, from[2], to[2]],
            ])
        });
        let triangles = TriangleTable::new(|j| {
            let [a, b, c] = before[j];
            a + b / 2.0 + c / 3.0
        });
        Self {
            low,
            high,
            before,
            wedges,
            triangles,
        }
    }

    /// Twice the area of the triangles before a corner, at the mixing parameter `t`, in square
    /// millimeters.
    #[inline(always)]
    pub fn twice_area_before(&self, j: usize, t: f64) -> f64 {
        let [a, b, c] = self.before[j];
        a + t * (b + t * c)
    }

    /// The area of the polygon at the mixing parameter `t`, in square millimeters.
    #[inline(always)]
    pub fn area(&self, t: f64) -> f64 {
        0.5 * self.twice_area_before(SIDES, t)
    }

    /// The point at the share `u` of the area, counted around the center, and at the share `out` of
    /// the distance from the center to the rim, in the polygon at the mixing parameter `t`.
    #[inline(always)]
    pub fn point(&self, t: f64, u: f64, out: f64) -> DVec2 {
        let place = u * self.twice_area_before(SIDES, t);
        let guess = self.triangles.lookup(u);
        let mut wedge = self.wedges[guess].at(t);
        // The tabulated triangle nearly always contains the point.
        if !(wedge[6] <= place && place < wedge[7]) {
            wedge = self.wedges[self.search(guess, t, place)].at(t);
        }
        let [px, py, qx, qy, x, y, start, end] = wedge;
        let at = share(place, start, end);
        DVec2::new(
            x + out * (px + at * (qx - px)),
            y + out * (py + at * (qy - py)),
        )
    }

    /// Searches for the triangle that contains a place, starting from a neighbor.
    #[cold]
    #[inline(never)]
    fn search(&self, from: usize, t: f64, place: f64) -> usize {
        let mut j = from;
        while j > 0 && self.twice_area_before(j, t) > place {
            j -= 1;
        }
        while j < SIDES - 1 && self.twice_area_before(j + 1, t) <= place {
            j += 1;
        }
        j
    }
}

/// The position of a place between two others, 0 to 1; the middle for a triangle of no area.
#[inline(always)]
fn share(place: f64, before: f64, behind: f64) -> f64 {
    if behind > before {
        ((place - before) / (behind - before)).clamp(0.0, 1.0)
    } else {
        0.5
    }
}

/// The polygon at which rays from one film point are aimed.
#[derive(Clone, Copy, Debug)]
pub struct Polygon<'a> {
    figure: Figure<'a>,
    /// The figure is rotated so that +x becomes this unit vector.
    turn: DVec2,
    /// The coordinates of the rotated figure are multiplied by these signs.
    mirror: DVec2,
    /// The area in square millimeters.
    area: f64,
}

/// The shape of a polygon before it is rotated and mirrored. It lives on the stack for one sample,
/// where a box would cost more.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
enum Figure<'a> {
    /// The polygon at a mixing parameter of a span.
    Between(&'a Span, f64),
    /// A polygon and twice the area before each of its corners.
    Whole(Outline, [f64; SIDES + 1]),
}

impl<'a> Polygon<'a> {
    /// The polygon at the parameter `t` of a span; none if it has no area.
    #[inline]
    pub fn between(span: &'a Span, t: f64, turn: DVec2) -> Option<Self> {
        let area = span.area(t);
        (area > 0.0).then_some(Self {
            figure: Figure::Between(span, t),
            turn,
            mirror: DVec2::ONE,
            area,
        })
    }

    /// The polygon of an outline that is rotated so that +x becomes `turn`, and whose coordinates
    /// are then multiplied by the signs `mirror`; none if it has no area.
    pub fn whole(outline: Outline, turn: DVec2, mirror: DVec2) -> Option<Self> {
        let mut before = [0.0; SIDES + 1];
        for j in 0..SIDES {
            let from_center = |j: usize| outline.corners[j] - outline.center;
            // Rounding may make the area over a side of length 0 negative.
            before[j + 1] = before[j] + from_center(j).perp_dot(from_center(j + 1)).max(0.0);
        }
        let area = 0.5 * before[SIDES];
        (area > 0.0).then_some(Self {
            figure: Figure::Whole(outline, before),
            turn,
            mirror,
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
            Figure::Between(span, t) => span.low.mix(&span.high, *t),
            Figure::Whole(outline, _) => *outline,
        }
    }

    /// Rotates and mirrors a point of the outline.
    fn placed(&self, point: DVec2) -> DVec2 {
        self.mirror * self.turn.rotate(point)
    }

    /// The mean of the corners, around which the polygon is divided into triangles.
    pub fn center(&self) -> DVec2 {
        self.placed(self.outline().center)
    }

    /// The corners, for drawing.
    pub fn corners(&self) -> impl Iterator<Item = DVec2> {
        let corners = self.outline().corners.map(|corner| self.placed(corner));
        corners.into_iter().take(SIDES)
    }

    /// A point that is uniformly distributed over the area if `u` and `v` are uniformly distributed
    /// from 0 to 1. The direction from the center is given by `u`, and √`v` is the share of the
    /// distance to the rim.
    #[inline]
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        let point = match &self.figure {
            Figure::Between(span, t) => span.point(*t, u, v.sqrt()),
            Figure::Whole(outline, before) => {
                let place = u * before[SIDES];
                let j = before[1..SIDES].partition_point(|b| *b <= place);
                let at = share(place, before[j], before[j + 1]);
                let rim = outline.corners[j].lerp(outline.corners[j + 1], at);
                outline.center.lerp(rim, v.sqrt())
            }
        };
        self.placed(point)
    }

    /// Whether a point of the rear vertex plane lies in the polygon.
    pub fn contains(&self, point: DVec2) -> bool {
        let outline = self.outline();
        let back = DVec2::new(self.turn.x, -self.turn.y);
        let p = back.rotate(self.mirror * point);
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
        for mirror in [DVec2::ONE, DVec2::new(-1.0, 1.0), DVec2::new(-1.0, -1.0)] {
            all.push(Polygon::whole(disc(2.0), turn, mirror).unwrap());
        }
        for polygon in all {
            assert!((polygon.area() - circumscribed).abs() < 1e-12);
            assert!((polygon.center() - polygon.mirror * turn).length() < 1e-12);
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
