//! What a film point sees through a lens: the outline of the light on the rear vertex plane.
//!
//! A ray from the film is followed without blocking, and its *fill* is how much of the tightest
//! semi-diameter it uses: below 1 it gets through. The fill is continuous and nearly linear in
//! the aim, so the least fill and the outline where it is 1 are found in few rays, at f/1024 as
//! at full aperture.

use glam::{DVec2, DVec3};

use super::pupil::{SIDES, Support};
use super::trace::{Course, LensRay, Toward};
use super::{Lens, RearElement};

/// Directions in which the outline is sought, over half a turn.
const HALF_TURN: usize = 48;
/// Aims along the meridian among which the best is refined.
const SCAN: usize = 96;

pub(crate) struct Sight<'a> {
    lens: &'a Lens,
    film_z: f64,
    reach: f64,
    rotational: bool,
}

impl<'a> Sight<'a> {
    pub fn new(lens: &'a Lens, film_z: f64) -> Self {
        let rear = RearElement::of(lens, crate::sampling::DiscMap::Concentric).radius;
        let rotational = lens
            .prescription()
            .surfaces
            .iter()
            .all(|s| s.shape.is_rotational());
        Self {
            lens,
            film_z,
            reach: 1.5 * rear,
            rotational,
        }
    }

    /// The farthest from the axis that aims are tried.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The share of the tightest semi-diameter that a ray uses; infinite where it is lost
    /// for another reason.
    fn fill(&self, film: DVec2, aim: DVec2) -> f64 {
        self.fill_and_limit(film, aim).0
    }

    /// The same, with the surface that is filled most.
    fn fill_and_limit(&self, film: DVec2, aim: DVec2) -> (f64, usize) {
        let rear_z = self.lens.length();
        let ray = LensRay {
            origin: film.extend(self.film_z),
            direction: DVec3::new(aim.x - film.x, aim.y - film.y, rear_z - self.film_z),
        };
        let (mut fill, mut limit) = (0.0f64, 0);
        let elements = &self.lens.elements;
        let course = Course {
            elements,
            toward: Toward::Scene,
            apertures: false,
        };
        let outcome = course.follow(ray, |surface, hit| {
            let here = (hit.x * hit.x + hit.y * hit.y) / elements[surface].clear;
            if here > fill {
                (fill, limit) = (here, surface);
            }
        });
        match outcome {
            Ok(_) => (fill.sqrt(), limit),
            Err(loss) => (f64::INFINITY, loss.surface),
        }
    }

    /// An aim well inside the light, or none where there is no light.
    fn inside(&self, film: DVec2) -> Option<DVec2> {
        let meridian = if film == DVec2::ZERO {
            DVec2::X
        } else {
            film.normalize()
        };
        let mut aim = self.best_along(film, DVec2::ZERO, meridian);
        if !self.rotational {
            for _ in 0..8 {
                aim = self.best_along(film, aim, DVec2::Y);
                aim = self.best_along(film, aim, DVec2::X);
                if self.fill(film, aim) < 0.5 {
                    break;
                }
            }
            if !(self.fill(film, aim) < 1.0) {
                aim = self.best_of_grid(film);
            }
        }
        (self.fill(film, aim) < 1.0).then_some(aim)
    }

    /// The aim of least fill on a line: the best of a row, then golden sections around it.
    fn best_along(&self, film: DVec2, from: DVec2, direction: DVec2) -> DVec2 {
        let at = |s: f64| from + s * direction;
        let fill = |s: f64| self.fill(film, at(s));
        let step = 2.0 * self.reach / SCAN as f64;
        let middle = -from.dot(direction);
        let row = |i: usize| middle - self.reach + i as f64 * step;
        let (mut best, mut least) = (row(0), f64::INFINITY);
        for i in 0..=SCAN {
            let value = fill(row(i));
            if value < least {
                (best, least) = (row(i), value);
            }
        }
        if least == f64::INFINITY {
            return at(middle);
        }
        let (mut low, mut high) = (best - step, best + step);
        const GOLDEN: f64 = 0.618_033_988_749_894_8;
        let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (mut fa, mut fb) = (fill(a), fill(b));
        for _ in 0..60 {
            // Well inside, or as narrow as rounding lets it be.
            if fa.min(fb) < 0.02 || high - low <= 1e-15 * self.reach {
                break;
            }
            if fa < fb {
                (high, b, fb) = (b, a, fa);
                a = high - GOLDEN * (high - low);
                fa = fill(a);
            } else {
                (low, a, fa) = (a, b, fb);
                b = low + GOLDEN * (high - low);
                fb = fill(b);
            }
        }
        let (found, value) = if fa < fb { (a, fa) } else { (b, fb) };
        at(if value < least { found } else { best })
    }

    fn best_of_grid(&self, film: DVec2) -> DVec2 {
        let (mut best, mut least) = (DVec2::ZERO, f64::INFINITY);
        let count = 48;
        let place = |i: usize| self.reach * (2.0 * i as f64 / count as f64 - 1.0);
        for j in 0..=count {
            for i in 0..=count {
                let aim = DVec2::new(place(i), place(j));
                let fill = self.fill(film, aim);
                if fill < least {
                    (best, least) = (aim, fill);
                }
            }
        }
        best
    }

    /// How far the light reaches in each direction, or none where there is none.
    pub fn support(&self, film: DVec2, sides: &[DVec2; SIDES]) -> Option<Support> {
        let center = self.inside(film)?;
        let mut support: Support = std::array::from_fn(|j| center.dot(sides[j]));
        // Mirror symmetry about the meridian through the film point, which is y = 0 here.
        let mirrored = self.rotational && film.y == 0.0;
        let mut reach_out = |rim: DVec2| {
            for (support, side) in support.iter_mut().zip(sides) {
                *support = support.max(rim.dot(*side));
                if mirrored {
                    *support = support.max(rim.x * side.x - rim.y * side.y);
                }
            }
        };
        let count = if mirrored { HALF_TURN } else { 2 * HALF_TURN };
        let angle = |i: usize| std::f64::consts::PI * i as f64 / HALF_TURN as f64;
        let mut last = self.rim(film, center, angle(0), None);
        reach_out(last.point);
        for i in 1..=count {
            let next = self.rim(film, center, angle(i), Some(last.distance));
            reach_out(next.point);
            if next.limit != last.limit {
                self.corner(film, center, last, next, &mut |rim| reach_out(rim.point));
            }
            last = next;
        }
        Some(support)
    }

    /// A point inside the light and the outline around it, counted from that point. Corners are
    /// closed in on.
    pub fn outline_points(&self, film: DVec2, count: usize) -> Option<(DVec2, Vec<DVec2>)> {
        let center = self.inside(film)?;
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
        let mut last = self.rim(film, center, angle(0), None);
        let mut rims = vec![last];
        for i in 1..count {
            let next = self.rim(film, center, angle(i), Some(last.distance));
            if next.limit != last.limit {
                self.corner(film, center, last, next, &mut |rim| rims.push(rim));
            }
            rims.push(next);
            last = next;
        }
        rims.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        Some((center, rims.iter().map(|rim| rim.point - center).collect()))
    }

    /// Where one surface's shadow meets another's the outline has a corner, which a row of
    /// directions steps over: close in on it between two of them.
    fn corner(
        &self,
        film: DVec2,
        center: DVec2,
        mut from: Rim,
        mut to: Rim,
        hear: &mut impl FnMut(Rim),
    ) {
        for _ in 0..6 {
            let middle = self.rim(
                film,
                center,
                0.5 * (from.angle + to.angle),
                Some(from.distance),
            );
            hear(middle);
            if middle.limit == from.limit {
                from = middle
            } else {
                to = middle
            }
        }
    }

    fn rim(&self, film: DVec2, center: DVec2, angle: f64, guess: Option<f64>) -> Rim {
        let (sin, cos) = libm::sincos(angle);
        let direction = DVec2::new(cos, sin);
        let distance = self.outline(film, center, direction, guess);
        let point = center + distance * direction;
        Rim {
            angle,
            distance,
            point,
            limit: self.fill_and_limit(film, point).1,
        }
    }

    /// The distance from the center where the fill becomes 1, from just outside.
    fn outline(&self, film: DVec2, center: DVec2, direction: DVec2, guess: Option<f64>) -> f64 {
        let over = |s: f64| self.fill(film, center + s * direction) - 1.0;
        // Bracket: inside at `low`, outside at `high`.
        let (mut low, mut f_low) = (0.0, over(0.0));
        let mut high = guess
            .filter(|g| *g > 0.0)
            .map_or(1e-3 * self.reach, |g| 1.02 * g);
        let mut f_high = over(high);
        while f_high <= 0.0 {
            (low, f_low) = (high, f_high);
            high *= 1.5;
            if high > 4.0 * self.reach {
                return high;
            }
            f_high = over(high);
        }
        let mut last_moved_low = None;
        for round in 0..80 {
            let width = high - low;
            if width <= 1e-6 * high {
                break;
            }
            // False position, kept honest by halving; a lost ray has no slope to use.
            let next = if f_high.is_finite() && round % 4 != 3 {
                (low - f_low * width / (f_high - f_low))
                    .clamp(low + 1e-3 * width, high - 1e-3 * width)
            } else {
                0.5 * (low + high)
            };
            let value = over(next);
            if value <= 0.0 {
                (low, f_low) = (next, value);
                if last_moved_low == Some(true) {
                    f_high *= 0.5;
                }
                last_moved_low = Some(true);
            } else {
                (high, f_high) = (next, value);
                if last_moved_low == Some(false) {
                    f_low *= 0.5;
                }
                last_moved_low = Some(false);
            }
        }
        high
    }
}

/// A point of the outline.
#[derive(Clone, Copy)]
struct Rim {
    angle: f64,
    distance: f64,
    point: DVec2,
    /// The surface whose rim it is.
    limit: usize,
}
