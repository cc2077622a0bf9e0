//! What a film point sees through a lens: the outline of the light on the rear vertex plane.
//!
//! A ray from the film is followed without blocking, and its *fill* is how much of the tightest
//! semi-diameter it uses: below 1 it gets through. The fill is continuous and nearly linear in
//! the aim, so the least fill and the outline where it is 1 are found in few rays, at f/1024 as
//! at full aperture. Rays go in bundles: a whole outline is sought at once.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

mod rim;
mod strays;

use super::lanes::LANES;
use super::pupil::{SIDES, Support};
use super::{Lens, RearElement};
use crate::math::lanes::Lane;
use rim::{Bracket, Rim, Row, corner};

pub(crate) use strays::is_outside;

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

/// A point inside the light, how far from it the rim is in every direction asked for, and how
/// steeply the fill rises there, a millimeter.
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

    pub fn center(&self) -> DVec2 {
        self.center
    }

    /// How steeply the fill rises where it does so most, a millimeter.
    pub fn slope(&self) -> f64 {
        self.slopes.into_iter().fold(0.0, f64::max)
    }

    /// The same with its middle turned about the axis, and as many times as far from it.
    pub fn turned(&self, along: DVec2) -> Self {
        Self {
            center: along.rotate(self.center),
            ..*self
        }
    }

    /// As far beyond the second as that is from the first.
    pub fn beyond(a: &Self, b: &Self) -> Self {
        Self {
            center: 2.0 * b.center - a.center,
            ..*b
        }
    }
}

/// A point inside the light and how much of the tightest semi-diameter its ray uses.
#[derive(Clone, Copy)]
struct Inside {
    center: DVec2,
    fill: f64,
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
        // The least that it can be near the best of a bundle, if it is convex there.
        let look = |low: f64, step: f64, best: &mut (f64, f64)| {
            let place = |lane: usize| low + lane as f64 * step;
            let (fills, _) = self.fills(film, |lane| from + place(lane) * direction);
            let mut at_least = f64::NEG_INFINITY;
            for (lane, fill) in fills.into_iter().enumerate() {
                if fill < best.1 {
                    *best = (place(lane), fill);
                    at_least = match lane {
                        1..31 => 2.0 * fill - fills[lane - 1].max(fills[lane + 1]),
                        _ => f64::NEG_INFINITY,
                    };
                }
            }
            at_least
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
        for round in 0..12 {
            if best.1 < 0.6 || best.1.is_infinite() {
                break;
            }
            let low = best.0 - step;
            step *= 2.0 / (LANES - 1) as f64;
            let at_least = look(low, step, &mut best);
            // Across other lines it may be less.
            if self.rotational && round > 1 && at_least > 1.0 {
                break;
            }
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
            let found = self.seen_near(film, sides, hint);
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

    fn ways(&self, film: DVec3) -> &[Way] {
        match self.is_mirrored(film) {
            true => &self.half_turn,
            false => &self.full_turn,
        }
    }

    /// What is seen around a neighbor's middle, with the neighbor's distances and slopes to begin
    /// from; none where they are too far from those here.
    fn seen_near(&self, film: DVec3, sides: &[DVec2; SIDES], hint: &Hint) -> Option<Seen> {
        let ways = self.ways(film);
        let mut rims = vec![Rim::default(); ways.len()];
        let mut slopes = hint.slopes;
        for first in (0..ways.len()).step_by(LANES) {
            let bundle = first..first + LANES;
            self.near_rims(
                film,
                hint.center,
                &ways[bundle.clone()],
                &hint.distances[bundle.clone()],
                &mut slopes[bundle.clone()],
                &mut rims[bundle],
            )?;
        }
        let (nearest, mean) = nearest_and_mean(&rims);
        if nearest < 0.2 * mean {
            return None;
        }
        // The fill in the middle as the slopes have it, to begin the search of corners from.
        let steepness = rims.iter().zip(&slopes);
        let inside = Inside {
            center: hint.center,
            fill: steepness.fold(0.0, |most: f64, (rim, slope)| {
                most.max(1.0 - slope * rim.distance)
            }),
        };
        Some(self.seen_of(film, sides, inside, rims, slopes))
    }

    /// Where the fill becomes 1 in up to a bundle of directions, near the distances `at` and by
    /// the slopes there, which come back as they are found; none where that leads astray.
    ///
    /// The fill is so nearly linear that two rays find a rim that is 5% away to 1e-4: the second
    /// is by the neighbor's slope within 1e-3 of it, and the line through both meets it.
    fn near_rims(
        &self,
        film: DVec3,
        center: DVec2,
        ways: &[Way],
        at: &[f64],
        slopes: &mut [f64],
        rims: &mut [Rim],
    ) -> Option<()> {
        /// Steps longer than this share of the distance are followed by another.
        const LAST_STEP: f64 = 1e-3;
        const MOST: usize = 8;
        /// Fill that slopes may gain from the middle to a rim: those of a neighbor seen from its
        /// own rim gain far more, and would take any distance for the rim's.
        const STEEPEST: f64 = 4.0;
        let count = ways.len();
        let mut at: Lane = std::array::from_fn(|i| at[i.min(count - 1)]);
        let mut before: Option<(Lane, Lane)> = None;
        let mut steps = [0.0; LANES];
        for round in 0..MOST {
            let aim = |i: usize| center + at[i] * ways[i.min(count - 1)].way;
            let (fills, limits) = self.fills(film, aim);
            let tried = at;
            let mut longest: f64 = 0.0;
            steps = [0.0; LANES];
            for i in 0..count {
                if let Some((last, last_fills)) = &before
                    && (tried[i] - last[i]).abs() > 1e-5 * tried[i]
                    && (fills[i] - last_fills[i]).is_finite()
                {
                    slopes[i] = (fills[i] - last_fills[i]) / (tried[i] - last[i]);
                }
                let mut step = (1.0 - fills[i]) / slopes[i];
                if fills[i].is_infinite() {
                    // Lost for another reason: on the way back to the ray before.
                    let back = before.as_ref().map_or(0.9 * tried[i], |(last, _)| last[i]);
                    step = 0.5 * (back.min(0.99 * tried[i]) - tried[i]);
                }
                // No rim that way.
                let is_slope = slopes[i] > 0.0 && slopes[i] * tried[i] < STEEPEST;
                if !(is_slope && step.abs() < 0.5 * tried[i]) {
                    return None;
                }
                at[i] = tried[i] + step;
                steps[i] = step.abs();
                longest = longest.max(steps[i] / tried[i]);
                rims[i].limit = limits[i];
            }
            if longest < LAST_STEP {
                break;
            }
            if round + 1 == MOST {
                return None;
            }
            before = Some((tried, fills));
        }
        for (i, rim) in rims.iter_mut().enumerate() {
            rim.angle = ways[i].angle;
            // Where two surfaces meet the line through two rays may end a little inside.
            rim.distance = (1.0 + 0.25 * COARSE) * at[i] + 0.5 * steps[i];
            rim.point = center + rim.distance * ways[i].way;
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
        let ways = self.ways(film);
        let mut rims = vec![Rim::default(); ways.len()];
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
        let (nearest, mean) = nearest_and_mean(&rims);
        if hint.is_some() && nearest < 0.2 * mean {
            return None;
        }
        let mut slopes = [0.0; DIRECTIONS];
        for (slope, rim) in slopes.iter_mut().zip(&rims) {
            *slope = (1.0 - inside.fill) / rim.distance;
        }
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
        let ways = self.ways(film);
        let mut distances = [0.0; DIRECTIONS];
        for (distance, rim) in distances.iter_mut().zip(&rims) {
            *distance = rim.distance;
        }
        let (nearest, _) = nearest_and_mean(&rims);
        let corners = self.corners(film, inside, &mut rims);
        let mut support: Support = std::array::from_fn(|j| inside.center.dot(sides[j]));
        let points = rims.iter().map(|rim| rim.point);
        for point in points.chain(corners) {
            for (support, side) in support.iter_mut().zip(sides) {
                *support = support.max(point.dot(*side));
            }
        }
        if mirrored {
            // Sides come in mirrored pairs. A corner may come out on the other half.
            let one = support;
            support = std::array::from_fn(|j| one[j].max(one[(SIDES - j) % SIDES]));
        }
        // The next starts in the middle of this one.
        let span = |j: usize| 0.5 * (support[j] - support[(j + SIDES / 2) % SIDES]);
        let (a, b) = (sides[0], sides[SIDES / 4]);
        let center = (span(SIDES / 4) * a - span(0) * b).perp() / a.perp_dot(b);
        let moved = center - inside.center;
        for (distance, way) in distances.iter_mut().zip(ways) {
            *distance = (*distance - moved.dot(way.way)).max(0.1 * nearest);
        }
        let hint = Hint {
            center,
            distances,
            slopes,
        };
        Seen { support, hint }
    }

    /// The corners of an outline. Its points are put closer where one comes out too far from its
    /// neighbors to be known.
    fn corners(&self, film: DVec3, inside: Inside, rims: &mut Vec<Rim>) -> Vec<DVec2> {
        const PARTS: usize = 8;
        let mirrored = self.is_mirrored(film);
        let mut corners = Vec::new();
        for round in 0..3 {
            corners.clear();
            let mut more: Vec<(Way, f64)> = Vec::new();
            let count = if mirrored { rims.len() - 1 } else { rims.len() };
            for third in 0..count {
                let next = (third + 1) % rims.len();
                if rims[third].limit == rims[next].limit {
                    continue;
                }
                let row = Row { rims, mirrored };
                let row: [Rim; 6] = std::array::from_fn(|k| row.at((third + k) as isize - 2));
                let [_, before, b, c, behind, _] = row;
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
                    corners.extend([beyond(b, before), beyond(c, behind)]);
                }
            }
            if more.is_empty() {
                break;
            }
            let first = rims.len();
            let (ways, at): (Vec<Way>, Vec<f64>) = more.into_iter().unzip();
            rims.resize(first + ways.len(), Rim::default());
            let mut slopes: Vec<f64> = at.iter().map(|at| (1.0 - inside.fill) / at).collect();
            let rest = &mut rims[first..];
            let found = self.near_rims(film, inside.center, &ways, &at, &mut slopes, rest);
            if found.is_none() {
                let guess = |lane: usize| Some(at[lane]);
                self.rims(film, inside, &ways, &guess, COARSE, rest);
            }
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

/// How far the nearest of an outline's points is, and how far they are on average.
fn nearest_and_mean(rims: &[Rim]) -> (f64, f64) {
    let distances = rims.iter().map(|rim| rim.distance);
    let nearest = distances.clone().fold(f64::INFINITY, f64::min);
    (nearest, distances.sum::<f64>() / rims.len() as f64)
}
