//! The unvignetted fraction of the area at which rays are aimed: the part from which light gets
//! through the lens.
//!
//! The polygon at which rays are aimed is a little larger than the pupil, and in a picture of few
//! samples the rays that are lost in its margin show as noise. A lost ray may be aimed again if the
//! unvignetted fraction is known: the rays that get through are then uniformly distributed over the
//! pupil alone, whose area is that of the polygon times this fraction. The fraction is measured as
//! the distance of the rim in directions around the polygon's center.

use std::iter::zip;

use glam::{DVec2, DVec3};
use ivcam_base::math::lagrange_weight;
use ivcam_base::math::lanes::{LANES, Lane};

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::patch::{biquadratic_through, quadratic_through};
use crate::lens::pupil::radial_table::RadialTable;
use crate::lens::pupil::support::{PolygonCorners, SIDES};

/// Every aim in this fraction of the area, from the center outward, must get through; otherwise the
/// unvignetted fraction is left unknown, and lost rays stay lost. It is .95 or more in all but a
/// few cases (docs/accuracy.md), so that .8 leaves room for its variation around the rim.
const INNER_FRACTION: f64 = 0.8;
/// The fractions of the area at which that is tested, each in a third of the directions, besides
/// [`INNER_FRACTION`] itself. They detect a pupil that is not open in one piece. No search is
/// recorded: they are spread over the area, and the tests
/// `as_many_aims_get_through_as_the_fraction_says` and
/// `as_many_aims_get_through_by_film_radius_as_the_fraction_says` compare the fractions with
/// counted rays.
const TESTED_FRACTIONS: [f64; 3] = [0.05, 0.3, 0.6];
/// The fraction at which the search for the rim starts, if all rays get through there; else it
/// starts at [`INNER_FRACTION`]. The nearer it is, the fewer rays are traced.
const START_FRACTION: f64 = 0.9;
/// The search for the rim ends when no direction's rim has moved by more than this. The error is
/// then far smaller: of the anamorphic lens's fractions 3e-5 (root of the mean square) on its own
/// film, and 9e-5 on one of 36×24 mm (docs/decisions/0011-measuring-a-pupil.md).
const LAST_MOVE: f64 = 6e-3;
/// The largest number of searches. Beyond a rim where rays miss a surface or are totally reflected
/// they have no fill, and the remaining area is bisected.
const MOST_SEARCHES: usize = 9;
/// The difference in the middle of a patch up to which its unvignetted fraction is linear along its
/// sides. It is below the error that the fraction has anyway (docs/accuracy.md).
const STRAIGHT: f64 = 2e-4;

/// The unvignetted fraction of the area at which rays are aimed, over a table of pupils. The
/// default is that of an unknown one.
#[derive(Clone, Debug, Default)]
pub struct Vignetting {
    /// The fraction over each patch of a table over the film's radius, as a quadratic of the
    /// coordinate in the patch; 0 where it is not known. Empty for a table over film positions,
    /// which has its own.
    pub(super) by_patch: Vec<[f64; 3]>,
    /// The weights of the fractions for the lenses of the table; empty if they are not known.
    pub(super) weights: Vec<f64>,
}

impl Vignetting {
    /// Measures the fraction for a film with rotational symmetry, at both ends and the middle of
    /// each patch.
    pub(super) fn measure(table: &RadialTable, lens: &Lens, place: &FilmPlace) -> Self {
        let at = |number: usize, t: f64| {
            let [start, end] = table.radii(number);
            let film = place.point(DVec2::new(start + t * (end - start), 0.0));
            unvignetted_fraction(lens, film, &table.polygon(number, t), true)
        };
        let over = |number: usize| {
            let values = [at(number, 0.0)?, at(number, 0.5)?, at(number, 1.0)?];
            Some(quadratic_through(values))
        };
        let by_patch = (0..table.patches.len()).map(|number| over(number).unwrap_or_default());
        Self {
            by_patch: by_patch.collect(),
            weights: vec![1.0],
        }
    }

    /// Interpolates the fractions of a table over the film's radius that were measured at three
    /// wavelengths, by a quadratic of the wavelength. They are known where all three are. Returns
    /// none for another table.
    pub fn interpolated(measured: &[(f64, Self); 3], nm: f64) -> Option<Self> {
        let at = measured.each_ref().map(|(nm, _)| *nm);
        let over = |number: usize| {
            let mut sum = [0.0; 3];
            for (k, (_, vignetting)) in measured.iter().enumerate() {
                let (weight, own) = (lagrange_weight(&at, k, nm), vignetting.by_patch.get(number));
                let own = own.copied().unwrap_or_default();
                if own == [0.0; 3] {
                    return own;
                }
                sum = std::array::from_fn(|k| sum[k] + weight * own[k]);
            }
            sum
        };
        let patches = measured[0].1.by_patch.len();
        (patches > 0).then(|| Self {
            by_patch: (0..patches).map(over).collect(),
            weights: vec![1.0],
        })
    }
}

/// Measures the unvignetted fraction of a polygon at which rays from a film point are aimed; none
/// if the polygon is not open in one piece, which is tested also well inside with `is_tested`. The
/// film point is in lens space, in millimeters.
pub(super) fn unvignetted_fraction(
    lens: &Lens,
    film: DVec3,
    polygon: &PolygonCorners,
    is_tested: bool,
) -> Option<f64> {
    const { assert!(LANES == SIDES) }
    let [corners, next] =
        [0, 1].map(|k| -> [DVec2; SIDES] { std::array::from_fn(|j| polygon.offset(j + k)) });
    let areas: Lane = std::array::from_fn(|j| corners[j].perp_dot(next[j]));
    let all = Some(areas.iter().sum()).filter(|all: &f64| *all > 0.0)?;
    let gauss = 0.5 - 0.5 / 3.0f64.sqrt();
    let mut open = 0.0;
    // Over a side of the polygon the rim is an arc, so there are two directions in each triangle,
    // at the points of Gauss's rule.
    for part in [gauss, 1.0 - gauss] {
        let ends: [DVec2; SIDES] = std::array::from_fn(|j| corners[j].lerp(next[j], part));
        let fills = |fractions: &Lane| {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            for i in 0..LANES {
                let aim = polygon.center + fractions[i].sqrt() * ends[i];
                [x[i], y[i]] = aim.to_array();
            }
            lens.fills(film, &x, &y).fill
        };
        if is_tested
            && !is_open(&fills(&std::array::from_fn(|i| {
                TESTED_FRACTIONS[i % TESTED_FRACTIONS.len()]
            })))
        {
            return None;
        }
        let rims = rims(fills)?;
        let sum: f64 = zip(&areas, &rims).map(|(area, rim)| area * rim).sum();
        open += 0.5 * sum;
        if lens.is_obstructed() {
            let closed = |end: &DVec2| {
                let parts = lens.closed_parts(film, polygon.center, *end).into_iter();
                parts.map(|[from, to]| to * to - from * from).sum::<f64>()
            };
            let closed = zip(&areas, &ends).map(|(area, end)| area * closed(end));
            open -= 0.5 * closed.sum::<f64>();
        }
    }
    Some(open / all)
}

/// Whether all rays of these fills get through.
fn is_open(fills: &Lane) -> bool {
    fills.iter().all(|fill| *fill < 1.0)
}

/// The fractions of the area up to the rim in some directions; none if the rim is too far inside.
/// `fills` returns the fills of rays at fractions of the area.
///
/// The rim is searched by false position. Where another surface begins to limit the fill, it bends,
/// and one end of the interval would stay; such an end loses weight by the rule of Anderson and
/// Björck (*A new high order method of regula falsi type for computing a root of an equation*, BIT
/// 13, 1973).
fn rims(fills: impl Fn(&Lane) -> Lane) -> Option<Lane> {
    let (mut near, mut far) = ([START_FRACTION; LANES], [1.0; LANES]);
    let mut at_start = fills(&near);
    if !is_open(&at_start) {
        near = [INNER_FRACTION; LANES];
        at_start = fills(&near);
    }
    if !is_open(&at_start) {
        return None;
    }
    // The fill less 1 at both ends, times the weights.
    let mut low = at_start.map(|fill| fill - 1.0);
    let mut high = fills(&far).map(|fill| fill - 1.0);
    // The end that moved last: −1 the near one, 1 the far one.
    let mut moved_end = [0.0; LANES];
    let mut rim = far;
    for search in 0..=MOST_SEARCHES {
        let mut moved: f64 = 0.0;
        for i in 0..LANES {
            let last = rim[i];
            rim[i] = if high[i] <= 0.0 {
                far[i]
            } else if high[i].is_finite() {
                near[i] + (far[i] - near[i]) * low[i] / (low[i] - high[i])
            } else {
                0.5 * (near[i] + far[i])
            };
            moved = moved.max((rim[i] - last).abs());
        }
        if search == MOST_SEARCHES || (search > 0 && moved < LAST_MOVE) {
            break;
        }
        let fills = fills(&rim);
        for i in 0..LANES {
            let fill = fills[i] - 1.0;
            let is_near = fill < 0.0;
            let end = if is_near { -1.0 } else { 1.0 };
            let (replaced, kept) = match is_near {
                true => (&mut low[i], &mut high[i]),
                false => (&mut high[i], &mut low[i]),
            };
            if moved_end[i] == end {
                let weight = 1.0 - fill / *replaced;
                *kept *= if weight > 0.0 { weight } else { 0.5 };
            }
            *replaced = fill;
            *(if is_near { &mut near[i] } else { &mut far[i] }) = rim[i];
            moved_end[i] = end;
        }
    }
    Some(rim)
}

/// The unvignetted fractions over a patch for some lenses, none if a value is not known. `value`
/// returns the fraction for the lens with a number at one of nine points of the patch, row by row.
///
/// The fraction of the middle lens goes through its values at the nine points. It is linear along
/// the sides of the patch if the value in the middle differs little from the mean of the corners'.
/// The difference of another lens's fraction, at another wavelength, is so smooth that it is
/// bilinear between the four corners.
pub(super) fn unvignetted_over(
    lenses: usize,
    value: impl Fn(usize, usize) -> Option<f64>,
) -> Option<Vec<[f64; 9]>> {
    let middle = lenses / 2;
    let mut values = [0.0; 9];
    for k in [0, 2, 4, 6, 8] {
        values[k] = value(middle, k)?;
    }
    let mean = |ends: [usize; 2]| 0.5 * (values[ends[0]] + values[ends[1]]);
    let straight = [[0, 2], [0, 6], [2, 8], [6, 8]].map(mean);
    let is_straight = (values[4] - 0.5 * (straight[0] + straight[3])).abs() < STRAIGHT;
    for (k, straight) in zip([1, 3, 5, 7], straight) {
        values[k] = match is_straight {
            true => straight,
            false => value(middle, k)?,
        };
    }
    let own = biquadratic_through(values);
    let of = |number: usize| {
        let mut all = own;
        if number != middle {
            let difference = |k: usize| Some(value(number, k)? - values[k]);
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
    use crate::lens::optics::film_place::Movements;
    use crate::lens::pupil::aims::Aims;
    use crate::lens::pupil::exit_pupil::{ExitPupil, ExitPupilTable};
    use crate::lens::pupil::polygon::PupilPolygon;
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
    /// the unvignetted fractions, the variance of that number, and the number of the aims.
    fn counted(lens: &Lens, target: &PupilTarget, place: &FilmPlace, seed: u64) -> [f64; 4] {
        let vignetting = target.vignetting(lens, place);
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
            target.aims(&film, &pupil, &vignetting, &mut aims);
            for (lane, (x, y)) in film[0].iter().zip(film[1]).enumerate() {
                let origin = place.point(DVec2::new(*x, y));
                let aim = DVec3::new(aims.x[lane], aims.y[lane], lens.length());
                let direction = (aim - origin).normalize();
                bundle.set(lane, &LensRay { origin, direction });
            }
            lens.trace_bundle_from_film(&mut bundle);
            for lane in bits(aims.known_vignetting()) {
                let fraction = aims.unvignetted[lane];
                passed += f64::from(bundle.through() >> lane & 1);
                expected += fraction;
                variance += fraction * (1.0 - fraction).max(0.0);
                count += 1.0;
            }
        }
        [passed, expected, variance, count]
    }

    /// The number of rays that get through is compared with the unvignetted fractions, for blades,
    /// moved film and cylinders, at one wavelength of several. Of 10 comparisons by z, a correct
    /// program exceeds 4.5 in one of 15,000 runs; the seeds are fixed. Gauss's rule is not exact
    /// for the arc of a rim, and the fraction is not a polynomial where a rim begins to cut off
    /// light: 3e-4 is allowed for each case.
    #[test]
    fn as_many_aims_get_through_as_the_fraction_says() {
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

    /// For every shipped lens with a table over the film's radius, at three stops, the number of
    /// rays that get through is compared with the unvignetted fractions, over 40,000 aims from
    /// random film points. Of about a hundred comparisons by z, a correct program exceeds 4.5 in
    /// one of 1,500 runs; the seeds are fixed. Gauss's rule is not exact for the arc of a rim: 3e-4
    /// is allowed for each case, and 1e-4 for all together.
    #[test]
    fn as_many_aims_get_through_by_film_radius_as_the_fraction_says() {
        let (mut measured, mut cases) = (0, 0);
        let mut all = [0.0; 3];
        for name in crate::lens::shipped_names() {
            for stop in [None, Some(5.6), Some(22.0)] {
                let Ok(lens) = Lens::named(name) else {
                    continue;
                };
                let lens = match stop {
                    None => Ok(lens),
                    Some(n) => lens.at_f_number(n),
                };
                let Ok(lens) = lens else { continue };
                let Ok(focus) = lens.focus(FocusMethod::Film, Meters(3.0)) else {
                    continue;
                };
                let place = FilmPlace::flat(focus.film_z);
                let pupil = ExitPupil::new(&lens, &place, 21.6);
                let ExitPupilTable::Radial(table) = &pupil.table else {
                    continue;
                };
                if pupil.secondary.is_some() {
                    continue;
                }
                cases += 1;
                let vignetting = Vignetting::measure(table, &lens, &place);
                let mut key = 1;
                let mut unit = || {
                    key = mix(key);
                    crate::sampling::unit(key)
                };
                let (mut through, mut expected, mut variance, mut count) = (0.0, 0.0, 0.0, 0.0);
                for _ in 0..40_000 {
                    let film = DVec2::new(21.6 * unit(), 0.0);
                    let aim = (unit(), unit());
                    let Some(located) = table.locate(film) else {
                        continue;
                    };
                    let [a, b, c] = vignetting.by_patch[located.patch.number];
                    let t = located.at[0];
                    let fraction = a + t * (b + t * c);
                    if fraction <= 0.0 {
                        continue;
                    }
                    let origin = place.point(film);
                    let Some(polygon) = PupilPolygon::radial(table, film) else {
                        continue;
                    };
                    let at = polygon.point(aim.0, aim.1);
                    let direction = (at.extend(lens.length()) - origin).normalize();
                    let passed = lens.trace_from_film(&LensRay { origin, direction }).is_ok();
                    through += f64::from(u8::from(passed));
                    expected += fraction;
                    variance += fraction * (1.0 - fraction);
                    count += 1.0;
                }
                measured += usize::from(count > 0.0);
                let off = through - expected;
                all = [all[0] + off, all[1] + variance, all[2] + count];
                let allowed = 4.5 * f64::sqrt(variance) + 3e-4 * count;
                assert!(
                    f64::abs(off) <= allowed,
                    "{name} {stop:?}: {through} of {count}, expected {expected}"
                );
            }
        }
        let allowed = 4.5 * f64::sqrt(all[1]) + 1e-4 * all[2];
        assert!(f64::abs(all[0]) <= allowed, "all: {all:?}");
        assert!(
            measured > cases / 2 && measured > 40,
            "{measured} of {cases}"
        );
    }

    /// A fraction that is measured has an error of about 1e-5, and 3e-4 is far more than the errors
    /// of four.
    #[test]
    fn fractions_between_three_wavelengths_are_interpolated() {
        let lens = Lens::named("takumar-50").unwrap();
        let focus = lens.focus(FocusMethod::Film, Meters(3.0)).unwrap();
        let place = FilmPlace::flat(focus.film_z);
        let pupil = ExitPupil::new(&lens, &place, 21.6);
        let ExitPupilTable::Radial(table) = &pupil.table else {
            panic!("the lens is round");
        };
        let at = |nm: f64| Vignetting::measure(table, &lens.at_wavelength(nm), &place);
        let measured = [545.0, 575.0, 605.0].map(|nm| (nm, at(nm)));
        let (own, between) = (at(562.0), Vignetting::interpolated(&measured, 562.0));
        let between = between.expect("the table is over the film's radius");
        let mut known = 0;
        for number in 0..table.patches.len() {
            let [a, b] = [&own, &between].map(|vignetting| vignetting.by_patch[number][0]);
            if a > 0.0 && b > 0.0 {
                assert!((a - b).abs() < 3e-4, "{a} {b}");
                known += 1;
            }
        }
        assert!(known > 4, "{known}");
    }

    /// The fill rises slowly up to a bend and steeply from there on, as where another surface
    /// begins to limit it. Two searches by plain false position would leave 5e-3 to 2e-2 in the
    /// mean.
    #[test]
    fn the_rim_is_found_behind_a_bend_of_the_fill() {
        let rim = |i: usize| 0.85 + 0.14 * i as f64 / LANES as f64;
        for bend in [0.0, 0.005, 0.02, 0.05] {
            let found = rims(|fractions| {
                std::array::from_fn(|i| {
                    let x = fractions[i] - rim(i);
                    1.0 + (0.4 * x).max(0.1 * x - 0.3 * bend)
                })
            });
            let found = found.expect("the rays well inside get through");
            let errors = found.iter().enumerate().map(|(i, found)| found - rim(i));
            let mean = errors.clone().sum::<f64>() / LANES as f64;
            let most = errors.fold(0.0, |most: f64, error| most.max(error.abs()));
            assert!(mean.abs() < 1e-4 && most < 1e-3, "{bend}: {mean} {most}");
        }
    }

    #[test]
    fn the_vignetting_of_the_rear_element_is_unknown() {
        let lens = Lens::named("double-gauss").unwrap();
        let target = PupilTarget::rear_element(&lens, crate::sampling::DiscMap::Polar);
        let vignetting = target.vignetting(&lens, &FilmPlace::flat(lens.length() + 70.0));
        assert!(vignetting.by_patch.is_empty() && vignetting.weights.is_empty());
    }
}
