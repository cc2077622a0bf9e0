//! Light beside the figure that a film point sees: a beam that is folded inside the lens may come
//! through in several pieces.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::outline::Seen;
use super::pupil_search::Sight;
use crate::lens::pupil::polygon::{SIDES, Support};
use crate::lens::trace::lanes::bundle::Bundle;
use crate::lens::trace::ray::{LensRay, unit};
use crate::math::lanes::LANES;

/// Rays that use more than this of the rear surface are not followed: those of the grid next to
/// light use at most 1 and two strides more, unless they come at a slant.
const REAR: f64 = 2.0;
/// Nor are those that use so much of another, and more by the fill of the figure that is seen over
/// so many strides: light beside is no more than so many times as narrow.
const MOST: f64 = 2.0;
const NARROWER: f64 = 12.0;

impl Sight<'_> {
    /// Aims at which light comes through, or nearly does, outside of the figure that is `seen`,
    /// with their fill: a beam that is folded inside the lens may come in several pieces. The
    /// fill is looked at on a grid over all that is in reach, and followed downhill from wherever
    /// it is less than all around. `slope` is how steeply it rises at the rim of a figure; infinite
    /// follows every ray to its end.
    pub fn strays(
        &self,
        film: DVec3,
        seen: Option<&Seen>,
        sides: &[DVec2; SIDES],
        slope: f64,
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
        let aims = (0..rows * side).map(|k| place(k % side, k / side));
        let aims: Vec<DVec2> = aims.collect();
        let most = match slope.is_finite() {
            true => [REAR, MOST + NARROWER * slope * step],
            false => [f64::INFINITY; 2],
        };
        let fills = self.lens.fills_up_to(most, film, &aims);
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
}

pub(crate) fn is_outside(p: DVec2, support: &Support, sides: &[DVec2; SIDES]) -> bool {
    let mut sides = sides.iter().zip(support);
    sides.any(|(side, reach)| p.dot(*side) > *reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::Lens;
    use crate::math::Meters;

    #[test]
    fn rays_dropped_on_their_way_are_those_of_much_fill_and_the_others_have_theirs() {
        let mut kept = 0;
        for (name, most) in [
            ("double-gauss", 1.2),
            ("phone", 20.0),
            ("canon-70-200", 4.0),
        ] {
            let lens = Lens::named(name).unwrap();
            let focus = lens.focus(crate::lens::FocusMethod::Film, Meters(10.0));
            let film = DVec3::new(1.0, 0.0, focus.unwrap().film_z);
            let sight = Sight::new(&lens);
            let place = |i: usize| {
                0.9 * sight.stride() * (DVec2::new((i % 37) as f64, (i / 37) as f64) - 18.0)
            };
            // More than go at once, and not a whole number of bundles.
            let aims: Vec<DVec2> = (0..37 * 37).map(place).collect();
            let found = lens.fills_up_to([1.35, most], film, &aims);
            for (aim, found) in aims.iter().zip(&found) {
                let fill = sight.fill(film, *aim);
                assert!(
                    *found == fill || found.is_infinite(),
                    "{name} {aim}: {found} {fill}"
                );
                // The first surface may have dropped it where the others would not.
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
