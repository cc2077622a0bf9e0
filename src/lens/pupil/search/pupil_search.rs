//! Searches the rear vertex plane for light by the fill of rays.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::outline::{DIRECTIONS, Way};
use super::rim::{Bracket, Rim};
use crate::lens::lens::Lens;
use crate::lens::pupil::rear_element::RearElement;
use crate::math::lanes::{LANES, Lane};

pub(crate) struct Sight<'a> {
    pub(super) lens: &'a Lens,
    pub(super) reach: f64,
    rotational: bool,
    /// Nothing changes when it is mirrored in y = 0.
    pub(super) even: bool,
    /// Bundles along a side of the grid on which light is sought beside the pupil.
    pub grid: usize,
    half_turn: [Way; DIRECTIONS],
    full_turn: [Way; DIRECTIONS],
}

/// A point inside the light and how much of the tightest semi-diameter its ray uses.
#[derive(Clone, Copy)]
pub(super) struct Inside {
    pub center: DVec2,
    pub fill: f64,
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
    pub(super) fn fills(&self, film: DVec3, aim: impl Fn(usize) -> DVec2) -> (Lane, [u64; LANES]) {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            [x[lane], y[lane]] = aim(lane).to_array();
        }
        let fills = self.lens.fills(film, &x, &y);
        (fills.fill, fills.limit)
    }

    pub(super) fn fill(&self, film: DVec3, aim: DVec2) -> f64 {
        self.fills(film, |_| aim).0[0]
    }

    /// An aim well inside the light, or none where there is no light.
    pub(super) fn inside(&self, film: DVec3) -> Option<Inside> {
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

    /// Whether a film point sees the mirror image in y = 0 of what it sees.
    pub(super) fn is_mirrored(&self, film: DVec3) -> bool {
        self.rotational && film.y == 0.0
    }

    pub(super) fn ways(&self, film: DVec3) -> &[Way] {
        match self.is_mirrored(film) {
            true => &self.half_turn,
            false => &self.full_turn,
        }
    }

    /// Where the fill becomes 1, from just outside and within a relative width, in up to a bundle
    /// of directions.
    pub(super) fn rims(
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
