//! Finds the outline of the light that a film point sees.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::outline::{DIRECTIONS, Hint, Seen, Way};
use super::pupil_search::{Inside, Sight};
use super::rim::{Rim, Row, corner};
use crate::lens::pupil::polygon::{SIDES, Support};
use crate::math::lanes::{LANES, Lane};

/// The width within which an outline of a pupil table is known, relative.
const COARSE: f64 = 4e-4;
/// The same for areas and light.
const FINE: f64 = 1e-10;

impl Sight<'_> {
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
}

/// How far the nearest of an outline's points is, and how far they are on average.
fn nearest_and_mean(rims: &[Rim]) -> (f64, f64) {
    let distances = rims.iter().map(|rim| rim.distance);
    let nearest = distances.clone().fold(f64::INFINITY, f64::min);
    (nearest, distances.sum::<f64>() / rims.len() as f64)
}
