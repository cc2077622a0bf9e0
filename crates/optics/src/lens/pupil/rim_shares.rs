//! The open share of a figure at which rays are aimed: the part of its area from which light gets
//! through, measured as the distance of the rim in directions around the figure's middle.

use std::iter::zip;

use glam::{DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane};

use crate::lens::lens::Lens;
use crate::lens::pupil::patch::{Biquadratic, biquadratic_through};
use crate::lens::pupil::sides::{Outline, SIDES};

/// Every aim in this share of the area, from the middle outward, must get through; otherwise the
/// open share is left unknown, and lost rays stay lost. The open share of a figure is .95 or more
/// in all but a few cases (docs/accuracy.md), so that .8 leaves room for its variation around the
/// rim.
const INNER_SHARE: f64 = 0.8;
/// The shares of the area at which that is tested, each in a third of the directions, besides
/// [`INNER_SHARE`] itself. They detect a pupil that is not open in one piece. No search is
/// recorded: they are spread over the area, and both tests
/// `as_many_aims_get_through_as_the_share_says` compare the open shares with counted rays.
const TESTED_SHARES: [f64; 3] = [0.05, 0.3, 0.6];
/// The number of times that the rim is searched by the rule of false position. The fill is nearly
/// linear in the share of the area, so that the error is about 1e-5.
const SEARCHES: usize = 2;
/// The largest number of searches, for directions in which rays beyond the rim miss a surface or
/// are totally reflected: they have no fill, and the remaining area is bisected.
const MOST_SEARCHES: usize = 9;
/// The difference in the middle of a patch up to which its open share is linear along its sides. It
/// is below the error that the open share has anyway (docs/accuracy.md).
const STRAIGHT: f64 = 2e-4;

/// Measures the open share of a figure at which rays from a film point are aimed; none if the
/// figure is not open in one piece. The film point is in lens space, in millimeters.
pub(super) fn open_share(lens: &Lens, film: DVec3, figure: &Outline) -> Option<f64> {
    const { assert!(LANES == SIDES) }
    let [corners, next] =
        [0, 1].map(|k| -> [DVec2; SIDES] { std::array::from_fn(|j| figure.corner_offset(j + k)) });
    let areas: Lane = std::array::from_fn(|j| corners[j].perp_dot(next[j]));
    let all = Some(areas.iter().sum()).filter(|all: &f64| *all > 0.0)?;
    let gauss = 0.5 - 0.5 / 3.0f64.sqrt();
    let mut open = 0.0;
    // Over a side of the polygon the rim is an arc, so there are two directions in each triangle,
    // at the points of Gauss's rule.
    for part in [gauss, 1.0 - gauss] {
        let ends: [DVec2; SIDES] = std::array::from_fn(|j| corners[j].lerp(next[j], part));
        let rims = rims(|shares| {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            for i in 0..LANES {
                let aim = figure.center() + shares[i].sqrt() * ends[i];
                [x[i], y[i]] = aim.to_array();
            }
            lens.fills(film, &x, &y).fill
        })?;
        let sum: f64 = zip(&areas, &rims).map(|(area, rim)| area * rim).sum();
        open += 0.5 * sum;
    }
    Some(open / all)
}

/// The shares of the area up to the rim in some directions; none if the figure is not open in one
/// piece. `fills` returns the fills of rays at shares of the area.
fn rims(fills: impl Fn(&Lane) -> Lane) -> Option<Lane> {
    let tested = fills(&std::array::from_fn(|i| {
        TESTED_SHARES[i % TESTED_SHARES.len()]
    }));
    let (mut near, mut far) = ([INNER_SHARE; LANES], [1.0; LANES]);
    let mut below = fills(&near);
    if tested.iter().chain(&below).any(|fill| !(*fill < 1.0)) {
        return None;
    }
    let mut above = fills(&far);
    let mut rim = far;
    for search in 0.. {
        for i in 0..LANES {
            let (low, high) = (below[i] - 1.0, above[i] - 1.0);
            rim[i] = if high <= 0.0 {
                1.0
            } else if high.is_finite() {
                near[i] + (far[i] - near[i]) * low / (low - high)
            } else {
                0.5 * (near[i] + far[i])
            };
        }
        let is_bisected = above.iter().any(|fill| fill.is_infinite());
        if search >= MOST_SEARCHES || (search >= SEARCHES && !is_bisected) {
            break;
        }
        let fills = fills(&rim);
        for i in 0..LANES {
            match fills[i] < 1.0 {
                true => (near[i], below[i]) = (rim[i], fills[i]),
                false => (far[i], above[i]) = (rim[i], fills[i]),
            }
        }
    }
    Some(rim)
}

/// The open shares over a patch for some lenses, none if a value is not known. `share` returns the
/// share for the lens with a number at one of nine positions of the patch, row by row.
///
/// The share of the middle lens goes through its values at the nine positions. It is linear along
/// the sides of the patch if the value in the middle differs little from the mean of the corners'.
/// The difference of another lens's share, at another wavelength, is so smooth that it is bilinear
/// between the four corners.
pub(super) fn open_shares_over(
    lenses: usize,
    share: impl Fn(usize, usize) -> Option<f64>,
) -> Option<Vec<Biquadratic>> {
    let middle = lenses / 2;
    let mut values = [0.0; 9];
    for k in [0, 2, 4, 6, 8] {
        values[k] = share(middle, k)?;
    }
    let mean = |ends: [usize; 2]| 0.5 * (values[ends[0]] + values[ends[1]]);
    let straight = [[0, 2], [0, 6], [2, 8], [6, 8]].map(mean);
    let is_straight = (values[4] - 0.5 * (straight[0] + straight[3])).abs() < STRAIGHT;
    for (k, straight) in zip([1, 3, 5, 7], straight) {
        values[k] = match is_straight {
            true => straight,
            false => share(middle, k)?,
        };
    }
    let own = biquadratic_through(values);
    let of = |number: usize| {
        let mut all = own;
        if number != middle {
            let difference = |k: usize| Some(share(number, k)? - values[k]);
            let [a, b, c, d] = [
                difference(0)?,
                difference(2)?,
                difference(6)?,
                difference(8)?,
            ];
            for (k, more) in [(0, a), (1, b - a), (3, c - a), (4, a - b - c + d)] {
                all[k] += more;
            }
        }
        Some(all)
    };
    (0..lenses).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::lanes::bundle::Bundle;
    use crate::lens::optics::film_place::{FilmPlace, Movements};
    use crate::lens::pupil::aims::Aims;
    use crate::lens::pupil::exit_pupil::ExitPupil;
    use crate::lens::pupil::target::PupilTarget;
    use crate::lens::trace::ray::LensRay;
    use crate::lens::{FocusMethod, Iris};
    use crate::sampling::mix;
    use ivcam_base::math::Meters;
    use ivcam_base::math::lanes::bits;

    /// The film's half diagonal, in millimeters.
    const REACH: f64 = 21.6;

    /// The number of packets of aims for each case.
    const PACKETS: u32 = 4000;

    /// Returns the lens at three wavelengths, in nanometers, and the target of all. With one index
    /// it is the lens's own target.
    fn target(lens: &Lens, place: &FilmPlace) -> PupilTarget {
        if !lens.prescription().is_dispersive() {
            return PupilTarget::exit_pupil_of(lens, place, REACH);
        }
        let at = |nm: f64| ExitPupil::new(&lens.at_wavelength(nm), place, REACH);
        let [blue, red] = [420.0, 680.0].map(at);
        let own = ExitPupil::new(lens, place, REACH);
        PupilTarget::ExitPupil(Box::new(ExitPupil::around(&[&blue, &own, &red])))
    }

    /// Returns how many of the aims from random film points get through, how many are expected by
    /// the open shares, the variance of that number, and the number of the aims.
    fn counted(lens: &Lens, target: &PupilTarget, place: &FilmPlace, seed: u64) -> [f64; 4] {
        let transmission = target.transmission(lens, place);
        let mut key = seed;
        let mut unit = || {
            key = mix(key);
            crate::sampling::unit(key)
        };
        let [mut passed, mut expected, mut variance, mut count] = [0.0; 4];
        let (mut aims, mut bundle) = (Aims::default(), Bundle::default());
        for _ in 0..PACKETS {
            let mut places = |size: f64| [(); LANES].map(|()| size * (unit() - 0.5));
            let film = [places(36.0), places(24.0)];
            let pupil = [(); 2].map(|()| [(); LANES].map(|()| unit()));
            target.aims(&film, &pupil, &transmission, &mut aims);
            for (lane, (x, y)) in film[0].iter().zip(film[1]).enumerate() {
                let origin = place.point(DVec2::new(*x, y));
                let aim = DVec3::new(aims.x[lane], aims.y[lane], lens.length());
                let direction = (aim - origin).normalize();
                bundle.set(lane, &LensRay { origin, direction });
            }
            lens.trace_bundle_from_film(&mut bundle);
            for lane in bits(aims.known_shares()) {
                let share = aims.open_share[lane];
                passed += f64::from(bundle.through() >> lane & 1);
                expected += share;
                variance += share * (1.0 - share).max(0.0);
                count += 1.0;
            }
        }
        [passed, expected, variance, count]
    }

    /// The number of rays that get through is compared with the open shares, for blades, moved film
    /// and cylinders, at one wavelength of several. Of 10 comparisons by z, a correct program
    /// exceeds 4.5 in one of 15,000 runs; the seeds are fixed. Gauss's rule is not exact for the
    /// arc of a rim, and the share is not a polynomial where a rim begins to cut off light: 3e-4 is
    /// allowed for each case.
    #[test]
    fn as_many_aims_get_through_as_the_share_says() {
        let tilted = Movements {
            tilt: 0.08,
            rise: 4.0,
            ..Movements::default()
        };
        let still = Movements::default();
        let cases = [
            ("double-gauss", 2.0, 6, still),
            ("double-gauss", 8.0, 6, tilted),
            ("double-gauss", 2.8, 0, tilted),
            ("tessar", 8.0, 5, still),
            ("wide-angle", 5.6, 7, still),
            ("flektogon", 4.0, 0, tilted),
            ("flektogon", 5.6, 6, still),
            ("biogon", 11.0, 9, still),
            ("anamorphic", 5.6, 0, still),
            ("anamorphic", 5.6, 6, tilted),
        ];
        for (seed, (name, stop, blades, moved)) in (1..).zip(cases) {
            let lens = Lens::named(name).unwrap();
            let lens = lens.at_f_number(stop).unwrap_or(lens);
            let rotation = 0.2;
            let lens = match blades {
                0 => lens,
                count => lens.with_iris(Iris::Blades { count, rotation }),
            };
            let focus = lens.focus(FocusMethod::Film, Meters(3.0)).unwrap();
            let format = crate::film::FilmFormat::STANDARD;
            let place = FilmPlace::new(&lens, &focus, &moved, format).unwrap();
            let target = target(&lens, &place);
            let at = match lens.prescription().is_dispersive() {
                true => lens.at_wavelength(555.0),
                false => lens,
            };
            let [passed, expected, variance, count] = counted(&at, &target, &place, seed);
            assert!(count > 50_000.0, "{name}: {count}");
            let allowed = 4.5 * variance.sqrt() + 3e-4 * count;
            assert!(
                (passed - expected).abs() <= allowed,
                "{name} {blades}: {passed} of {count}, expected {expected}"
            );
        }
    }
}
