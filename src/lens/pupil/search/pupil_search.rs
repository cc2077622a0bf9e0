//! Searches the rear vertex plane for a point inside the pupil, and for the rim around it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::pupil::rear_element::RearElement;
use crate::lens::pupil::search::outline::{DIRECTIONS, Direction};
use crate::lens::pupil::search::rim::{Bracket, RimPoint};
use crate::math::lanes::{LANES, Lane};

/// A point of this fill is far enough inside the pupil to measure the outline around it.
const WELL_INSIDE: f64 = 0.6;
/// A round of line searches that lowers the fill by less than 2% is the last one.
const LEAST_GAIN: f64 = 0.98;
/// A rim is searched up to this many times the reach.
const FARTHEST: f64 = 4.0;

/// The search for the exit pupil of one lens.
pub(crate) struct PupilSearch<'a> {
    pub(super) lens: &'a Lens,
    /// Half of the side of the square that is searched, in millimeters.
    pub(super) reach: f64,
    rotational: bool,
    /// Whether the lens is symmetric about y = 0.
    pub(super) even: bool,
    /// Bundles along one side of the grid on which secondary openings are searched.
    pub grid: usize,
    half_turn: [Direction; DIRECTIONS],
    full_turn: [Direction; DIRECTIONS],
}

/// A point inside the pupil, and its fill.
#[derive(Clone, Copy)]
pub(super) struct InnerPoint {
    pub center: DVec2,
    pub fill: f64,
}

impl<'a> PupilSearch<'a> {
    pub(crate) fn new(lens: &'a Lens) -> Self {
        let rear = RearElement::of(lens, crate::sampling::DiscMap::Concentric).radius;
        Self {
            lens,
            // A slanting ray through the rear element may cross its vertex plane outside of it.
            reach: 1.5 * rear,
            rotational: lens.is_rotational(),
            even: lens.iris_edges().is_empty(),
            // The more surfaces there are, the more often a beam can be folded.
            grid: 1 + lens.prescription().surfaces.len() / 28,
            half_turn: std::array::from_fn(|i| {
                Direction::at(PI * i as f64 / (DIRECTIONS - 1) as f64)
            }),
            full_turn: std::array::from_fn(|i| Direction::at(TAU * i as f64 / DIRECTIONS as f64)),
        }
    }

    /// The fills of a bundle of aims, and the number of the surface that limits each.
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

    /// Whether the pupil of this film point is symmetric about y = 0.
    pub(super) fn is_mirrored(&self, film: DVec3) -> bool {
        self.rotational && film.y == 0.0
    }

    pub(super) fn directions(&self, film: DVec3) -> &[Direction] {
        match self.is_mirrored(film) {
            true => &self.half_turn,
            false => &self.full_turn,
        }
    }

    /// Finds a point well inside the pupil, or nothing if no light reaches the film point.
    pub(super) fn inner_point(&self, film: DVec3) -> Option<InnerPoint> {
        let fill = |aim: DVec2| self.fill(film, aim);
        let meridian = film.truncate().try_normalize().unwrap_or(DVec2::X);
        let mut aim = self.best_along(film, DVec2::ZERO, meridian);
        if !self.rotational && !(fill(aim) < WELL_INSIDE) {
            let mut last = f64::INFINITY;
            for _ in 0..8 {
                aim = self.best_along(film, aim, DVec2::Y);
                aim = self.best_along(film, aim, DVec2::X);
                let now = fill(aim);
                if now < WELL_INSIDE || !(now < LEAST_GAIN * last) {
                    break;
                }
                last = now;
            }
            if !(fill(aim) < 1.0) {
                aim = self.best_of_grid(film);
            }
        }
        let (center, fill) = (aim, fill(aim));
        (fill < 1.0).then_some(InnerPoint { center, fill })
    }

    /// Finds the aim of least fill on a line. Three bundles cover the line; each further bundle
    /// covers the neighborhood of the best aim so far.
    fn best_along(&self, film: DVec3, from: DVec2, direction: DVec2) -> DVec2 {
        const ROWS: usize = 3;
        const LAST: usize = LANES - 1;
        let middle = -from.dot(direction);
        let mut best = (middle, f64::INFINITY);
        // Tries a bundle, and returns a lower bound of the fill around its best aim: a convex
        // function is nowhere below the extensions of its secants.
        let try_bundle = |low: f64, step: f64, best: &mut (f64, f64)| {
            let place = |lane: usize| low + lane as f64 * step;
            let (fills, _) = self.fills(film, |lane| from + place(lane) * direction);
            let mut at_least = f64::NEG_INFINITY;
            for (lane, fill) in fills.into_iter().enumerate() {
                if fill < best.1 {
                    *best = (place(lane), fill);
                    at_least = match lane {
                        1..LAST => 2.0 * fill - fills[lane - 1].max(fills[lane + 1]),
                        _ => f64::NEG_INFINITY,
                    };
                }
            }
            at_least
        };
        let mut step = 2.0 * self.reach / (ROWS * LANES) as f64;
        for row in 0..ROWS {
            let low = middle - self.reach + (row * LANES) as f64 * step;
            try_bundle(low, step, &mut best);
        }
        // Each round narrows the line by a factor of 15. After 12 rounds only rounding is left.
        for round in 0..12 {
            if best.1 < WELL_INSIDE || best.1.is_infinite() {
                break;
            }
            let low = best.0 - step;
            step *= 2.0 / (LANES - 1) as f64;
            let at_least = try_bundle(low, step, &mut best);
            // There is no light on this line. Without rotational symmetry there may be some on
            // another line, and the search goes on from the best aim of this one.
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

    /// Finds the rim, where the fill becomes 1, in up to one bundle of directions. Each point that
    /// comes out is just outside the rim, within the relative `width`.
    pub(super) fn rim_points(
        &self,
        film: DVec3,
        inside: InnerPoint,
        directions: &[Direction],
        guess: &dyn Fn(usize) -> Option<f64>,
        width: f64,
        rims: &mut [RimPoint],
    ) {
        let count = directions.len();
        let start = 1e-3 * self.reach;
        let farthest = FARTHEST * self.reach;
        let mut brackets: [Bracket; LANES] = std::array::from_fn(|lane| {
            let guess = guess(lane.min(count - 1)).filter(|g| *g > 0.0);
            let guess = guess.unwrap_or(start);
            Bracket::new(inside.fill - 1.0, guess)
        });
        let unit = |lane: usize| directions[lane.min(count - 1)].unit;
        // From the sixth round on, every third bisects: 160 rounds narrow a bracket by 2^51.
        for round in 0..160 {
            let mut open = 0;
            for bracket in &mut brackets[..count] {
                open += usize::from(bracket.is_open(width));
                bracket.choose(width, round, farthest);
            }
            if open == 0 {
                break;
            }
            let aim = |lane: usize| inside.center + brackets[lane.min(count - 1)].next * unit(lane);
            let (fills, limits) = self.fills(film, aim);
            for (lane, bracket) in brackets[..count].iter_mut().enumerate() {
                if bracket.is_open(width) {
                    bracket.learn(fills[lane] - 1.0, limits[lane], farthest);
                }
            }
        }
        for (lane, rim) in rims.iter_mut().enumerate() {
            let distance = brackets[lane].high;
            *rim = RimPoint {
                angle: directions[lane].angle,
                distance,
                point: inside.center + distance * unit(lane),
                limit: brackets[lane].limit,
            };
        }
    }
}
