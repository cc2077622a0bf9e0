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
use crate::math::lanes::Lane;

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
    /// Nothing changes when it is mirrored in y = 0.
    even: bool,
    /// Bundles along a side of the grid on which light is sought beside the pupil.
    pub grid: usize,
    half_turn: [Way; DIRECTIONS],
    full_turn: [Way; DIRECTIONS],
}

/// A direction, and its angle.
#[derive(Clone, Copy)]
struct Way {
    angle: f64,
    way: DVec2,
}

impl Way {
    fn at(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self {
            angle,
            way: DVec2::new(cos, sin),
        }
    }
}

/// What a film point sees: how far the light reaches in each of the directions asked for, and
/// where to begin from a neighboring point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub support: Support,
    pub hint: Hint,
}

/// A point inside the light, and how far from it the rim is in every direction. Around a whole
/// turn also how steeply the fill rises there, a millimeter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hint {
    center: DVec2,
    distances: [f64; DIRECTIONS],
    slopes: [f64; DIRECTIONS],
}

impl Hint {
    /// In the middle between two.
    pub fn between(a: &Seen, b: &Seen) -> Self {
        Self {
            center: a.hint.center.midpoint(b.hint.center),
            distances: std::array::from_fn(|i| 0.5 * (a.hint.distances[i] + b.hint.distances[i])),
            slopes: std::array::from_fn(|i| 0.5 * (a.hint.slopes[i] + b.hint.slopes[i])),
        }
    }
}

/// A point inside the light and how much of the tightest semi-diameter its ray uses.
#[derive(Clone, Copy)]
struct Inside {
    center: DVec2,
    fill: f64,
}

/// A point of the outline.
#[derive(Clone, Copy, Default)]
struct Rim {
    angle: f64,
    distance: f64,
    point: DVec2,
    /// The surface whose rim it is, or the edge of an iris.
    limit: u64,
}

impl<'a> Sight<'a> {
    pub fn new(lens: &'a Lens) -> Self {
        let rear = RearElement::of(lens, crate::sampling::DiscMap::Concentric).radius;
        Self {
            lens,
            reach: 1.5 * rear,
            rotational: lens.is_rotational(),
            even: lens.iris_edges().is_empty(),
            // The more surfaces, the more often a beam can be folded.
            grid: 1 + lens.prescription().surfaces.len() / 28,
            half_turn: std::array::from_fn(|i| Way::at(PI * i as f64 / (DIRECTIONS - 1) as f64)),
            full_turn: std::array::from_fn(|i| Way::at(TAU * i as f64 / DIRECTIONS as f64)),
        }
    }

    /// The fill of a bundle of aims.
    fn fills(&self, film: DVec3, aim: impl Fn(usize) -> DVec2) -> (Lane, [u64; LANES]) {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            [x[lane], y[lane]] = aim(lane).to_array();
        }
        let fills = self.lens.fills(film, &x, &y);
        (fills.fill, fills.limit)
    }

    fn fill(&self, film: DVec3, aim: DVec2) -> f64 {
        self.fills(film, |_| aim).0[0]
    }

    /// An aim well inside the light, or none where there is no light.
    fn inside(&self, film: DVec3) -> Option<Inside> {
        let fill = |aim: DVec2| self.fill(film, aim);
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
        let (center, fill) = (aim, fill(aim));
        (fill < 1.0).then_some(Inside { center, fill })
    }

    /// The aim of least fill on a line: the best of three bundles in a row, then a bundle in the
    /// neighborhood of the best, again and again.
    fn best_along(&self, film: DVec3, from: DVec2, direction: DVec2) -> DVec2 {
        let middle = -from.dot(direction);
        let mut best = (middle, f64::INFINITY);
        let look = |low: f64, step: f64, best: &mut (f64, f64)| {
            let place = |lane: usize| low + lane as f64 * step;
            let (fills, _) = self.fills(film, |lane| from + place(lane) * direction);
            for (lane, fill) in fills.into_iter().enumerate() {
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
                let aim = |i: usize| DVec2::new(place(half * LANES + i), place(j));
                let (fills, _) = self.fills(film, aim);
                for (lane, fill) in fills.into_iter().enumerate() {
                    if fill < best.1 {
                        best = (aim(lane), fill);
                    }
                }
            }
        }
        best.0
    }

    /// How far the light reaches in each direction, or none where there is none. `hint` is from
    /// a neighbor.
    pub fn seen(&self, film: DVec3, sides: &[DVec2; SIDES], hint: Option<&Hint>) -> Option<Seen> {
        if let Some(hint) = hint {
            let found = match self.is_mirrored(film) {
                true => None,
                false => self.seen_near(film, sides, hint),
            };
            if found.is_some() {
                return found;
            }
            let center = hint.center;
            let fill = self.fill(film, center);
            let found = (fill < 0.99)
                .then(|| self.seen_around(Inside { center, fill }, film, sides, Some(hint)));
            if let Some(Some(seen)) = found {
                return Some(seen);
            }
            // A neighbor's middle is too near the rim here.
        }
        self.seen_around(self.inside(film)?, film, sides, None)
    }

    /// Whether a film point sees the mirror image in y = 0 of what it sees.
    fn is_mirrored(&self, film: DVec3) -> bool {
        self.rotational && film.y == 0.0
    }

    /// What is seen around a neighbor's middle, with the neighbor's distances and slopes to begin
    /// from; none where they are too far from those here.
    ///
    /// The fill is so nearly linear that two rays find a rim that is 5% away to 1e-4: the second
    /// is by the neighbor's slope within 1e-3 of it, and the line through both meets it.
    fn seen_near(&self, film: DVec3, sides: &[DVec2; SIDES], hint: &Hint) -> Option<Seen> {
        let mut rims = vec![Rim::default(); DIRECTIONS];
        let mut slopes = hint.slopes;
        for first in [0, LANES] {
            let (rims, slopes) = (&mut rims[first..][..LANES], &mut slopes[first..][..LANES]);
            let ways = &self.full_turn[first..][..LANES];
            self.near_rims(film, hint, first, ways, slopes, rims)?;
        }
        let distances = rims.iter().map(|rim| rim.distance);
        let nearest = distances.clone().fold(f64::INFINITY, f64::min);
        let mean = distances.sum::<f64>() / DIRECTIONS as f64;
        if nearest < 0.2 * mean {
            return None;
        }
        // The fill in the middle as the slopes have it, to begin the search of corners from.
        let inside = Inside {
            center: hint.center,
            fill: (0..DIRECTIONS).fold(0.0, |most: f64, i| {
                most.max(1.0 - slopes[i] * rims[i].distance)
            }),
        };
        Some(self.seen_of(film, sides, inside, rims, slopes))
    }

    /// A bundle of rims of [`Self::seen_near`].
    fn near_rims(
        &self,
        film: DVec3,
        hint: &Hint,
        first: usize,
        ways: &[Way],
        slopes: &mut [f64],
        rims: &mut [Rim],
    ) -> Option<()> {
        /// Steps longer than this share of the distance are followed by another.
        const LAST_STEP: f64 = 2e-3;
        const MOST: usize = 4;
        let mut at: Lane = std::array::from_fn(|i| hint.distances[first + i]);
        let mut before: Option<(Lane, Lane)> = None;
        let mut limits = [0; LANES];
        for _ in 0..MOST {
            let (fills, limit) = self.fills(film, |i| hint.center + at[i] * ways[i].way);
            limits = limit;
            let tried = at;
            let mut longest: f64 = 0.0;
            for i in 0..LANES {
                if let Some((last, last_fills)) = &before
                    && (tried[i] - last[i]).abs() > 1e-5 * tried[i]
                {
                    slopes[i] = (fills[i] - last_fills[i]) / (tried[i] - last[i]);
                }
                let step = (1.0 - fills[i]) / slopes[i];
                // Lost for another reason, or no rim that way.
                if !(slopes[i] > 0.0 && step.abs() < 0.5 * tried[i]) {
                    return None;
                }
                at[i] = tried[i] + step;
                longest = longest.max(step.abs() / tried[i]);
            }
            if longest < LAST_STEP {
                break;
            }
            before = Some((tried, fills));
        }
        for (i, rim) in rims.iter_mut().enumerate() {
            let distance = (1.0 + 0.25 * COARSE) * at[i];
            *rim = Rim {
                angle: ways[i].angle,
                distance,
                point: hint.center + distance * ways[i].way,
                limit: limits[i],
            };
        }
        Some(())
    }

    /// The same from a point inside the light; none where a hint has led too near its rim.
    fn seen_around(
        &self,
        inside: Inside,
        film: DVec3,
        sides: &[DVec2; SIDES],
        hint: Option<&Hint>,
    ) -> Option<Seen> {
        let ways = match self.is_mirrored(film) {
            true => &self.half_turn,
            false => &self.full_turn,
        };
        let mut rims = vec![Rim::default(); DIRECTIONS];
        let mut mean = None;
        for (bundle, rims) in rims.chunks_mut(LANES).enumerate() {
            let first = bundle * LANES;
            let guess = |lane: usize| hint.map(|h| h.distances[first + lane]).or(mean);
            self.rims(
                film,
                inside,
                &ways[first..first + LANES],
                &guess,
                COARSE,
                rims,
            );
            mean = Some(rims[LANES - 1].distance);
        }
        let distances = rims.iter().map(|rim| rim.distance);
        let nearest = distances.clone().fold(f64::INFINITY, f64::min);
        let mean = distances.sum::<f64>() / rims.len() as f64;
        if hint.is_some() && nearest < 0.2 * mean {
            return None;
        }
        let slopes = std::array::from_fn(|i| (1.0 - inside.fill) / rims[i].distance);
        Some(self.seen_of(film, sides, inside, rims, slopes))
    }

    /// What is seen, by points of its outline around one inside.
    fn seen_of(
        &self,
        film: DVec3,
        sides: &[DVec2; SIDES],
        inside: Inside,
        mut rims: Vec<Rim>,
        slopes: [f64; DIRECTIONS],
    ) -> Seen {
        let mirrored = self.is_mirrored(film);
        let ways = match mirrored {
            true => &self.half_turn,
            false => &self.full_turn,
        };
        let distances: [f64; DIRECTIONS] = std::array::from_fn(|i| rims[i].distance);
        let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let corners = self.corners(film, inside, !mirrored, &mut rims);
        let mut support: Support = std::array::from_fn(|j| inside.center.dot(sides[j]));
        let mut add = |point: DVec2| {
            for (support, side) in support.iter_mut().zip(sides) {
                *support = support.max(point.dot(*side));
            }
        };
        let points = rims.iter().map(|rim| rim.point).chain(corners);
        points.for_each(&mut add);
        if mirrored {
            support = mirror(&support);
        }
        // The next starts in the middle of this one.
        let span = |j: usize| 0.5 * (support[j] - support[(j + SIDES / 2) % SIDES]);
        let (a, b) = (sides[0], sides[SIDES / 4]);
        let center = (span(SIDES / 4) * a - span(0) * b).perp() / a.perp_dot(b);
        let moved = center - inside.center;
        let distances =
            std::array::from_fn(|i| (distances[i] - moved.dot(ways[i].way)).max(0.1 * nearest));
        let hint = Hint {
            center,
            distances,
            slopes,
        };
        Seen { support, hint }
    }

    /// Aims at which light comes through, or nearly does, outside of the figure that is `seen`,
    /// with their fill: a beam that is folded inside the lens may come in several pieces. The
    /// fill is looked at on a grid over all that is in reach, and followed downhill from wherever
    /// it is less than all around.
    pub fn strays(
        &self,
        film: DVec3,
        seen: Option<&Seen>,
        sides: &[DVec2; SIDES],
        nearly: f64,
    ) -> Vec<(DVec2, f64)> {
        let mirrored = self.even && film.y == 0.0;
        let side = self.grid * LANES;
        let rows = if mirrored { side / 2 } else { side };
        let step = self.stride();
        let place = |i: usize, j: usize| {
            let from = |k: usize| (k as f64 + 0.5) * step;
            let y = if mirrored {
                from(j)
            } else {
                from(j) - self.reach
            };
            DVec2::new(from(i) - self.reach, y)
        };
        let outside = |p: DVec2| seen.is_none_or(|seen| is_outside(p, &seen.support, sides));
        let mut fills = Vec::with_capacity(rows * side);
        for (j, first) in (0..rows).flat_map(|j| (0..self.grid).map(move |k| (j, k * LANES))) {
            fills.extend(self.fills(film, |i| place(first + i, j)).0);
        }
        let fill = |i: usize, j: usize, di: usize, dj: usize| {
            // One more than the step, so that nothing is negative.
            let (i, j) = ((i + di).wrapping_sub(1), (j + dj).wrapping_sub(1));
            match i < side && j < rows {
                true => fills[j * side + i],
                false => f64::INFINITY,
            }
        };
        let is_lowest = |i: usize, j: usize| {
            let own = fill(i, j, 1, 1);
            own.is_finite() && (0..9).all(|k| own <= fill(i, j, k % 3, k / 3))
        };
        let lowest = (0..rows * side).map(|k| (k % side, k / side));
        lowest
            .filter(|(i, j)| is_lowest(*i, *j) && outside(place(*i, *j)))
            .map(|(i, j)| self.downhill(film, place(i, j), step, nearly, &outside))
            .filter(|(aim, fill)| {
                // Not the slope to the figure itself.
                let apart = |seen: &Seen| self.is_behind_a_ridge(film, *aim, *fill, seen);
                *fill < 1.0 || *fill < nearly && seen.is_none_or(apart)
            })
            .collect()
    }

    /// The distance of the grid's aims.
    fn stride(&self) -> f64 {
        2.0 * self.reach / (self.grid * LANES) as f64
    }

    /// The least fill of rays near one of a film point at a radius, when the film point moves as
    /// well, up to `step` at once at first; `point` makes a film point of a radius. Only rays that
    /// are `outside` count.
    pub fn least_around(
        &self,
        (radius, aim): (f64, DVec2),
        step: f64,
        point: &dyn Fn(f64) -> Option<DVec3>,
        outside: &dyn Fn(f64, DVec2) -> bool,
    ) -> ((f64, DVec2), f64) {
        let rear_z = self.lens.length();
        let (mut best, mut least) = ((radius, aim), f64::INFINITY);
        let mut size = 1.0;
        for round in 0..64 {
            let from = best;
            let near = |lane: usize| {
                // Evenly in a cube: the generalized golden ratios.
                let k = (round * LANES + lane) as f64;
                let at = [0.819_172_513, 0.671_043_607, 0.549_700_478];
                let [a, b, c] = at.map(|g| size * (2.0 * (0.5 + g * k).fract() - 1.0));
                (from.0 + step * a, from.1 + self.stride() * DVec2::new(b, c))
            };
            let mut bundle = Bundle::default();
            for lane in 0..LANES {
                let (radius, aim) = near(lane);
                if let Some(origin) = point(radius)
                    && let Some(direction) = unit(aim.extend(rear_z) - origin)
                    && outside(radius, aim)
                {
                    bundle.set(lane, &LensRay { origin, direction });
                }
            }
            let before = least;
            for (lane, fill) in self.lens.fills_of(&mut bundle).into_iter().enumerate() {
                if fill < least {
                    (best, least) = (near(lane), fill);
                }
            }
            if least < 1.0 || size < 1e-4 {
                break;
            }
            if !(least < before - 1e-3 * size) {
                size *= 0.7;
            }
        }
        (best, least)
    }

    /// Whether the fill rises on the straight way from an aim to the figure.
    fn is_behind_a_ridge(&self, film: DVec3, aim: DVec2, fill: f64, seen: &Seen) -> bool {
        let part = |lane: usize| lane as f64 / (LANES - 1) as f64;
        let (fills, _) = self.fills(film, |lane| aim.lerp(seen.hint.center, part(lane)));
        fills.iter().any(|f| !(*f <= fill + 1e-3))
    }

    /// The aim of least fill downhill of one; infinite where that leads into the figure.
    fn downhill(
        &self,
        film: DVec3,
        from: DVec2,
        step: f64,
        nearly: f64,
        outside: &dyn Fn(DVec2) -> bool,
    ) -> (DVec2, f64) {
        let (mut best, mut least) = (from, f64::INFINITY);
        let mut radius = step;
        for round in 0..12 {
            let (center, before) = (best, least);
            let aim = |lane: usize| {
                let part = lane as f64 / (LANES - 1) as f64;
                let (sin, cos) = libm::sincos(TAU * 0.381966 * lane as f64);
                center + radius * part.sqrt() * DVec2::new(cos, sin)
            };
            let (fills, _) = self.fills(film, aim);
            for (lane, fill) in fills.into_iter().enumerate() {
                if fill < least {
                    (best, least) = (aim(lane), fill);
                }
            }
            if !outside(best) {
                return (best, f64::INFINITY);
            }
            // Each step gains less than the one before.
            let hopeless = round > 2 && least - 3.0 * (before - least) > nearly;
            if least < 1.0 || hopeless {
                break;
            }
            radius *= 0.6;
        }
        (best, least)
    }

    /// The corners of an outline. Its points are put closer where one comes out too far from its
    /// neighbors to be known.
    fn corners(
        &self,
        film: DVec3,
        inside: Inside,
        closed: bool,
        rims: &mut Vec<Rim>,
    ) -> Vec<DVec2> {
        const PARTS: usize = 8;
        let mut corners = Vec::new();
        for round in 0..3 {
            corners.clear();
            let mut more: Vec<(Way, f64)> = Vec::new();
            let count = if closed { rims.len() } else { rims.len() - 1 };
            for third in 0..count {
                let at = |k: usize| {
                    let i = third + k + rims.len() - 2;
                    let turns = (i / rims.len()) as f64 - 1.0;
                    let rim = rims[i % rims.len()];
                    Rim {
                        angle: rim.angle + turns * TAU,
                        ..rim
                    }
                };
                let row: [Rim; 6] = std::array::from_fn(at);
                let [_, _, b, c, _, _] = row;
                let ends = !closed && (third < 2 || third + 3 >= rims.len());
                if b.limit == c.limit || ends {
                    continue;
                }
                let room = round < 2 && more.len() + PARTS <= LANES;
                let found = corner(row, if room { 1.5 } else { f64::INFINITY });
                if found.is_none() && room && c.angle - b.angle > 1e-6 {
                    more.extend((1..PARTS).map(|j| {
                        let t = j as f64 / PARTS as f64;
                        let way = Way::at(b.angle + t * (c.angle - b.angle));
                        (way, b.distance + t * (c.distance - b.distance))
                    }));
                }
                corners.extend(found);
                if found.is_none() && !room {
                    // Nearly the same way: as far again as the points are apart.
                    let beyond = |near: Rim, next: Rim| 2.0 * near.point - next.point;
                    corners.extend([beyond(b, row[1]), beyond(c, row[4])]);
                }
            }
            if more.is_empty() {
                break;
            }
            let first = rims.len();
            let ways: Vec<Way> = more.iter().map(|(way, _)| *way).collect();
            rims.resize(first + more.len(), Rim::default());
            let guess = |lane: usize| Some(more[lane].1);
            self.rims(film, inside, &ways, &guess, COARSE, &mut rims[first..]);
            rims.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        }
        corners
    }

    /// A point inside the light and the outline around it, counted from that point.
    pub fn outline_points(&self, film: DVec3, count: usize) -> Option<(DVec2, Vec<DVec2>)> {
        let inside = self.inside(film)?;
        let rims = self.outline(film, inside, count);
        let around = |rim: &Rim| rim.point - inside.center;
        Some((inside.center, rims.iter().map(around).collect()))
    }

    /// The outline in evenly spaced directions. Where one surface's shadow meets another's it has
    /// a corner, which a row steps over: between two directions of different surfaces eight more
    /// are sought, and eight between two of those.
    fn outline(&self, film: DVec3, inside: Inside, count: usize) -> Vec<Rim> {
        let mut rims = Vec::with_capacity(count + 64);
        let mut guess = None;
        let mut seek = |angles: &[f64], rims: &mut Vec<Rim>| {
            for chunk in angles.chunks(LANES) {
                let ways: Vec<Way> = chunk.iter().map(|angle| Way::at(*angle)).collect();
                let first = rims.len();
                rims.resize(first + ways.len(), Rim::default());
                self.rims(film, inside, &ways, &|_| guess, FINE, &mut rims[first..]);
                guess = rims.last().map(|rim| rim.distance);
            }
        };
        let all: Vec<f64> = (0..count).map(|i| TAU * i as f64 / count as f64).collect();
        seek(&all, &mut rims);
        for _ in 0..2 {
            let mut more = Vec::new();
            for (i, rim) in rims.iter().enumerate() {
                let next = rims.get(i + 1).copied().unwrap_or(Rim {
                    angle: rims[0].angle + TAU,
                    ..rims[0]
                });
                if next.limit != rim.limit && next.angle - rim.angle > 1e-6 {
                    let part = (next.angle - rim.angle) / 9.0;
                    more.extend((1..9).map(|j| rim.angle + f64::from(j) * part));
                }
            }
            seek(&more, &mut rims);
            rims.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        }
        rims
    }

    /// Where the fill becomes 1, from just outside and within a relative width, in up to a bundle
    /// of directions.
    fn rims(
        &self,
        film: DVec3,
        inside: Inside,
        ways: &[Way],
        guess: &dyn Fn(usize) -> Option<f64>,
        width: f64,
        rims: &mut [Rim],
    ) {
        let count = ways.len();
        let start = 1e-3 * self.reach;
        let mut brackets: [Bracket; LANES] = std::array::from_fn(|lane| {
            let guess = guess(lane.min(count - 1)).filter(|g| *g > 0.0);
            let guess = guess.unwrap_or(start);
            Bracket::new(inside.fill - 1.0, guess)
        });
        let way = |lane: usize| ways[lane.min(count - 1)].way;
        for round in 0..160 {
            let mut open = 0;
            for bracket in &mut brackets[..count] {
                open += usize::from(bracket.is_open(width));
                bracket.choose(width, round, 4.0 * self.reach);
            }
            if open == 0 {
                break;
            }
            let aim = |lane: usize| inside.center + brackets[lane.min(count - 1)].next * way(lane);
            let (fills, limits) = self.fills(film, aim);
            for (lane, bracket) in brackets[..count].iter_mut().enumerate() {
                if bracket.is_open(width) {
                    bracket.learn(fills[lane] - 1.0, limits[lane], 4.0 * self.reach);
                }
            }
        }
        for (lane, rim) in rims.iter_mut().enumerate() {
            let distance = brackets[lane].high;
            *rim = Rim {
                angle: ways[lane].angle,
                distance,
                point: inside.center + distance * way(lane),
                limit: brackets[lane].limit,
            };
        }
    }
}

pub(crate) fn is_outside(p: DVec2, support: &Support, sides: &[DVec2; SIDES]) -> bool {
    let mut sides = sides.iter().zip(support);
    sides.any(|(side, reach)| p.dot(*side) > *reach)
}

/// What is known of the rim in one direction: inside at `low`, outside at `high`.
#[derive(Clone, Copy)]
struct Bracket {
    low: f64,
    high: f64,
    /// The fill less 1 at both; not above 0 at `high` while nothing outside is known.
    f_low: f64,
    f_high: f64,
    /// The last two places tried, with the fill less 1.
    tried: [(f64, f64); 2],
    next: f64,
    limit: u64,
}

impl Bracket {
    fn new(f_center: f64, guess: f64) -> Self {
        Self {
            low: 0.0,
            high: guess,
            f_low: f_center,
            f_high: f64::NEG_INFINITY,
            tried: [(0.0, f_center); 2],
            next: guess,
            limit: 0,
        }
    }

    fn is_open(&self, width: f64) -> bool {
        !(self.f_high > 0.0) || self.high - self.low > width * self.high
    }

    /// Where the fill would be 1 if it were linear in the last two places.
    fn secant(&self) -> Option<f64> {
        let [(a, f), (b, g)] = self.tried;
        let root = b - g * (b - a) / (g - f);
        root.is_finite().then_some(root)
    }

    /// The next place to try. The root's own neighborhood is closed in from both sides, half of
    /// the width apart, so that two rays end a search that has come near.
    fn choose(&mut self, width: f64, round: usize, reach: f64) {
        if round == 0 {
            return;
        }
        let near = 0.45 * width * self.high;
        if !(self.f_high > 0.0) {
            let outward = 1.5 * self.low;
            let far = 4.0 * self.low;
            let root = self.secant().filter(|root| *root >= self.low && round < 6);
            self.next = root
                .map_or(outward, |root| (root + near).min(far))
                .min(reach);
            return;
        }
        let span = self.high - self.low;
        let inside = |x: &f64| *x > self.low && *x < self.high;
        let line = || self.low - self.f_low * span / (self.f_high - self.f_low);
        let root = match self.f_high.is_finite() && (round < 6 || !round.is_multiple_of(3)) {
            true => self.secant().filter(inside).unwrap_or_else(line),
            false => 0.5 * (self.low + self.high),
        };
        self.next = if root - self.low < 2.0 * near {
            self.low + 2.1 * near
        } else if self.high - root < 2.0 * near {
            self.high - 2.1 * near
        } else {
            root - near
        };
        if !inside(&self.next) {
            self.next = 0.5 * (self.low + self.high);
        }
    }

    fn learn(&mut self, over: f64, limit: u64, reach: f64) {
        self.tried = [self.tried[1], (self.next, over)];
        if over <= 0.0 && self.next < reach {
            (self.low, self.f_low) = (self.next, over);
        } else {
            (self.high, self.f_high) = (self.next, over.max(f64::MIN_POSITIVE));
            self.limit = limit;
        }
    }
}

/// The support of a figure and its mirror image in y = 0; the sides come in mirrored pairs.
fn mirror(support: &Support) -> Support {
    std::array::from_fn(|j| support[j].max(support[(SIDES - j) % SIDES]))
}

/// A corner of an outline, where one surface's shadow meets another's between the third and the
/// fourth of six points: on either side the line through the nearer two, bent as the farthest of
/// the three is from it, nearly. None where that is far from both, or farther out than so many
/// times the way between those two.
fn corner([a, b, c, d, e, f]: [Rim; 6], times: f64) -> Option<DVec2> {
    let cross = |p: DVec2, along: DVec2, q: DVec2, other: DVec2| {
        let t = (q - p).perp_dot(other) / along.perp_dot(other);
        (t > 0.0).then(|| p + t * along)
    };
    let (along, other) = (c.point - b.point, d.point - e.point);
    let straight = cross(c.point, along, d.point, other)?;
    let bent = |far: &Rim, next: &Rim, last: &Rim| {
        if far.limit != last.limit || next.limit != last.limit {
            return DVec2::ZERO;
        }
        let step = last.point - next.point;
        let (side, length) = (step.perp().normalize_or_zero(), step.length());
        let out = (straight - last.point).length();
        // Points need not be evenly spaced: the parabola through all three.
        let before = (next.point - far.point).dot(step) / length;
        let off = (far.point - next.point).dot(side);
        0.5 * off * out * (out + length) / (before * (before + length)) * side
    };
    let (p, q) = (bent(&a, &b, &c), bent(&f, &e, &d));
    let corner = cross(c.point + p, along, d.point + q, other).unwrap_or(straight);
    let gap = 2.0 * (d.point - c.point).length();
    let near = |p: DVec2, step: DVec2| (corner - p).length() <= gap.min(times * step.length());
    (near(c.point, along) && near(d.point, other)).then_some(corner)
}
