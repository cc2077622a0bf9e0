//! The rear element as a target of rays.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::support::MARGIN;
use crate::sampling::DiscMap;

/// The disc of the rear element, which is the same from every film point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RearElement {
    /// The radius in millimeters.
    pub radius: f64,
    /// The map from the unit square to the disc.
    pub map: DiscMap,
}

impl RearElement {
    /// The disc of the rear surface of a lens.
    pub fn new(lens: &Lens, map: DiscMap) -> Self {
        let prescription = lens.prescription();
        let listed = prescription
            .surfaces
            .last()
            .map_or(0.0, |s| s.semi_diameter);
        // A rear element without a listed size may be wider than all elements with one. Twice the
        // widest of those is an assumption.
        let radius = match listed.is_finite() {
            true => listed,
            false => 2.0 * prescription.widest_semi_diameter(),
        };
        Self { radius, map }
    }
}

/// The greatest distance from the axis, in millimeters, at which a ray through the rear surface
/// crosses the rear vertex plane. That ray goes from the farthest film point through the rim. The
/// result is at most 100 times the rear element's radius.
pub(super) fn reach_of(lens: &Lens, place: &FilmPlace, film_radius: f64) -> f64 {
    let rear = RearElement::new(lens, DiscMap::Concentric).radius;
    let film = |k: i32| place.point(film_radius * DVec2::from_angle(TAU * f64::from(k) / 64.0));
    let (mut near, mut far) = (place.point(DVec2::ZERO).z, 0.0f64);
    for point in (0..64).map(film) {
        (near, far) = (near.min(point.z), far.max(point.truncate().length()));
    }
    // The ray crosses the vertex plane at this fraction of the distance from the rim to the film.
    let sag = lens
        .prescription()
        .surfaces
        .last()
        .map_or(0.0, |s| s.sag(rear));
    let t = sag / (sag - (near - lens.length()));
    let reach = match t < 1.0 {
        true => (1.0 - t).abs() * rear + t.abs() * far,
        false => rear,
    };
    reach.clamp(rear, 100.0 * rear) * (1.0 + MARGIN)
}
