//! Finds the outline of the exit pupil as seen from a film point.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane};

use crate::lens::pupil::search::outline::{DIRECTIONS, Direction, OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::{InnerPoint, PupilSearch};
use crate::lens::pupil::search::rim::{RimPoint, RimRow, corner};
use crate::lens::pupil::support::{SIDES, Support};

/// The relative error of the rim points in a pupil table: a tenth of the margin that the table
/// adds.
const COARSE: f64 = 4e-4;
/// The relative error of the rim points from which areas and irradiance are computed.
const FINE: f64 = 1e-10;
/// A point with a fill below this is far enough inside the rim to be the center of a search. Nearer
/// to the rim, the slope from the center says nothing about the far side. No search is recorded: it
/// decides only whether the search begins at a neighbor's center or without a guess, which takes
/// more rays.
const MAX_CENTER_FILL: f64 = 0.99;
/// A guess is rejected if the nearest point of the outline is nearer to its center than this
/// fraction of the mean distance: directions from such a center cover the far side of the outline
/// too thinly. No search is recorded: a larger value rejects more guesses, which costs time, and a
/// smaller one accepts less exact outlines.
const MIN_DISTANCE: f64 = 0.2;

impl PupilSearch<'_> {
    /// Finds the outline from a film point, or returns none if no light reaches it. `guess`
    /// comes from a neighboring film point.
    pub(crate) fn find_outline(
        &self,
        film: DVec3,
        guess: Option<&OutlineGuess>,
    ) -> Option<PupilOutline> {
        if let Some(guess) = guess {
            let found = self.refine_guess(film, guess);
            if found.is_some() {
                return found;
            }
            let center = guess.center;
            let fill = self.fill(film, center);
            let inner = InnerPoint { center, fill };
            if fill < MAX_CENTER_FILL
                && let Some(outline) = self.outline_around(inner, film, Some(guess))
            {
                return Some(outline);
            }
            // The neighbor's center is too near the rim of this outline: search without a guess.
        }
        self.outline_around(self.inner_point(film)?, film, None)
    }

    /// Finds the outline around the center of a guess, starting from its distances and slopes.
    /// Returns none if the iteration from them does not converge.
    fn refine_guess(&self, film: DVec3, guess: &OutlineGuess) -> Option<PupilOutline> {
        let directions = self.directions(film);
        let mut rims = vec![RimPoint::default(); directions.len()];
        let mut slopes = guess.slopes;
        for first in (0..directions.len()).step_by(LANES) {
            let bundle = first..first + LANES;
            self.refine_rim_points(
                film,
                guess.center,
                &directions[bundle.clone()],
                &guess.distances[bundle.clone()],
                &mut slopes[bundle.clone()],
                &mut rims[bundle],
            )?;
        }
        let (nearest, mean) = nearest_and_mean(&rims);
        if nearest < MIN_DISTANCE * mean {
            return None;
        }
        // The search for corners needs the fill at the center. The slopes imply it.
        let rim_slopes = rims.iter().zip(&slopes);
        let inside = InnerPoint {
            center: guess.center,
            fill: rim_slopes.fold(0.0, |fill: f64, (rim, slope)| {
                fill.max(1.0 - slope * rim.distance)
            }),
        };
        Some(self.outline_of(film, inside, rims, slopes))
    }

    /// Finds the rim in up to one bundle of directions by the secant method, starting from the
    /// distances `at` and the slopes of the fill there. The slopes are updated. Returns none if the
    /// iteration does not converge.
    ///
    /// The fill is so nearly linear that two rays find a rim that is 5% away within 1e-4: the step
    /// by the neighbor's slope ends within 1e-3 of it, and the secant through both rays reaches it.
    fn refine_rim_points(
        &self,
        film: DVec3,
        center: DVec2,
        directions: &[Direction],
        at: &[f64],
        slopes: &mut [f64],
        rims: &mut [RimPoint],
    ) -> Option<()> {
        /// The iteration ends if all steps are shorter than this fraction of the distance. The
        /// step after it would be of the order of its square.
        const LAST_STEP: f64 = 1e-3;
        /// Nearly all outlines need two rounds; more than this means that the guess is useless.
        const MAX_ROUNDS: usize = 8;
        /// The most that the fill may rise from the center to the rim according to a slope. It
        /// rises by 1 from a center of fill 0. The slopes of a neighbor whose center was at its own
        /// rim are far steeper, and with them any distance would pass for the rim's. No search is
        /// recorded: a rejected guess costs a search without one.
        const MAX_RISE: f64 = 4.0;
        let count = directions.len();
        let mut at: Lane = std::array::from_fn(|i| at[i.min(count - 1)]);
        let mut before: Option<(Lane, Lane)> = None;
        let mut steps = [0.0; LANES];
        for round in 0..MAX_ROUNDS {
            let aim = |i: usize| center + at[i] * directions[i.min(count - 1)].unit;
            let (fills, limits) = self.fills(film, aim);
            let tested = at;
            let mut longest: f64 = 0.0;
            steps = [0.0; LANES];
            for i in 0..count {
                if let Some((last, last_fills)) = &before
                    && (tested[i] - last[i]).abs() > 1e-5 * tested[i]
                    && (fills[i] - last_fills[i]).is_finite()
                {
                    slopes[i] = (fills[i] - last_fills[i]) / (tested[i] - last[i]);
                }
                let mut step = (1.0 - fills[i]) / slopes[i];
                if fills[i].is_infinite() {
                    // The ray missed a surface or was totally reflected: go halfway back to the
                    // last distance.
                    let back = before.as_ref().map_or(0.9 * tested[i], |(last, _)| last[i]);
                    step = 0.5 * (back.min(0.99 * tested[i]) - tested[i]);
                }
                let is_slope = slopes[i] > 0.0 && slopes[i] * tested[i] < MAX_RISE;
                if !(is_slope && step.abs() < 0.5 * tested[i]) {
                    return None;
                }
                at[i] = tested[i] + step;
                steps[i] = step.abs();
                longest = longest.max(steps[i] / tested[i]);
                rims[i].limit = limits[i];
            }
            if longest < LAST_STEP {
                break;
            }
            if round + 1 == MAX_ROUNDS {
                return None;
            }
            before = Some((tested, fills));
        }
        for (i, rim) in rims.iter_mut().enumerate() {
            rim.angle = directions[i].angle;
            // Where the limiting surface changes, the secant may end a little inside the rim. The
            // point is moved outward by a quarter of the permitted error and half of the last step.
            rim.distance = (1.0 + 0.25 * COARSE) * at[i] + 0.5 * steps[i];
            rim.point = center + rim.distance * directions[i].unit;
        }
        Some(())
    }

    /// Finds the outline around a point inside the pupil. Returns none if a guess is given and the
    /// point is too near the rim.
    fn outline_around(
        &self,
        inside: InnerPoint,
        film: DVec3,
        guess: Option<&OutlineGuess>,
    ) -> Option<PupilOutline> {
        let directions = self.directions(film);
        let mut rims = vec![RimPoint::default(); directions.len()];
        let mut last = None;
        for (bundle, rims) in rims.chunks_mut(LANES).enumerate() {
            let first = bundle * LANES;
            let start = |lane: usize| guess.map(|g| g.distances[first + lane]).or(last);
            let directions = &directions[first..first + LANES];
            self.rim_points(film, inside, directions, &start, COARSE, rims);
            last = Some(rims[LANES - 1].distance);
        }
        let (nearest, mean) = nearest_and_mean(&rims);
        if guess.is_some() && nearest < MIN_DISTANCE * mean {
            return None;
        }
        let slopes = std::array::from_fn(|i| (1.0 - inside.fill) / rims[i].distance);
        Some(self.outline_of(film, inside, rims, slopes))
    }

    /// Makes the outline from its rim points around a point inside.
    fn outline_of(
        &self,
        film: DVec3,
        inside: InnerPoint,
        mut rims: Vec<RimPoint>,
        slopes: [f64; DIRECTIONS],
    ) -> PupilOutline {
        let mirrored = self.is_mirrored(film);
        let directions = self.directions(film);
        let distances: [f64; DIRECTIONS] = std::array::from_fn(|i| rims[i].distance);
        let (nearest, _) = nearest_and_mean(&rims);
        let corners = self.corners(film, inside, &mut rims);
        let mut support: [f64; SIDES] = self.normals.map(|normal| inside.center.dot(normal));
        let points = rims.iter().map(|rim| rim.point);
        for point in points.chain(corners) {
            for (support, normal) in support.iter_mut().zip(&self.normals) {
                *support = support.max(point.dot(*normal));
            }
        }
        if mirrored {
            // The sides come in mirrored pairs, and a corner may lie in the other half.
            let one = support;
            support = std::array::from_fn(|j| one[j].max(one[(SIDES - j) % SIDES]));
        }
        // The guess for the next film point starts from the center of this outline.
        let span = |j: usize| 0.5 * (support[j] - support[(j + SIDES / 2) % SIDES]);
        let (a, b) = (self.normals[0], self.normals[SIDES / 4]);
        let center = (span(SIDES / 4) * a - span(0) * b).perp() / a.perp_dot(b);
        let moved = center - inside.center;
        let moved_to = |i: usize| distances[i] - moved.dot(directions[i].unit);
        let guess = OutlineGuess {
            center,
            distances: std::array::from_fn(|i| moved_to(i).max(0.1 * nearest)),
            slopes,
        };
        let support = Support(support);
        PupilOutline { support, guess }
    }

    /// Finds the corners of an outline. Where a corner would lie too far from its neighbors to be
    /// extrapolated reliably, further rim points are searched between those and added to `rims`.
    fn corners(&self, film: DVec3, inside: InnerPoint, rims: &mut Vec<RimPoint>) -> Vec<DVec2> {
        /// The number of parts into which a gap between two rim points is divided.
        const PARTS: usize = 8;
        let mirrored = self.is_mirrored(film);
        let mut corners = Vec::new();
        for round in 0..3 {
            corners.clear();
            let mut more: Vec<(Direction, f64)> = Vec::new();
            let count = if mirrored { rims.len() - 1 } else { rims.len() };
            for third in 0..count {
                let next = (third + 1) % rims.len();
                if rims[third].limit == rims[next].limit {
                    continue;
                }
                let row = RimRow { rims, mirrored };
                let row: [RimPoint; 6] = std::array::from_fn(|k| row.at((third + k) as isize - 2));
                let [_, before, b, c, behind, _] = row;
                let room = round < 2 && more.len() + PARTS <= LANES;
                let found = corner(row, if room { 1.5 } else { f64::INFINITY });
                if found.is_none() && room && c.angle - b.angle > 1e-6 {
                    more.extend((1..PARTS).map(|j| {
                        let t = j as f64 / PARTS as f64;
                        let direction = Direction::at(b.angle + t * (c.angle - b.angle));
                        (direction, b.distance + t * (c.distance - b.distance))
                    }));
                }
                corners.extend(found);
                if found.is_none() && !room {
                    // The two edges are nearly parallel: extend each by the distance between its
                    // two nearest points.
                    let beyond = |near: RimPoint, next: RimPoint| 2.0 * near.point - next.point;
                    corners.extend([beyond(b, before), beyond(c, behind)]);
                }
            }
            if more.is_empty() {
                break;
            }
            let first = rims.len();
            let (directions, at): (Vec<Direction>, Vec<f64>) = more.into_iter().unzip();
            rims.resize(first + directions.len(), RimPoint::default());
            let mut slopes: Vec<f64> = at.iter().map(|at| (1.0 - inside.fill) / at).collect();
            let rest = &mut rims[first..];
            let center = inside.center;
            let found = self.refine_rim_points(film, center, &directions, &at, &mut slopes, rest);
            if found.is_none() {
                let guess = |lane: usize| Some(at[lane]);
                self.rim_points(film, inside, &directions, &guess, COARSE, rest);
            }
            rims.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        }
        corners
    }

    /// Finds a point inside the pupil, and points of the outline relative to it, in millimeters.
    /// `count` points have evenly spaced directions; there are more near corners. Returns none if
    /// no light reaches the film point.
    pub(crate) fn outline_points(&self, film: DVec3, count: usize) -> Option<(DVec2, Vec<DVec2>)> {
        let inside = self.inner_point(film)?;
        let rims = self.fine_rim_points(film, inside, count);
        let around = |rim: &RimPoint| rim.point - inside.center;
        Some((inside.center, rims.iter().map(around).collect()))
    }

    /// Finds the rim in `count` evenly spaced directions, and near corners in more.
    ///
    /// Where the shadow of one surface meets that of another, a row of directions misses the
    /// corner. Between two directions in which different surfaces limit the pupil, eight more are
    /// searched, and eight more between those two of them that enclose the corner. That is done
    /// for at most `count / 8` corners, because a lens of a thousand surfaces has one between any
    /// two directions.
    fn fine_rim_points(&self, film: DVec3, inside: InnerPoint, count: usize) -> Vec<RimPoint> {
        let mut rims = Vec::with_capacity(count + 64);
        let mut guess = None;
        let mut search = |angles: &[f64], rims: &mut Vec<RimPoint>| {
            for chunk in angles.chunks(LANES) {
                let directions: Vec<Direction> =
                    chunk.iter().map(|angle| Direction::at(*angle)).collect();
                let first = rims.len();
                rims.resize(first + directions.len(), RimPoint::default());
                let rest = &mut rims[first..];
                self.rim_points(film, inside, &directions, &|_| guess, FINE, rest);
                guess = rims.last().map(|rim| rim.distance);
            }
        };
        let all: Vec<f64> = (0..count).map(|i| TAU * i as f64 / count as f64).collect();
        search(&all, &mut rims);
        for _ in 0..2 {
            let mut more = Vec::new();
            for (i, rim) in rims.iter().enumerate() {
                let next = rims.get(i + 1).copied().unwrap_or(RimPoint {
                    angle: rims[0].angle + TAU,
                    ..rims[0]
                });
                let has_corner = next.limit != rim.limit && next.angle - rim.angle > 1e-6;
                if has_corner && more.len() < count {
                    let part = (next.angle - rim.angle) / 9.0;
                    more.extend((1..9).map(|j| rim.angle + f64::from(j) * part));
                }
            }
            search(&more, &mut rims);
            rims.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        }
        rims
    }
}

/// The least and the mean distance of the rim points from the center.
fn nearest_and_mean(rims: &[RimPoint]) -> (f64, f64) {
    let distances = rims.iter().map(|rim| rim.distance);
    let nearest = distances.clone().fold(f64::INFINITY, f64::min);
    (nearest, distances.sum::<f64>() / rims.len() as f64)
}
