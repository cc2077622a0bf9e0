//! Searches for secondary openings: parts of the rear vertex plane outside the outline of the pupil
//! through which light reaches a film point. A beam that is folded inside the lens comes through in
//! several pieces.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use ivcam_base::math::lanes::LANES;
use ivcam_base::work;

use crate::lens::lanes::bundle::Bundle;
use crate::lens::pupil::search::outline::PupilOutline;
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::trace::ray::{LensRay, unit};

/// Rays of the grid with a greater fill at the rear surface are dropped. The grid reaches 1.5 times
/// the rear radius, and a ray next to an opening has a fill of at most 1 and two grid steps more
/// (3/16 for one bundle a side), unless it is slanting. The record is that of
/// [`MAX_FILL_ELSEWHERE`].
const MAX_FILL_AT_REAR: f64 = 2.0;
/// Rays of the grid with a greater fill at another surface are dropped as well: this value, plus
/// the rise of the fill at the rim of the pupil over [`RISE_STEPS`] grid steps. A smaller sum drops
/// rays next to narrow openings, and a greater one traces more rays to their end. With both values,
/// 2 of 8,343 random lenses lost rays (docs/decisions/0011-measuring-a-pupil.md).
const MAX_FILL_ELSEWHERE: f64 = 2.0;
/// The number of grid steps of [`MAX_FILL_ELSEWHERE`]. The slope of the fill around a secondary
/// opening may be about this many times as steep as at the rim of the pupil.
const RISE_STEPS: f64 = 12.0;
/// The golden angle as a fraction of a turn, (3 − √5)/2. Points at its multiples cover a disc
/// evenly.
const GOLDEN_ANGLE: f64 = 0.381966;
/// The factor by which the neighborhood of [`PupilSearch::downhill`] shrinks in a round. The 32
/// points of a round are about 0.3 of its radius apart, so that the minimum is nearly always in the
/// smaller neighborhood. With it the search for a dark film point traces 1,000 rays instead of
/// 8,000 (docs/decisions/0011-measuring-a-pupil.md).
const DOWNHILL_SHRINK: f64 = 0.6;
/// The number of rounds of [`PupilSearch::downhill`]: 0.6^12 is 1/459 of a grid step.
const DOWNHILL_ROUNDS: usize = 12;
/// The factor by which the neighborhood of [`PupilSearch::least_around`] shrinks after a round of
/// little gain. The 32 points of a round are about 0.6 of half its side apart in three dimensions.
/// No search is recorded: a larger value needs more rounds, and a smaller one may lose the minimum.
const AROUND_SHRINK: f64 = 0.7;
/// The greatest number of rounds of [`PupilSearch::least_around`]. It shrinks 26 times at most.
const AROUND_ROUNDS: usize = 64;

/// The extent of a search by [`PupilSearch::downhill`].
#[derive(Clone, Copy)]
pub(super) struct Downhill {
    /// The radius of the first neighborhood, in millimeters.
    pub radius: f64,
    /// The greatest number of rounds.
    pub rounds: usize,
    /// The search ends at a fill below this.
    pub enough: f64,
    /// The search ends if the fill cannot fall below this.
    pub limit: f64,
    /// The number of rounds over which the gain is measured from which that is concluded.
    pub patience: usize,
}

/// A ray, given by the film radius at which it starts and its aim, both in millimeters.
pub(crate) type RadiusAndAim = (f64, DVec2);

impl PupilSearch<'_> {
    /// Finds aims outside the `outline` of the pupil at which the fill is below `fill_limit`, with
    /// their fills. Where the fill is below 1, light comes through.
    ///
    /// The fill is measured on a grid over the reach, and followed downhill from every local
    /// minimum. `slope` is the slope of the fill at the rim of a pupil, per millimeter; if it is
    /// infinite, every ray is traced to its end.
    pub(crate) fn secondary_openings(
        &self,
        film: DVec3,
        outline: Option<&PupilOutline>,
        slope: f64,
        fill_limit: f64,
    ) -> Vec<(DVec2, f64)> {
        if work::is_cut() {
            return Vec::new(); // No ray would get through.
        }
        let mirrored = self.mirror_symmetric && film.y == 0.0;
        let side = self.grid * LANES;
        let rows = if mirrored { side / 2 } else { side };
        let step = self.grid_step();
        let place = |i: usize, j: usize| {
            let from = |k: usize| (k as f64 + 0.5) * step;
            let y = if mirrored {
                from(j)
            } else {
                from(j) - self.reach
            };
            DVec2::new(from(i) - self.reach, y)
        };
        let outside =
            |p: DVec2| outline.is_none_or(|outline| outline.support.is_outside(p, &self.normals));
        let aims = (0..rows * side).map(|k| place(k % side, k / side));
        let aims: Vec<DVec2> = aims.collect();
        let max_fills = match slope.is_finite() {
            true => [
                MAX_FILL_AT_REAR,
                MAX_FILL_ELSEWHERE + RISE_STEPS * slope * step,
            ],
            false => [f64::INFINITY; 2],
        };
        let fills = self.lens.fills_up_to(max_fills, film, &aims);
        let fill = |i: usize, j: usize, di: usize, dj: usize| {
            // The offsets are 0 to 2, so that they are not negative; 1 is the point itself.
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
        let within = Downhill {
            radius: step,
            rounds: DOWNHILL_ROUNDS,
            enough: 1.0,
            limit: fill_limit,
            patience: 1,
        };
        let lowest = (0..rows * side).map(|k| (k % side, k / side));
        lowest
            .filter(|(i, j)| is_lowest(*i, *j) && outside(place(*i, *j)))
            .map(|(i, j)| self.downhill(film, place(i, j), within, &outside))
            .filter(|(aim, fill)| {
                // An aim on the slope of the pupil itself is not an opening of its own.
                let apart =
                    |outline: &PupilOutline| self.is_behind_a_ridge(film, *aim, *fill, outline);
                *fill < 1.0 || *fill < fill_limit && outline.is_none_or(apart)
            })
            .collect()
    }

    /// The distance between neighboring aims of the grid, in millimeters.
    fn grid_step(&self) -> f64 {
        2.0 * self.reach / (self.grid * LANES) as f64
    }

    /// Finds the ray of least fill near a given one, with its fill. The film point may move as
    /// well, at first by up to `step` millimeters in a round. `film_point` returns the film point
    /// of a radius. Only rays that are `outside` count.
    ///
    /// The best ray of a bundle becomes the center of the next. If the fill decreases by less than
    /// a thousandth of the size of the neighborhood, the neighborhood shrinks by [`AROUND_SHRINK`].
    pub(crate) fn least_around(
        &self,
        (radius, aim): RadiusAndAim,
        step: f64,
        film_point: &dyn Fn(f64) -> Option<DVec3>,
        outside: &dyn Fn(f64, DVec2) -> bool,
    ) -> (RadiusAndAim, f64) {
        let rear_z = self.lens.length();
        let (mut best, mut least) = ((radius, aim), f64::INFINITY);
        let mut size = 1.0;
        for round in 0..AROUND_ROUNDS {
            let from = best;
            let near = |lane: usize| {
                // Points that cover a cube evenly: multiples of the inverse powers of the
                // generalized golden ratio in three dimensions (Roberts's R sequence).
                let k = (round * LANES + lane) as f64;
                let at = [0.819_172_513, 0.671_043_607, 0.549_700_478];
                let [a, b, c] = at.map(|g| size * (2.0 * (0.5 + g * k).fract() - 1.0));
                (
                    from.0 + step * a,
                    from.1 + self.grid_step() * DVec2::new(b, c),
                )
            };
            let mut bundle = Bundle::default();
            for lane in 0..LANES {
                let (radius, aim) = near(lane);
                if let Some(origin) = film_point(radius)
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
                size *= AROUND_SHRINK;
            }
        }
        (best, least)
    }

    /// Whether the fill rises above that of an aim somewhere on the straight line from the aim to
    /// the center of the pupil.
    fn is_behind_a_ridge(
        &self,
        film: DVec3,
        aim: DVec2,
        fill: f64,
        outline: &PupilOutline,
    ) -> bool {
        let part = |lane: usize| lane as f64 / (LANES - 1) as f64;
        let (fills, _) = self.fills(film, |lane| aim.lerp(outline.guess.center, part(lane)));
        fills.iter().any(|f| !(*f <= fill + 1e-3))
    }

    /// Follows the fill downhill from an aim, and returns the aim of least fill and its fill. The
    /// fill is infinite if that leads to an aim that is not `outside`, into the pupil.
    pub(super) fn downhill(
        &self,
        film: DVec3,
        from: DVec2,
        within: Downhill,
        outside: &dyn Fn(DVec2) -> bool,
    ) -> (DVec2, f64) {
        let (mut best, mut least) = (from, f64::INFINITY);
        let mut radius = within.radius;
        // The least fills before each round, after as many that stand for the time before.
        let mut history = vec![f64::INFINITY; within.patience - 1];
        for round in 0..within.rounds {
            history.push(least);
            let (center, before) = (best, history[round]);
            let aim = |lane: usize| {
                let part = lane as f64 / (LANES - 1) as f64;
                let (sin, cos) = libm::sincos(TAU * GOLDEN_ANGLE * lane as f64);
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
            // The neighborhood shrinks by 0.6 in a round, and so does the gain: all further rounds
            // together gain 1.5 times as much as this one. Three times leaves room for irregular
            // ones.
            let hopeless = round > 2 && least - 3.0 * (before - least) > within.limit;
            if least < within.enough || hopeless {
                break;
            }
            radius *= DOWNHILL_SHRINK;
        }
        (best, least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::Lens;
    use ivcam_base::math::Meters;

    #[test]
    fn only_rays_of_large_fill_are_dropped_and_the_others_keep_their_fill() {
        let mut kept = 0;
        for (name, most) in [
            ("double-gauss", 1.2),
            ("phone", 20.0),
            ("canon-70-200", 4.0),
        ] {
            let lens = Lens::named(name).unwrap();
            let focus = lens.focus(crate::lens::FocusMethod::Film, Meters(10.0));
            let film = DVec3::new(1.0, 0.0, focus.unwrap().film_z);
            let search = PupilSearch::new(&lens);
            let place = |i: usize| {
                0.9 * search.grid_step() * (DVec2::new((i % 37) as f64, (i / 37) as f64) - 18.0)
            };
            // More aims than are traced at once, and not a whole number of bundles.
            let aims: Vec<DVec2> = (0..37 * 37).map(place).collect();
            let found = lens.fills_up_to([1.35, most], film, &aims);
            for (aim, found) in aims.iter().zip(&found) {
                let fill = search.fill(film, *aim);
                assert!(
                    *found == fill || found.is_infinite(),
                    "{name} {aim}: {found} {fill}"
                );
                // The first surface may drop a ray that the others would not.
                assert!(
                    found.is_finite() || fill > most.min(1.35),
                    "{name} {aim}: {fill}"
                );
                kept += usize::from(found.is_finite());
            }
        }
        assert!(kept > 20, "{kept}");
    }
}
