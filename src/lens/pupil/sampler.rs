//! Measures what points of a film see.

use std::cell::RefCell;

use glam::{DVec2, DVec3};

use super::polygon::SIDES;
use super::search::outline::{Hint, Seen, next};
use super::search::pupil_search::Sight;
use super::search::secondary_openings::is_outside;
use super::support::{MARGIN, widened};
use crate::lens::optics::film_place::FilmPlace;

/// Film points from the middle outward at which light is sought beside the pupil.
const SEARCHES: usize = 16;
/// Film points past the end of the light from which it is sought again.
const CLOSER: usize = 16;
/// Rays that use less of the tightest semi-diameter than this may get through from a film point
/// beside; less than that does, but for rounding of a search.
const NEARLY_THROUGH: f64 = 1.2;
const THROUGH: f64 = 1.01;

/// Measures what points of a film see.
pub(super) struct Look<'a> {
    sight: &'a Sight<'a>,
    place: &'a FilmPlace,
    sides: &'a [DVec2; SIDES],
    /// What was seen from film points of (radius, 0).
    outward: RefCell<Vec<(f64, Option<Seen>)>>,
}

impl<'a> Look<'a> {
    pub fn new(sight: &'a Sight<'a>, place: &'a FilmPlace, sides: &'a [DVec2; SIDES]) -> Self {
        Self {
            sight,
            place,
            sides,
            outward: RefCell::default(),
        }
    }

    pub fn at(&self, point: DVec3, hint: Option<&Hint>) -> Option<Seen> {
        self.sight.seen(point, self.sides, hint)
    }

    pub fn at_radius(&self, radius: f64, hint: Option<&Hint>) -> Option<Seen> {
        let known = |(r, seen): &(f64, Option<Seen>)| (*r == radius).then_some(*seen);
        if let Some(seen) = self.outward.borrow().iter().find_map(known) {
            return seen;
        }
        let seen = self.at(self.place.point(DVec2::new(radius, 0.0)), hint);
        self.outward.borrow_mut().push((radius, seen));
        seen
    }

    /// Whether there is light again beyond the end of a table.
    pub fn opens_again(&self, end: f64, film_radius: f64) -> bool {
        let known = |r: &f64, seen: &Option<Seen>| *r > end && seen.is_some();
        let mut again = self.outward.borrow().iter().any(|(r, s)| known(r, s));
        let step = (film_radius - end) / CLOSER as f64;
        again |= step > 0.0
            && (1..=CLOSER).any(|i| {
                let point = DVec2::new(end + i as f64 * step, 0.0);
                self.at(self.place.point(point), None).is_some()
            });
        again
    }

    /// The film radii beyond the end of a table that see light anywhere, by a closer row of film
    /// points and what is between them.
    pub fn alone(&self, end: f64, film_radius: f64) -> Option<[f64; 2]> {
        let step = (film_radius - end) / CLOSER as f64;
        let point = |radius: f64| {
            let beyond = radius > end && radius <= film_radius;
            beyond.then(|| self.place.point(DVec2::new(radius, 0.0)))
        };
        let slopes = self.outward.borrow();
        let slopes = slopes
            .iter()
            .filter_map(|(_, seen)| Some(seen.as_ref()?.hint.slope()));
        let slope = slopes.fold(0.0, f64::max);
        let slope = if slope > 0.0 { slope } else { f64::INFINITY };
        let mut lit = None;
        for i in 1..=CLOSER {
            let radius = end + i as f64 * step;
            let film = self.place.point(DVec2::new(radius, 0.0));
            let mut found = self
                .sight
                .strays(film, None, self.sides, slope, NEARLY_THROUGH);
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            // What comes nearest to light is first to see some from beside.
            for (aim, fill) in found.into_iter().take(2) {
                let start = (radius, aim);
                let (there, least) = match fill < 1.0 {
                    true => (start, fill),
                    false => self.sight.least_around(start, step, &point, &|_, _| true),
                };
                if least < 1.0 {
                    let near = [there.0 - step, there.0 + step];
                    lit = Some(lit.map_or(near, |lit| both(lit, near)));
                    break;
                }
            }
        }
        lit
    }

    /// Whether there is light beside the pupil, from film points in a row from the middle outward.
    /// Where there nearly is any, the film point is moved until there is, or can't be. If there
    /// is, the film radii that see any.
    pub fn strays(
        &self,
        film_radius: f64,
        is_even: bool,
        is_aimed_at: impl Fn(f64, DVec2) -> bool,
    ) -> Option<[f64; 2]> {
        let searches = SEARCHES * self.sight.grid;
        let step = film_radius / searches as f64;
        let mut last = [None; 2];
        let row: Vec<Option<Seen>> = (0..=searches)
            .map(|i| {
                let radius = film_radius * i as f64 / searches as f64;
                let seen = self.at_radius(radius, next(last).as_ref());
                last = [last[1], seen.map(|seen| seen.hint)];
                seen.map(|seen| Seen {
                    support: widened(&seen.support, MARGIN),
                    ..seen
                })
            })
            .collect();
        let point = |radius: f64| {
            let on_film = (0.0..=film_radius).contains(&radius);
            on_film.then(|| self.place.point(DVec2::new(radius, 0.0)))
        };
        let outside = |radius: f64, aim: DVec2| {
            let i = ((radius / step) as usize).min(searches - 1);
            let mut near = row[i..i + 2].iter().flatten();
            near.all(|seen| is_outside(aim, &seen.support, self.sides))
        };
        let (mut from, mut to, mut is_light) = (f64::INFINITY, f64::NEG_INFINITY, false);
        let mut slope = f64::INFINITY;
        for (i, seen) in row.iter().enumerate() {
            let radius = film_radius * i as f64 / searches as f64;
            let film = self.place.point(DVec2::new(radius, 0.0));
            // A film that is moved reaches far beyond the field: nothing is left out there.
            if let (Some(seen), true) = (seen, is_even) {
                slope = seen.hint.slope();
            }
            let found = self
                .sight
                .strays(film, seen.as_ref(), self.sides, slope, NEARLY_THROUGH);
            for (aim, fill) in found {
                (from, to) = (from.min(radius), to.max(radius));
                let is_there = || {
                    let start = (radius, aim);
                    let ((radius, aim), least) =
                        self.sight.least_around(start, step, &point, &outside);
                    // Behind a ridge it is not the pupil; past its end it may be.
                    least < THROUGH && (seen.is_some() || least < 1.0 && !is_aimed_at(radius, aim))
                };
                is_light = is_light || fill < 1.0 || is_there();
            }
        }
        let around = 2.0 * film_radius / SEARCHES as f64;
        is_light.then_some([from - around, to + around])
    }
}

/// The range that two are in.
pub(super) fn both([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a.min(c), b.max(d)]
}
