//! The open share of the area at which rays are aimed.
//!
//! The figure at which rays are aimed is a little larger than the pupil, and in a picture of few
//! samples the rays that are lost in its margin show as noise. A lost ray may be resampled if the
//! open share of the figure is known: the rays that get through are then uniformly distributed over
//! the pupil alone, whose area is that of the figure times this share.

use glam::DVec2;

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::sides::SIDES;
use crate::lens::pupil::span::Span;
use crate::lens::pupil::spans::Spans;
use crate::lens::trace::ray::LensRay;
use crate::math::lanes::LANES;

/// The open share of a span's figure, as the coefficients of a quadratic of the mixing parameter;
/// none if it is not known.
type Share = Option<[f64; 3]>;

/// The open share of the area at which rays are aimed, by film radius.
#[derive(Clone, Debug, Default)]
pub(crate) struct PupilTransmission {
    /// The open shares of all spans of a table; empty if they are not known.
    shares: Vec<Share>,
}

/// Every aim in this share of the area, from the center outward, must get through; otherwise the
/// open share is left unknown, and lost rays stay lost. The open share of a figure is .95 or more
/// in all but a few cases (docs/accuracy.md), so that .8 leaves room for its variation around the
/// rim. A smaller value costs one more bisection for the same error.
const INNER_SHARE: f64 = 0.8;
/// The shares of the area at which that is tested, besides [`INNER_SHARE`] itself. They detect a
/// pupil that is not open in one piece, and were chosen by trial.
const TESTED_SHARES: [f64; 3] = [0.05, 0.3, 0.6];
/// The number of times that the remaining area is bisected. In each of 32 directions the error is
/// at most 0.2/2^9, or 1/2,560, and has no bias.
const BISECTIONS: usize = 8;

impl PupilTransmission {
    /// Measures the open shares for a film with rotational symmetry, at both ends and the middle of
    /// each span.
    pub(super) fn of(spans: &Spans, lens: &Lens, place: &FilmPlace) -> Self {
        let share = |number: usize, t: f64| {
            let (start, end) = (spans.start(number), spans.ends[number]);
            let film = DVec2::new(start + t * (end - start), 0.0);
            ShareProbe {
                span: &spans.spans[number],
                t,
                lens,
                place,
                film,
            }
            .share()
        };
        let quadratic = |number: usize| {
            let (low, middle, high) = (
                share(number, 0.0)?,
                share(number, 0.5)?,
                share(number, 1.0)?,
            );
            let bend = 2.0 * (low + high) - 4.0 * middle;
            Some([low, high - low - bend, bend])
        };
        Self {
            shares: (0..spans.spans.len()).map(quadratic).collect(),
        }
    }

    /// Interpolates open shares that were measured at three wavelengths of one table, by a
    /// quadratic of the wavelength. They are known where all three are.
    pub(crate) fn interpolated(measured: &[(f64, Self); 3], nm: f64) -> Self {
        let weights: [f64; 3] = std::array::from_fn(|k| {
            let others = (0..3).filter(|j| *j != k).map(|j| measured[j].0);
            others.map(|at| (nm - at) / (measured[k].0 - at)).product()
        });
        let spans = 0..measured[0].1.shares.len();
        let share = |span: usize| {
            let mut sum = [0.0; 3];
            for (weight, (_, measured)) in std::iter::zip(weights, measured) {
                let share = measured.shares[span]?;
                sum = std::array::from_fn(|k| sum[k] + weight * share[k]);
            }
            Some(sum)
        };
        Self {
            shares: spans.map(share).collect(),
        }
    }

    /// The coefficients of the open share in a span, constant first; 0 if it is not known.
    #[inline(always)]
    pub(super) fn share(&self, span: usize) -> [f64; 3] {
        let share = self.shares.get(span);
        share.copied().flatten().unwrap_or_default()
    }
}

/// Measures the open share from one film point on the +x axis.
struct ShareProbe<'a> {
    span: &'a Span,
    /// The mixing parameter in the span.
    t: f64,
    lens: &'a Lens,
    place: &'a FilmPlace,
    /// The film point, in millimeters from the film's middle.
    film: DVec2,
}

impl ShareProbe<'_> {
    /// The directions in which the rim is searched, as shares of the area around the center, with
    /// their weights.
    ///
    /// Over a side of the polygon the rim is an arc, so there are two directions in each triangle,
    /// at the points of Gauss's rule. The pupil of a film point on the +x axis is symmetric about
    /// that axis, so that half of the triangles are enough, and one direction in each of the two
    /// that the axis cuts.
    fn directions(&self) -> [(f64, f64); LANES] {
        const { assert!(LANES == SIDES) }
        let all = self.span.twice_area_before(SIDES, self.t);
        let at = |j: usize, s: f64| {
            let (from, to) = (
                self.span.twice_area_before(j, self.t),
                self.span.twice_area_before(j + 1, self.t),
            );
            ((from + s * (to - from)) / all, (to - from) / all)
        };
        let gauss = 0.5 - 0.5 / 3.0f64.sqrt();
        std::array::from_fn(|i| match i {
            0 => at(SIDES - 1, gauss),
            1 => at(SIDES / 2 - 1, gauss),
            _ if i % 2 == 0 => at(i / 2 - 1, gauss),
            _ => at(i / 2 - 1, 1.0 - gauss),
        })
    }

    /// The open share of the figure; none if the figure is not open in one piece.
    fn share(&self) -> Option<f64> {
        if !(self.span.area(self.t) > 0.0) {
            return None;
        }
        let directions = self.directions();
        let mut bundle = Bundle::default();
        for out in TESTED_SHARES.into_iter().chain([INNER_SHARE]) {
            if self.through(&directions, &[out; LANES], &mut bundle) != u32::MAX {
                return None;
            }
        }
        let (mut near, mut far) = ([INNER_SHARE; LANES], [1.0; LANES]);
        for _ in 0..BISECTIONS {
            let half = std::array::from_fn(|i| 0.5 * (near[i] + far[i]));
            let through = self.through(&directions, &half, &mut bundle);
            for (i, half) in half.into_iter().enumerate() {
                match through >> i & 1 {
                    1 => near[i] = half,
                    _ => far[i] = half,
                }
            }
        }
        // A triangle above the axis also represents its mirror image below.
        let (mut sum, mut weights) = (0.0, 0.0);
        for (i, (_, weight)) in directions.iter().enumerate() {
            sum += weight * 0.5 * (near[i] + far[i]);
            weights += weight;
        }
        Some(sum / weights)
    }

    /// Traces a ray in each direction, at the shares `out` of the area, and returns a mask of the
    /// rays that get through.
    fn through(
        &self,
        directions: &[(f64, f64); LANES],
        out: &[f64; LANES],
        bundle: &mut Bundle,
    ) -> u32 {
        let origin = self.place.point(self.film);
        for (lane, ((around, _), out)) in directions.iter().zip(out).enumerate() {
            let aim = self.span.point(self.t, *around, out.sqrt());
            let direction = (aim.extend(self.lens.length()) - origin).normalize();
            bundle.set(lane, &LensRay { origin, direction });
        }
        self.lens.trace_bundle_from_film(bundle);
        bundle.through()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::FocusMethod;
    use crate::lens::pupil::exit_pupil::{ExitPupil, Table};
    use crate::lens::pupil::target::PupilTarget;
    use crate::math::Meters;
    use crate::sampling::mix;

    /// For every shipped lens with a table over the film's radius, at three stops, the number of
    /// rays that get through is compared with the open shares, over 40,000 aims from random film
    /// points. Of about a hundred comparisons by z, a correct program exceeds 4.5 in one of 1,500
    /// runs; the seeds are fixed. Gauss's rule is not exact for the arc of a rim: 3e-4 is allowed
    /// for each case, and 1e-4 for all together.
    #[test]
    fn as_many_aims_get_through_as_the_share_says() {
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
                let Table::Radial(_, spans) = &pupil.table else {
                    continue;
                };
                if pupil.stray_region.is_some() {
                    continue;
                }
                cases += 1;
                let transmission = PupilTransmission::of(spans, &lens, &place);
                let mut key = 1;
                let mut unit = || {
                    key = mix(key);
                    (key >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
                };
                let (mut through, mut expected, mut variance, mut count) = (0.0, 0.0, 0.0, 0.0);
                for _ in 0..40_000 {
                    let film = DVec2::new(21.6 * unit(), 0.0);
                    let aim = (unit(), unit());
                    let Some((number, t)) = spans.at(film.x) else {
                        continue;
                    };
                    let [a, b, c] = transmission.share(number);
                    let share = a + t * (b + t * c);
                    if share <= 0.0 {
                        continue;
                    }
                    let origin = place.point(film);
                    let at = spans.spans[number].point(t, aim.0, aim.1.sqrt());
                    let direction = (at.extend(lens.length()) - origin).normalize();
                    let passed = lens.trace_from_film(&LensRay { origin, direction }).is_ok();
                    through += f64::from(u8::from(passed));
                    expected += share;
                    variance += share * (1.0 - share);
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

    /// A share that is measured has an error of at most 0.2/2^9 in each of 32 directions, which is
    /// 4e-5 for all; 3e-4 is far more than the errors of four.
    #[test]
    fn open_shares_between_three_wavelengths_are_interpolated() {
        let lens = Lens::named("takumar-50").unwrap();
        let focus = lens.focus(FocusMethod::Film, Meters(3.0)).unwrap();
        let place = FilmPlace::flat(focus.film_z);
        let pupil = ExitPupil::new(&lens, &place, 21.6);
        let Table::Radial(_, spans) = &pupil.table else {
            panic!("the lens is round");
        };
        let at = |nm: f64| PupilTransmission::of(spans, &lens.at_wavelength(nm), &place);
        let measured = [545.0, 575.0, 605.0].map(|nm| (nm, at(nm)));
        let (own, between) = (at(562.0), PupilTransmission::interpolated(&measured, 562.0));
        let mut known = 0;
        for (a, b) in own.shares.iter().zip(&between.shares) {
            let (Some([a, ..]), Some([b, ..])) = (a, b) else {
                continue;
            };
            assert!((a - b).abs() < 3e-4, "{a} {b}");
            known += 1;
        }
        assert!(known > 4, "{known}");
    }

    #[test]
    fn the_open_share_of_the_rear_element_is_unknown() {
        let lens = Lens::named("double-gauss").unwrap();
        let target = PupilTarget::rear_element(&lens, crate::sampling::DiscMap::Polar);
        let transmission = target.transmission(&lens, &FilmPlace::flat(lens.length() + 70.0));
        assert_eq!(transmission.share(0), [0.0; 3]);
    }
}
