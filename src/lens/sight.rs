//! What a film point sees through a lens: the outline of the light on the rear vertex plane.
//!
//! A ray from the film is followed without blocking, and its *fill* is how much of the tightest
//! semi-diameter it uses: below 1 it gets through. The fill is continuous and nearly linear in
//! the aim, so the least fill and the outline where it is 1 are found in few rays, at f/1024 as
//! at full aperture. Rays go in bundles: a whole outline is sought at once.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::lanes::{Bundle, LANES};
use super::pupil::{SIDES, Support};
use super::trace::{LensRay, unit};
use super::{Lens, RearElement};

/// Directions in which an outline is sought: over half a turn where the other half mirrors it.
const DIRECTIONS: usize = 2 * LANES;

/// The width within which an outline of a pupil table is known, relative.
const COARSE: f64 = 4e-4;
/// The same for areas and light.
const FINE: f64 = 1e-10;

pub(crate) struct Sight<'a> {
    lens: &'a Lens,
    reach: f64,
    rotational: bool,
}

/// What was found from a neighboring film point, to start from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hint {
    center: DVec2,
    radius: f64,
}

/// A point of the outline.
#[derive(Clone, Copy)]
struct Rim {
    angle: f64,
    distance: f64,
    point: DVec2,
    /// The surface whose rim it is, or the edge of an iris.
    limit: usize,
}

/// Shares and surfaces for up to a bundle of aims.
type Fills = [(f64, usize); LANES];

impl<'a> Sight<'a> {
    pub fn new(lens: &'a Lens) -> Self {
        let rear = RearElement::of(lens, crate::sampling::DiscMap::Concentric).radius;
        Self {
            lens,
            reach: 1.5 * rear,
            rotational: lens.is_rotational(),
        }
    }

    /// The farthest from the axis that aims are tried.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The fill of every aim of `aims`, at most a bundle of them.
    fn fills(&self, film: DVec3, aims: &[DVec2]) -> Fills {
        let rear_z = self.lens.length();
        let mut bundle = Bundle::default();
        for (lane, aim) in aims.iter().take(LANES).enumerate() {
            let direction = aim.extend(rear_z) - film;
            if let Some(direction) = unit(direction) {
                let ray = LensRay {
                    origin: film,
                    direction,
                };
                bundle.set(lane, &ray);
            }
        }
        self.lens.fill_bundle(&mut bundle);
        std::array::from_fn(|lane| {
            if lane < aims.len() {
                bundle.fill(lane)
            } else {
                (f64::INFINITY, 0)
            }
        })
    }

    /// An aim well inside the light, or none where there is no light.
    fn inside(&self, film: DVec3, hint: Option<Hint>) -> Option<DVec2> {
        let fill = |aim: DVec2| self.fills(film, &[aim])[0].0;
        if let Some(hint) = hint
            && fill(hint.center) < 0.99
        {
            return Some(hint.center);
        }
        let meridian = film.truncate().try_normalize().unwrap_or(DVec2::X);
        let mut aim = self.best_along(film, DVec2::ZERO, meridian);
        if !self.rotational && !(fill(aim) < 0.6) {
            let mut last = f64::INFINITY;
            for _ in 0..8 {
                aim = self.best_along(film, aim, DVec2::Y);
                aim = self.best_along(film, aim, DVec2::X);
                let now = fill(aim);
                if now < 0.6 || !(now < 0.98 * last) {
                    break;
                }
                last = now;
            }
            if !(fill(aim) < 1.0) {
                aim = self.best_of_grid(film);
            }
        }
        (fill(aim) < 1.0).then_some(aim)
    }

    /// The aim of least fill on a line: the best of three bundles in a row, then a bundle in the
    /// neighborhood of the best, again and again.
    fn best_along(&self, film: DVec3, from: DVec2, direction: DVec2) -> DVec2 {
        let middle = -from.dot(direction);
        let mut best = (middle, f64::INFINITY);
        let look = |low: f64, step: f64, best: &mut (f64, f64)| {
            let place = |lane: usize| low + lane as f64 * step;
            let aims: [DVec2; LANES] = std::array::from_fn(|lane| from + place(lane) * direction);
            for (lane, (fill, _)) in self.fills(film, &aims).into_iter().enumerate() {
                if fill < best.1 {
                    *best = (place(lane), fill);
                }
            }
        };
        const ROWS: usize = 3;
        let mut step = 2.0 * self.reach / (ROWS * LANES) as f64;
        for row in 0..ROWS {
            look(
                middle - self.reach + (row * LANES) as f64 * step,
                step,
                &mut best,
            );
        }
        // Each time 15 times nearer: 12 times is rounding.
        for _ in 0..12 {
            if best.1 < 0.6 || best.1.is_infinite() {
                break;
            }
            let low = best.0 - step;
            step *= 2.0 / (LANES - 1) as f64;
            look(low, step, &mut best);
        }
        from + best.0 * direction
    }

    fn best_of_grid(&self, film: DVec3) -> DVec2 {
        let mut best = (DVec2::ZERO, f64::INFINITY);
        let place = |i: usize| self.reach * (2.0 * i as f64 / (2 * LANES - 1) as f64 - 1.0);
        for j in 0..2 * LANES {
            for half in 0..2 {
                let aims: [DVec2; LANES] =
                    std::array::from_fn(|i| DVec2::new(place(half * LANES + i), place(j)));
                for (aim, (fill, _)) in aims.iter().zip(self.fills(film, &aims)) {
                    if fill < best.1 {
                        best = (*aim, fill);
                    }
                }
            }
        }
        best.0
    }

    /// How far the light reaches in each direction, or none where there is none. `hint` is from
    /// a neighbor, and for the next.
    pub fn support(
        &self,
        film: DVec3,
        sides: &[DVec2; SIDES],
        hint: &mut Option<Hint>,
    ) -> Option<Support> {
        let found = self.support_around(self.inside(film, *hint)?, film, sides, hint);
        match found {
            Some(support) => Some(support),
            // A neighbor's middle is too near the rim here.
            None => {
                *hint = None;
                let center = self.inside(film, None)?;
                self.support_around(center, film, sides, hint)
            }
        }
    }

    /// The same from a point inside the light; none where a hint has led too near its rim.
    fn support_around(
        &self,
        center: DVec2,
        film: DVec3,
        sides: &[DVec2; SIDES],
        hint: &mut Option<Hint>,
    ) -> Option<Support> {
        // Mirror symmetry about the meridian through the film point, which is y = 0 here.
        let mirrored = self.rotational && film.y == 0.0;
        let (last, turn) = if mirrored {
            (DIRECTIONS - 1, PI)
        } else {
            (DIRECTIONS, TAU)
        };
        let angles: Vec<f64> = (0..DIRECTIONS)
            .map(|i| turn * i as f64 / last as f64)
            .collect();
        let guess = hint.map(|hint| hint.radius);
        let rims = self.outline(film, center, &angles, !mirrored, guess, COARSE);
        let distances = rims.iter().map(|rim| rim.distance);
        let nearest = distances.clone().fold(f64::INFINITY, f64::min);
        if hint.is_some() && nearest < 0.2 * distances.sum::<f64>() / rims.len() as f64 {
            return None;
        }
        let mut support: Support = std::array::from_fn(|j| center.dot(sides[j]));
        let mut radius = 0.0;
        for rim in &rims {
            radius += rim.distance / rims.len() as f64;
            for (support, side) in support.iter_mut().zip(sides) {
                *support = support.max(rim.point.dot(*side));
                if mirrored {
                    *support = support.max(rim.point.x * side.x - rim.point.y * side.y);
                }
            }
        }
        // The next starts in the middle of this one.
        let span = |j: usize| 0.5 * (support[j] - support[(j + SIDES / 2) % SIDES]);
        let (a, b) = (sides[0], sides[SIDES / 4]);
        let center = (span(SIDES / 4) * a - span(0) * b).perp() / a.perp_dot(b);
        *hint = Some(Hint { center, radius });
        Some(support)
    }

    /// A point inside the light and the outline around it, counted from that point.
    pub fn outline_points(&self, film: DVec3, count: usize) -> Option<(DVec2, Vec<DVec2>)> {
        let center = self.inside(film, None)?;
        let angles: Vec<f64> = (0..count).map(|i| TAU * i as f64 / count as f64).collect();
        let rims = self.outline(film, center, &angles, true, None, FINE);
        Some((center, rims.iter().map(|rim| rim.point - center).collect()))
    }

    /// The outline in a row of directions. Where one surface's shadow meets another's it has a
    /// corner, which a row steps over: between two directions of different surfaces eight more
    /// are sought, and eight between two of those.
    fn outline(
        &self,
        film: DVec3,
        center: DVec2,
        angles: &[f64],
        closed: bool,
        guess: Option<f64>,
        width: f64,
    ) -> Vec<Rim> {
        let mut rims = Vec::with_capacity(angles.len() + 64);
        let mut guess = guess;
        for chunk in angles.chunks(LANES) {
            rims.extend(self.rims(film, center, chunk, guess, width));
            guess = rims.last().map(|rim| rim.distance);
        }
        for _ in 0..2 {
            let mut more = Vec::new();
            let next = |i: usize| match rims.get(i + 1) {
                Some(rim) => Some(*rim),
                None if closed => Some(Rim {
                    angle: rims[0].angle + TAU,
                    ..rims[0]
                }),
                None => None,
            };
            for (i, rim) in rims.iter().enumerate() {
                let Some(next) = next(i) else { continue };
                if next.limit != rim.limit && next.angle - rim.angle > 1e-6 {
                    let part = (next.angle - rim.angle) / 9.0;
                    more.extend((1..9).map(|j| rim.angle + f64::from(j) * part));
                }
            }
            for chunk in more.chunks(LANES) {
                rims.extend(self.rims(film, center, chunk, guess, width));
            }
            rims.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        }
        rims
    }

    /// Where the fill becomes 1, from just outside, in up to a bundle of directions.
    fn rims(
        &self,
        film: DVec3,
        center: DVec2,
        angles: &[f64],
        guess: Option<f64>,
        width: f64,
    ) -> Vec<Rim> {
        let directions: Vec<DVec2> = angles
            .iter()
            .map(|angle| {
                let (sin, cos) = libm::sincos(*angle);
                DVec2::new(cos, sin)
            })
            .collect();
        let at = |distances: &[f64; LANES]| {
            let aims: Vec<DVec2> = directions
                .iter()
                .zip(distances)
                .map(|(d, s)| center + *s * *d)
                .collect();
            self.fills(film, &aims)
        };
        let count = directions.len();
        let start = self.fills(film, &[center])[0].0 - 1.0;
        // Inside at `low`, outside at `high`.
        let (mut low, mut f_low) = ([0.0; LANES], [start; LANES]);
        let mut high = [guess
            .filter(|g| *g > 0.0)
            .map_or(1e-3 * self.reach, |g| 1.02 * g); LANES];
        let mut f_high = [f64::NEG_INFINITY; LANES];
        let mut limit = [0; LANES];
        // Outward until outside.
        for _ in 0..80 {
            let fills = at(&high);
            let mut found = 0;
            for lane in 0..count {
                if f_high[lane] > 0.0 {
                    found += 1;
                    continue;
                }
                let over = fills[lane].0 - 1.0;
                if over <= 0.0 && high[lane] < 4.0 * self.reach {
                    (low[lane], f_low[lane]) = (high[lane], over);
                    high[lane] *= 1.5;
                } else {
                    (f_high[lane], limit[lane]) = (over.max(f64::MIN_POSITIVE), fills[lane].1);
                    found += 1;
                }
            }
            if found == count {
                break;
            }
        }
        // False position, kept honest by halving; a lost ray has no slope to use.
        let mut moved_low = [None; LANES];
        for round in 0..80 {
            let mut next = high;
            let mut wide = 0;
            for lane in 0..count {
                let span = high[lane] - low[lane];
                if span <= width * high[lane] {
                    continue;
                }
                wide += 1;
                next[lane] = if f_high[lane].is_finite() && round % 4 != 3 {
                    let slope = span / (f_high[lane] - f_low[lane]);
                    (low[lane] - f_low[lane] * slope)
                        .clamp(low[lane] + 1e-3 * span, high[lane] - 1e-3 * span)
                } else {
                    0.5 * (low[lane] + high[lane])
                };
            }
            if wide == 0 {
                break;
            }
            let fills = at(&next);
            for lane in 0..count {
                if high[lane] - low[lane] <= width * high[lane] {
                    continue;
                }
                let over = fills[lane].0 - 1.0;
                if over <= 0.0 {
                    (low[lane], f_low[lane]) = (next[lane], over);
                    if moved_low[lane] == Some(true) {
                        f_high[lane] *= 0.5;
                    }
                } else {
                    (high[lane], f_high[lane]) = (next[lane], over);
                    limit[lane] = fills[lane].1;
                    if moved_low[lane] == Some(false) {
                        f_low[lane] *= 0.5;
                    }
                }
                moved_low[lane] = Some(over <= 0.0);
            }
        }
        (0..count)
            .map(|lane| Rim {
                angle: angles[lane],
                distance: high[lane],
                point: center + high[lane] * directions[lane],
                limit: limit[lane],
            })
            .collect()
    }
}
