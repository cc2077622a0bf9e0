//! Finds the outline of the exit pupil as seen from a film point.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::lens::pupil::polygon::{SIDES, Support};
use crate::lens::pupil::search::outline::{DIRECTIONS, Direction, OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::{InnerPoint, PupilSearch};
use crate::lens::pupil::search::rim::{RimPoint, RimRow, corner};
use crate::math::lanes::{LANES, Lane};

/// The relative width within which the outlines of a pupil table are known: a tenth of the margin
/// that the table adds.
const COARSE: f64 = 4e-4;
/// The relative width within which outlines are known where areas and irradiance are asked for.
const FINE: f64 = 1e-10;
/// A point inside of less fill than this is far enough from the rim to start from.
const OFF_THE_RIM: f64 = 0.99;
/// A guess is dropped if the nearest point of the outline is nearer to its center than this share
/// of the mean distance: directions from such a center cover the far side of the outline too thinly.
const LEAST_DISTANCE: f64 = 0.2;

impl PupilSearch<'_> {
    /// Finds the outline from a film point, or nothing if no light reaches it. `guess` comes from a
    /// neighboring film point.
    pub(crate) fn find_outline(
        &self,
        film: DVec3,
        sides: &[DVec2; SIDES],
        guess: Option<&OutlineGuess>,
    ) -> Option<PupilOutline> {
        if let Some(guess) = guess {
            let found = self.refine_guess(film, sides, guess);
            if found.is_some() {
                return found;
            }
            let center = guess.center;
            let fill = self.fill(film, center);
            let found = (fill < OFF_THE_RIM).then(|| {
                self.outline_around(InnerPoint { center, fill }, film, sides, Some(guess))
            });
            if let Some(Some(outline)) = found {
                return Some(outline);
            }
            // The neighbor's center is too near the rim here: search from nothing.
        }
        self.outline_around(self.inner_point(film)?, film, sides, None)
    }

    /// Finds the outline around the center of a guess, starting from its distances and slopes.
    /// Returns nothing if those are too far from the ones here.
    fn refine_guess(
        &self,
        film: DVec3,
        sides: &[DVec2; SIDES],
        guess: &OutlineGuess,
    ) -> Option<PupilOutline> {
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
        if nearest < LEAST_DISTANCE * mean {
            return None;
        }
        // The fill at the center as the slopes imply it, for the search of corners.
        let steepness = rims.iter().zip(&slopes);
        let inside = InnerPoint {
            center: guess.center,
            fill: steepness.fold(0.0, |most: f64, (rim, slope)| {
                most.max(1.0 - slope * rim.distance)
            }),
        };
        Some(self.outline_of(film, sides, inside, rims, slopes))
    }

    /// Finds the rim in up to one bundle of directions by the secant method, starting from the
    /// distances `at` and the slopes of the fill there. The slopes are updated. Returns nothing if
    /// the iteration goes astray.
    ///
    /// The fill is so nearly linear that two rays find a rim that is 5% away within 1e-4: the step
    /// by the neighbor's slope ends within 1e-3 of it, and the secant through both rays meets it.
    fn refine_rim_points(
        &self,
        film: DVec3,
        center: DVec2,
        directions: &[Direction],
        at: &[f64],
        slopes: &mut [f64],
        rims: &mut [RimPoint],
    ) -> Option<()> {
        /// A step longer than this share of the distance is followed by another.
        const LAST_STEP: f64 = 1e-3;
        const MOST_ROUNDS: usize = 8;
        /// The most that a slope may change the fill between the center and the rim. The slopes of
        /// a neighbor whose center was at its own rim are far steeper, and any distance would pass
        /// for the rim's.
        const STEEPEST: f64 = 4.0;
        let count = directions.len();
        let mut at: Lane = std::array::from_fn(|i| at[i.min(count - 1)]);
        let mut before: Option<(Lane, Lane)> = None;
        let mut steps = [0.0; LANES];
        for round in 0..MOST_ROUNDS {
            let aim = |i: usize| center + at[i] * directions[i.min(count - 1)].unit;
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
                    // The ray missed a surface or was totally reflected: go halfway back to the last.
                    let back = before.as_ref().map_or(0.9 * tried[i], |(last, _)| last[i]);
                    step = 0.5 * (back.min(0.99 * tried[i]) - tried[i]);
                }
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
            if round + 1 == MOST_ROUNDS {
                return None;
            }
            before = Some((tried, fills));
        }
        for (i, rim) in rims.iter_mut().enumerate() {
            rim.angle = directions[i].angle;
            // Where the limit changes from one surface to another, the secant may end a little
            // inside the rim.
            rim.distance = (1.0 + 0.25 * COARSE) * at[i] + 0.5 * steps[i];
            rim.point = center + rim.distance * directions[i].unit;
        }
        Some(())
    }

    /// Finds the outline around a point inside the pupil. Returns nothing if a guess is given and
    /// the point is too near the rim.
    fn outline_around(
        &self,
        inside: InnerPoint,
        film: DVec3,
        sides: &[DVec2; SIDES],
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
        if guess.is_some() && nearest < LEAST_DISTANCE * mean {
            return None;
        }
        let mut slopes = [0.0; DIRECTIONS];
        for (slope, rim) in slopes.iter_mut().zip(&rims) {
            *slope = (1.0 - inside.fill) / rim.distance;
        }
        Some(self.outline_of(film, sides, inside, rims, slopes))
    }

    /// Makes the outline of its rim points around a point inside.
    fn outline_of(
        &self,
        film: DVec3,
        sides: &[DVec2; SIDES],
        inside: InnerPoint,
        mut rims: Vec<RimPoint>,
        slopes: [f64; DIRECTIONS],
    ) -> PupilOutline {
        let mirrored = self.is_mirrored(film);
        let directions = self.directions(film);
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
            // The sides come in mirrored pairs. A corner may lie on the other half.
            let one = support;
            support = std::array::from_fn(|j| one[j].max(one[(SIDES - j) % SIDES]));
        }
        // The guess for the next film point starts from the center of this outline.
        let span = |j: usize| 0.5 * (support[j] - support[(j + SIDES / 2) % SIDES]);
        let (a, b) = (sides[0], sides[SIDES / 4]);
        let center = (span(SIDES / 4) * a - span(0) * b).perp() / a.perp_dot(b);
        let moved = center - inside.center;
        for (distance, direction) in distances.iter_mut().zip(directions) {
            *distance = (*distance - moved.dot(direction.unit)).max(0.1 * nearest);
        }
        let guess = OutlineGuess {
            center,
            distances,
            slopes,
        };
        PupilOutline { support, guess }
    }

    /// Finds the corners of an outline. Where a corner would lie too far from its neighbors to be
    /// known, further rim points are searched between those.
    fn corners(&self, film: DVec3, inside: InnerPoint, rims: &mut Vec<RimPoint>) -> Vec<DVec2> {
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
                    // The two edges are nearly parallel: extend each by the distance of its points.
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

    /// Finds a point inside the pupil, and the points of the outline relative to it.
    pub(crate) fn outline_points(&self, film: DVec3, count: usize) -> Option<(DVec2, Vec<DVec2>)> {
        let inside = self.inner_point(film)?;
        let rims = self.fine_rim_points(film, inside, count);
        let around = |rim: &RimPoint| rim.point - inside.center;
        Some((inside.center, rims.iter().map(around).collect()))
    }

    /// Finds the rim in evenly spaced directions, and the corners between them. Where the shadow of
    /// one surface meets that of another, a row of directions steps over the corner: between two
    /// directions that different surfaces limit, eight more are searched, and eight more between two
    /// of those.
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
                if next.limit != rim.limit && next.angle - rim.angle > 1e-6 {
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

/// The distance of the nearest point of an outline, and the mean distance.
fn nearest_and_mean(rims: &[RimPoint]) -> (f64, f64) {
    let distances = rims.iter().map(|rim| rim.distance);
    let nearest = distances.clone().fold(f64::INFINITY, f64::min);
    (nearest, distances.sum::<f64>() / rims.len() as f64)
}
