//! Searches the rear vertex plane for a point inside the pupil, and for the rim around it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane};

use crate::lens::lens::Lens;
use crate::lens::pupil::rear_element::RearElement;
use crate::lens::pupil::search::outline::{DIRECTIONS, Direction};
use crate::lens::pupil::search::rim::{Bracket, RimPoint, close};
use crate::lens::pupil::search::secondary_openings::Downhill;
use crate::lens::pupil::support::{SideNormals, normals_along};

/// The search for a center ends at a point with a fill below this. Such a point is far enough
/// inside the pupil to measure the outline around it. No search is recorded: a smaller value costs
/// more rounds, and a value near 1 gives directions that cover the far side of the outline thinly.
const WELL_INSIDE: f64 = 0.6;
/// The number of rounds of the search downhill without rotational symmetry. The last neighborhood
/// has a radius of 0.6^24 = 5e-6 of the reach.
const ROUNDS: usize = 24;
/// The number of rounds of that search whose gain decides whether it ends. The first neighborhoods
/// are so wide that a single round often gains nothing.
const PATIENCE: usize = 4;
/// The greatest distance at which a rim is searched, in multiples of the reach. The diagonal of the
/// square that is searched for a center is 2.8 times the reach, so a rim farther away than this
/// lies outside of everything that the search covers.
const MAX_DISTANCE: f64 = 4.0;
/// The reach of a search, in multiples of the rear element's radius. A slanting ray through the
/// rear element may cross its vertex plane outside of it; how far is assumed and was not derived.
const REACH: f64 = 1.5;
/// The number of surfaces for which the grid of [`PupilSearch::grid`] is refined by one more
/// bundle. The more surfaces there are, the more often a beam can be folded. With it 2 of 8,343
/// random lenses of 2 to 40 surfaces lost rays, those of 28 and 39 surfaces
/// (docs/decisions/0011-measuring-a-pupil.md).
const SURFACES_PER_BUNDLE: usize = 28;

/// The search for the exit pupil of one lens.
pub(crate) struct PupilSearch<'a> {
    pub(super) lens: &'a Lens,
    /// The normals of the sides of every outline.
    pub normals: SideNormals,
    /// Half of the side of the square that is searched, in millimeters.
    pub(super) reach: f64,
    /// Whether the lens has rotational symmetry.
    rotational: bool,
    /// Whether light is searched finely along the meridian. A table of pupils does without: what it
    /// misses is found among the secondary openings.
    fine: bool,
    /// Whether the lens is symmetric about y = 0.
    pub(super) mirror_symmetric: bool,
    /// The number of bundles along one side of the grid on which secondary openings are searched.
    pub grid: usize,
    /// The directions over half a turn, both ends included.
    half_turn: [Direction; DIRECTIONS],
    /// The directions over the whole turn.
    full_turn: [Direction; DIRECTIONS],
}

/// The numbers of bundles that cover a line, in turn until a ray reaches all surfaces. The pupil of
/// a wide field may be a seventieth of the reach.
const BUNDLES: [usize; 3] = [3, 12, 48];

/// A point inside the pupil, and its fill.
#[derive(Clone, Copy)]
pub(super) struct InnerPoint {
    /// The point, in millimeters.
    pub center: DVec2,
    /// The fill of the ray through the point; below 1.
    pub fill: f64,
}

impl<'a> PupilSearch<'a> {
    /// The search for the exit pupil of a lens.
    pub(crate) fn new(lens: &'a Lens) -> Self {
        let rear = RearElement::new(lens, crate::sampling::DiscMap::Concentric).radius;
        Self {
            lens,
            normals: normals_along(lens.iris_edges()),
            reach: REACH * rear,
            rotational: lens.is_rotational(),
            fine: false,
            mirror_symmetric: lens.iris_edges().is_empty() && !lens.prescription().is_decentered(),
            grid: 1 + lens.prescription().surfaces.len() / SURFACES_PER_BUNDLE,
            half_turn: std::array::from_fn(|i| {
                Direction::at(PI * i as f64 / (DIRECTIONS - 1) as f64)
            }),
            full_turn: std::array::from_fn(|i| Direction::at(TAU * i as f64 / DIRECTIONS as f64)),
        }
    }

    /// The search that finds light wherever there is some, for the light on a film point.
    pub(crate) fn finely(lens: &'a Lens) -> Self {
        Self {
            fine: true,
            ..Self::new(lens)
        }
    }

    /// The number of surfaces of the lens.
    pub(crate) fn surfaces(&self) -> usize {
        self.lens.prescription().surfaces.len()
    }

    /// The fills of a bundle of aims, which `aim` returns for each lane, and the numbers of the
    /// surfaces that limit them.
    pub(super) fn fills(&self, film: DVec3, aim: impl Fn(usize) -> DVec2) -> (Lane, [u64; LANES]) {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            [x[lane], y[lane]] = aim(lane).to_array();
        }
        let fills = self.lens.fills(film, &x, &y);
        (fills.fill, fills.limit)
    }

    /// The fill of the ray from a film point to an aim.
    pub(super) fn fill(&self, film: DVec3, aim: DVec2) -> f64 {
        self.fills(film, |_| aim).0[0]
    }

    /// Whether the pupil of this film point is symmetric about y = 0.
    pub(super) fn is_mirrored(&self, film: DVec3) -> bool {
        self.rotational && film.y == 0.0
    }

    /// The directions in which the outline from a film point is searched.
    pub(super) fn directions(&self, film: DVec3) -> &[Direction] {
        match self.is_mirrored(film) {
            true => &self.half_turn,
            false => &self.full_turn,
        }
    }

    /// Whether light reaches a film point.
    pub(crate) fn is_lit(&self, film: DVec3) -> bool {
        self.inner_point(film).is_some()
    }

    /// Finds a point well inside the pupil, or returns none if no light reaches the film point.
    pub(super) fn inner_point(&self, film: DVec3) -> Option<InnerPoint> {
        let meridian = film.truncate().try_normalize().unwrap_or(DVec2::X);
        let (mut center, mut fill) = self.best_along(film, DVec2::ZERO, meridian);
        if !self.rotational && !(fill < WELL_INSIDE) {
            let within = Downhill {
                radius: self.reach,
                rounds: ROUNDS,
                enough: WELL_INSIDE,
                limit: 1.0,
                patience: PATIENCE,
            };
            (center, fill) = self.downhill(film, center, within, &|_| true);
            if fill.is_infinite() {
                (center, fill) = self.best_of_grid(film);
            }
        }
        (fill < 1.0).then_some(InnerPoint { center, fill })
    }

    /// Finds the aim of least fill on a line, and its fill. Three bundles cover the line. A
    /// fine search takes more if all their rays miss a surface and the lens has rotational
    /// symmetry, because the light is then on the meridian. The fill of a lens with strong
    /// aberrations has several valleys; a fine search goes through them from the deepest one until
    /// light is found.
    fn best_along(&self, film: DVec3, from: DVec2, direction: DVec2) -> (DVec2, f64) {
        let middle = -from.dot(direction);
        let bundles = match self.fine && self.rotational {
            true => &BUNDLES[..],
            false => &BUNDLES[..1],
        };
        let mut scan = Vec::new();
        let mut step = 0.0;
        for count in bundles.iter().map(|bundles| bundles * LANES) {
            step = 2.0 * self.reach / count as f64;
            scan.clear();
            for first in (0..count).step_by(LANES) {
                let low = middle - self.reach + first as f64 * step;
                let place = |lane: usize| low + lane as f64 * step;
                let (fills, _) = self.fills(film, |lane| from + place(lane) * direction);
                scan.extend((0..LANES).map(|lane| (place(lane), fills[lane])));
            }
            if scan.iter().any(|(_, fill)| fill.is_finite()) {
                break;
            }
        }
        let fill = |i: usize| scan.get(i).map_or(f64::INFINITY, |(_, fill)| *fill);
        let is_valley = |i: &usize| {
            fill(*i).is_finite() && fill(*i) < fill(i.wrapping_sub(1)) && fill(*i) <= fill(i + 1)
        };
        let mut valleys: Vec<usize> = (0..scan.len()).filter(is_valley).collect();
        valleys.sort_by(|i, j| fill(*i).total_cmp(&fill(*j)));
        let mut best = (middle, f64::INFINITY);
        let searched = if self.fine { valleys.len() } else { 1 };
        for i in valleys.into_iter().take(searched) {
            let found = self.least_near(film, from, direction, scan[i], step);
            if found.1 < best.1 {
                best = found;
            }
            if best.1 < 1.0 {
                break;
            }
        }
        (from + best.0 * direction, best.1)
    }

    /// Finds the place of least fill on a line near a place whose fill is known, and its fill. Each
    /// bundle covers the neighborhood of the best place so far.
    fn least_near(
        &self,
        film: DVec3,
        from: DVec2,
        direction: DVec2,
        start: (f64, f64),
        mut step: f64,
    ) -> (f64, f64) {
        const LAST: usize = LANES - 1;
        let mut best = start;
        // Each round narrows the interval by a factor of 15.5. After 12 rounds it is shorter than
        // the rounding error.
        for round in 0..12 {
            if best.1 < WELL_INSIDE || best.1.is_infinite() {
                break;
            }
            let low = best.0 - step;
            step *= 2.0 / LAST as f64;
            let place = |lane: usize| low + lane as f64 * step;
            let (fills, _) = self.fills(film, |lane| from + place(lane) * direction);
            // A convex function is nowhere below the extensions of its secants. At the ends of the
            // bundle there is no bound.
            let mut bound = f64::NEG_INFINITY;
            for (lane, fill) in fills.into_iter().enumerate() {
                if fill < best.1 {
                    best = (place(lane), fill);
                    bound = match lane {
                        1..LAST => 2.0 * fill - fills[lane - 1].max(fills[lane + 1]),
                        _ => f64::NEG_INFINITY,
                    };
                }
            }
            // No light gets through in this valley. Without rotational symmetry some may get
            // through elsewhere, and the search continues from the best aim on this line.
            if round > 1 && bound > 1.0 {
                break;
            }
        }
        best
    }

    /// Finds the aim of least fill on a grid over the reach, and its fill.
    fn best_of_grid(&self, film: DVec3) -> (DVec2, f64) {
        /// The number of aims along one side.
        const SIDE: usize = 64;
        let place = |i: usize| self.reach * (2.0 * i as f64 / (SIDE - 1) as f64 - 1.0);
        let aims = (0..SIDE * SIDE).map(|k| DVec2::new(place(k % SIDE), place(k / SIDE)));
        let aims: Vec<DVec2> = aims.collect();
        let fills = self.lens.fills_up_to([f64::INFINITY; 2], film, &aims);
        let none = (DVec2::ZERO, f64::INFINITY);
        let all = aims.into_iter().zip(fills);
        all.fold(none, |best, next| if next.1 < best.1 { next } else { best })
    }

    /// Finds the rim, where the fill is 1, in up to one bundle of directions. Each resulting point
    /// is outside the rim by less than the relative `width`. `guess` returns the distance from
    /// which the search in a lane starts.
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
        let farthest = MAX_DISTANCE * self.reach;
        let mut brackets: [Bracket; LANES] = std::array::from_fn(|lane| {
            let guess = guess(lane.min(count - 1)).filter(|g| *g > 0.0);
            let guess = guess.unwrap_or(start);
            Bracket::new(inside.fill - 1.0, guess)
        });
        let unit = |lane: usize| directions[lane.min(count - 1)].unit;
        close(&mut brackets[..count], width, farthest, |brackets| {
            let next = |lane: usize| brackets[lane.min(count - 1)].next;
            self.fills(film, |lane| inside.center + next(lane) * unit(lane))
        });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::{Medium, Prescription, Surface};

    /// From a point of the film the ball in front is seen through a 60th of the reach, and rays
    /// beside it miss its surfaces. The first bundles often miss all of it.
    #[test]
    fn a_pupil_that_is_narrower_than_the_steps_of_the_search_is_found() {
        let glass = || Medium::constant(1.5);
        let lens = Lens::new(Prescription::new(
            "ball in front of a wide plate",
            vec![
                Surface::sphere(1.0, 0.5, glass(), 0.9),
                Surface::sphere(0.0, 30.0, Medium::air(), 0.9),
                Surface::sphere(0.0, 2.0, glass(), 20.0),
                Surface::sphere(0.0, 10.0, Medium::air(), 20.0),
            ],
        ));
        let search = PupilSearch::finely(&lens);
        for i in 0..50 {
            let film = DVec3::new(0.1 * f64::from(i), 0.0, 42.5);
            assert!(search.is_lit(film), "{film}");
        }
    }
}
