//! Measures the pupil's outline, and secondary openings, from points of a film.

use std::cell::RefCell;

use glam::{DVec2, DVec3};

use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::search::secondary_openings::is_outside;
use crate::lens::pupil::sides::SIDES;
use crate::lens::pupil::support::{MARGIN, widened};

/// The number of intervals of the film's radius between the film points from which secondary
/// openings are searched. It is multiplied by [`PupilSearch::grid`], and its cost is proportional
/// to it. With it and the thresholds below, 2 of 8,343 random lenses lost some of their rays
/// (docs/decisions/0011-measuring-a-pupil.md).
const SEARCHES: usize = 16;
/// The number of film points beyond the end of a table from which light is searched again. The cost
/// is proportional to it. The record is that of [`SEARCHES`].
const SEARCHES_BEYOND: usize = 16;
/// A ray whose fill is below this may get through from a neighboring film point, so the film point
/// is moved. A larger value costs more of these searches, and a smaller one misses openings between
/// film points. The record is that of [`SEARCHES`].
const NEARLY_THROUGH: f64 = 1.2;
/// A fill that the search lowers to less than this is regarded as that of a ray that gets through:
/// the search may end 1% above the minimum. A larger value finds secondary openings where there are
/// none, which costs 2.5% of the rays there and no bias (docs/decisions/0011-measuring-a-pupil.md).
const THROUGH: f64 = 1.01;

/// Measures the pupil from points of a film.
pub(super) struct PupilSampler<'a> {
    search: &'a PupilSearch<'a>,
    place: &'a FilmPlace,
    sides: &'a [DVec2; SIDES],
    /// The outlines from film points (radius, 0) that were measured already.
    measured: RefCell<Vec<(f64, Option<PupilOutline>)>>,
}

impl<'a> PupilSampler<'a> {
    /// A sampler of the outlines with the normals `sides`. Nothing is measured yet.
    pub(super) fn new(
        search: &'a PupilSearch<'a>,
        place: &'a FilmPlace,
        sides: &'a [DVec2; SIDES],
    ) -> Self {
        Self {
            search,
            place,
            sides,
            measured: RefCell::default(),
        }
    }

    /// Measures the outline from a film point; none if no light reaches it.
    pub(super) fn at(&self, point: DVec3, guess: Option<&OutlineGuess>) -> Option<PupilOutline> {
        self.search.find_outline(point, self.sides, guess)
    }

    /// The outline from the film point (radius, 0), measured at most once.
    pub(super) fn at_radius(
        &self,
        radius: f64,
        guess: Option<&OutlineGuess>,
    ) -> Option<PupilOutline> {
        let same = |(r, outline): &(f64, Option<PupilOutline>)| (*r == radius).then_some(*outline);
        if let Some(outline) = self.measured.borrow().iter().find_map(same) {
            return outline;
        }
        let outline = self.at(self.place.point(DVec2::new(radius, 0.0)), guess);
        self.measured.borrow_mut().push((radius, outline));
        outline
    }

    /// Whether light reaches a film point between the end of a table and the film's radius.
    pub(super) fn opens_again(&self, end: f64, film_radius: f64) -> bool {
        let is_lit = |r: &f64, outline: &Option<PupilOutline>| *r > end && outline.is_some();
        let mut again = self.measured.borrow().iter().any(|(r, s)| is_lit(r, s));
        let step = (film_radius - end) / SEARCHES_BEYOND as f64;
        again |= step > 0.0
            && (1..=SEARCHES_BEYOND).any(|i| {
                let point = DVec2::new(end + i as f64 * step, 0.0);
                self.at(self.place.point(point), None).is_some()
            });
        again
    }

    /// The range of film radii beyond the end of a table that any light reaches; none if no light
    /// was found. Secondary openings are searched from a row of film points and between them.
    pub(super) fn lit_beyond(&self, end: f64, film_radius: f64) -> Option<[f64; 2]> {
        let step = (film_radius - end) / SEARCHES_BEYOND as f64;
        let film_point = |radius: f64| {
            let beyond = radius > end && radius <= film_radius;
            beyond.then(|| self.place.point(DVec2::new(radius, 0.0)))
        };
        let outlines = self.measured.borrow();
        let slopes = outlines
            .iter()
            .filter_map(|(_, outline)| Some(outline.as_ref()?.guess.slope()));
        let slope = slopes.fold(0.0, f64::max);
        let slope = if slope > 0.0 { slope } else { f64::INFINITY };
        let mut lit = None;
        for i in 1..=SEARCHES_BEYOND {
            let radius = end + i as f64 * step;
            let film = self.place.point(DVec2::new(radius, 0.0));
            let mut found =
                self.search
                    .secondary_openings(film, None, self.sides, slope, NEARLY_THROUGH);
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            // The two aims of least fill are the likeliest to get through from a neighboring point.
            for (aim, fill) in found.into_iter().take(2) {
                let start = (radius, aim);
                let (there, least) = match fill < 1.0 {
                    true => (start, fill),
                    false => self
                        .search
                        .least_around(start, step, &film_point, &|_, _| true),
                };
                if least < 1.0 {
                    let near = [there.0 - step, there.0 + step];
                    lit = Some(lit.map_or(near, |lit| union(lit, near)));
                    break;
                }
            }
        }
        lit
    }

    /// The range of film radii that light reaches through secondary openings; none if no light was
    /// found.
    ///
    /// The openings are searched from film points in a row from the middle outward. Where a ray
    /// nearly gets through, the film point is moved until it does, or until the fill has reached a
    /// minimum. `is_aimed_at` tells whether a film radius's window contains an aim.
    pub(super) fn stray_radii(
        &self,
        film_radius: f64,
        is_rotational: bool,
        is_aimed_at: impl Fn(f64, DVec2) -> bool,
    ) -> Option<[f64; 2]> {
        let searches = SEARCHES * self.search.grid;
        let step = film_radius / searches as f64;
        let row = self.widened_row(film_radius, searches);
        let film_point = |radius: f64| {
            let on_film = (0.0..=film_radius).contains(&radius);
            on_film.then(|| self.place.point(DVec2::new(radius, 0.0)))
        };
        let outside = |radius: f64, aim: DVec2| {
            let i = ((radius / step) as usize).min(searches - 1);
            let mut near = row[i..i + 2].iter().flatten();
            near.all(|outline| is_outside(aim, &outline.support, self.sides))
        };
        let (mut from, mut to, mut is_light) = (f64::INFINITY, f64::NEG_INFINITY, false);
        let mut slope = f64::INFINITY;
        for (i, outline) in row.iter().enumerate() {
            let radius = film_radius * i as f64 / searches as f64;
            let film = self.place.point(DVec2::new(radius, 0.0));
            // A film that is moved may reach far beyond the field, where the slopes are no guide:
            // no ray is dropped there.
            if let (Some(outline), true) = (outline, is_rotational) {
                slope = outline.guess.slope();
            }
            let found = self.search.secondary_openings(
                film,
                outline.as_ref(),
                self.sides,
                slope,
                NEARLY_THROUGH,
            );
            for (aim, fill) in found {
                (from, to) = (from.min(radius), to.max(radius));
                let is_there = || {
                    let start = (radius, aim);
                    let ((radius, aim), least) =
                        self.search.least_around(start, step, &film_point, &outside);
                    // A ridge of the fill separates a secondary opening from an open pupil. Where
                    // the pupil has closed, the aim may lie in the pupil of a neighboring film
                    // point.
                    let is_separate = outline.is_some();
                    least < THROUGH && (is_separate || least < 1.0 && !is_aimed_at(radius, aim))
                };
                is_light = is_light || fill < 1.0 || is_there();
            }
        }
        let around = 2.0 * film_radius / SEARCHES as f64;
        is_light.then_some([from - around, to + around])
    }

    /// The outlines from film points in a row from the middle outward, widened by [`MARGIN`].
    fn widened_row(&self, film_radius: f64, searches: usize) -> Vec<Option<PupilOutline>> {
        let mut last = [None; 2];
        let outline_at = |i: usize| {
            let radius = film_radius * i as f64 / searches as f64;
            let outline = self.at_radius(radius, OutlineGuess::following(last).as_ref());
            last = [last[1], outline.map(|outline| outline.guess)];
            outline.map(|outline| PupilOutline {
                support: widened(&outline.support, MARGIN),
                ..outline
            })
        };
        (0..=searches).map(outline_at).collect()
    }
}

/// The smallest range that contains two.
pub(super) fn union([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a.min(c), b.max(d)]
}
