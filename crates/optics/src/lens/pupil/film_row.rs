//! Outlines of the pupil as seen from a row of film points, from the film's middle along +x.

use std::cell::RefCell;

use glam::{DVec2, DVec3};

use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::support::MARGIN;

/// The row of film points (radius, 0). The outline from each is measured at most once.
pub(super) struct FilmRow<'a> {
    pub search: &'a PupilSearch<'a>,
    place: &'a FilmPlace,
    /// The length of the row, in millimeters.
    pub film_radius: f64,
    /// The outlines by film radius that were measured already.
    measured: RefCell<Vec<(f64, Option<PupilOutline>)>>,
}

impl<'a> FilmRow<'a> {
    /// The row of a film. Nothing is measured yet.
    pub(super) fn new(search: &'a PupilSearch<'a>, place: &'a FilmPlace, film_radius: f64) -> Self {
        Self {
            search,
            place,
            film_radius,
            measured: RefCell::default(),
        }
    }

    /// The film point of a radius, in lens space.
    pub(super) fn point(&self, radius: f64) -> DVec3 {
        self.place.point(DVec2::new(radius, 0.0))
    }

    /// The outline from the film point of a radius; none if no light reaches it.
    pub(super) fn outline(
        &self,
        radius: f64,
        guess: Option<&OutlineGuess>,
    ) -> Option<PupilOutline> {
        let known = |(r, outline): &(f64, Option<PupilOutline>)| (*r == radius).then_some(*outline);
        if let Some(outline) = self.measured.borrow().iter().find_map(known) {
            return outline;
        }
        let outline = self.search.find_outline(self.point(radius), guess);
        self.measured.borrow_mut().push((radius, outline));
        outline
    }

    /// The outlines that were measured already, with their film radii.
    pub(super) fn measured(&self) -> Vec<(f64, PupilOutline)> {
        let measured = self.measured.borrow();
        let lit = measured
            .iter()
            .filter_map(|(r, outline)| Some((*r, (*outline)?)));
        lit.collect()
    }

    /// The outlines from the film points that divide the row into equal parts, each with its film
    /// radius and widened by [`MARGIN`].
    pub(super) fn widened_outlines(&self, parts: usize) -> Vec<(f64, Option<PupilOutline>)> {
        let mut last = [None; 2];
        let outline_at = |i: usize| {
            let radius = self.film_radius * i as f64 / parts as f64;
            let outline = self.outline(radius, OutlineGuess::following(last).as_ref());
            last = [last[1], outline.map(|outline| outline.guess)];
            let widened = outline.map(|outline| PupilOutline {
                support: outline.support.widened(MARGIN),
                ..outline
            });
            (radius, widened)
        };
        (0..=parts).map(outline_at).collect()
    }
}
