//! The open share of the area at which rays are aimed.
//!
//! The figure at which rays are aimed is a little larger than the pupil, and in a picture of few
//! samples the rays that are lost in its margin show as noise. A lost ray may be resampled if the
//! open share of the figure is known: the rays that get through are then uniformly distributed over
//! the pupil alone, whose area is that of the figure times this share.

use glam::DVec2;
use ivcam_base::math::lagrange_weight;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::patch::quadratic_through;
use crate::lens::pupil::rim_shares::open_share;
use crate::lens::pupil::spans::Spans;

/// The open share of a span's figure, as the coefficients of a quadratic of the mixing parameter;
/// none if it is not known.
type Share = Option<[f64; 3]>;

/// The open share of the area at which rays are aimed.
#[derive(Clone, Debug, Default)]
pub enum PupilTransmission {
    /// The open shares are not known.
    #[default]
    Unknown,
    /// The open share of each span of a table over the film's radius.
    BySpan(Vec<Share>),
    /// The weights of the open shares for the lenses of a table over film positions, which has the
    /// shares.
    ByLens(Vec<f64>),
}

impl PupilTransmission {
    /// Measures the open shares for a film with rotational symmetry, at both ends and the middle of
    /// each span.
    pub(super) fn of(spans: &Spans, lens: &Lens, place: &FilmPlace) -> Self {
        let share = |number: usize, t: f64| {
            let (start, end) = (spans.start(number), spans.ends[number]);
            let film = place.point(DVec2::new(start + t * (end - start), 0.0));
            let span = &spans.spans[number];
            open_share(lens, film, &span.outline(t))
        };
        let quadratic = |number: usize| {
            let values = [
                share(number, 0.0)?,
                share(number, 0.5)?,
                share(number, 1.0)?,
            ];
            Some(quadratic_through(values))
        };
        Self::BySpan((0..spans.spans.len()).map(quadratic).collect())
    }

    /// Interpolates the open shares of a table over the film's radius that were measured at three
    /// wavelengths, by a quadratic of the wavelength. They are known where all three are. Returns
    /// none for another table.
    pub fn interpolated(measured: &[(f64, Self); 3], nm: f64) -> Option<Self> {
        let at = measured.each_ref().map(|(nm, _)| *nm);
        let [
            (_, Self::BySpan(first)),
            (_, Self::BySpan(second)),
            (_, Self::BySpan(third)),
        ] = measured
        else {
            return None;
        };
        let share = |span: usize| {
            let mut sum = [0.0; 3];
            for (k, shares) in [first, second, third].into_iter().enumerate() {
                let (weight, share) = (lagrange_weight(&at, k, nm), shares[span]?);
                sum = std::array::from_fn(|k| sum[k] + weight * share[k]);
            }
            Some(sum)
        };
        Some(Self::BySpan((0..first.len()).map(share).collect()))
    }

    /// The weights of the open shares for the lenses of a table over film positions.
    pub(super) fn weights(&self) -> &[f64] {
        match self {
            Self::ByLens(weights) => weights,
            Self::Unknown | Self::BySpan(_) => &[],
        }
    }

    /// The coefficients of the open share in a span, constant first; 0 if it is not known.
    #[inline(always)]
    pub(super) fn share(&self, span: usize) -> [f64; 3] {
        match self {
            Self::BySpan(shares) => shares[span].unwrap_or_default(),
            Self::Unknown | Self::ByLens(_) => Default::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::FocusMethod;
    use crate::lens::pupil::exit_pupil::{ExitPupil, Table};
    use crate::lens::pupil::target::PupilTarget;
    use crate::lens::trace::ray::LensRay;
    use crate::sampling::mix;
    use ivcam_base::math::Meters;

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
                    crate::sampling::unit(key)
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

    /// A share that is measured has an error of about 1e-5, and 3e-4 is far more than the errors of
    /// four.
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
        let between = between.expect("the table is over the film's radius");
        let mut known = 0;
        for span in 0..spans.spans.len() {
            let [a, b] = [&own, &between].map(|shares| shares.share(span)[0]);
            if a > 0.0 && b > 0.0 {
                assert!((a - b).abs() < 3e-4, "{a} {b}");
                known += 1;
            }
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
