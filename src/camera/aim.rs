//! Rays from film points to lens points, and their weights by the paper's equation 1.

use glam::{DVec2, DVec3};

use crate::film::{FilmFormat, Resolution};
use crate::lens::{FilmPlace, LensRay, PupilWindow};
use crate::sampling::DiscMap;

/// Where on the lens to aim (see `lens::pupil`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The rear-most element: the 1999 program.
    RearElement(DiscMap),
    /// The real exit pupil. Default.
    ExitPupil,
}

/// Millimeters on the film of a point of the upright picture, which is upside down on the film.
pub(super) fn film_point(format: FilmFormat, x: f64, y: f64) -> DVec2 {
    DVec2::new((0.5 - x) * format.width, (y - 0.5) * format.height)
}

/// The ray from a film point to a point of the rear vertex plane, and equation 1 over the density
/// of such points.
pub(super) fn aimed(
    place: &FilmPlace,
    film: DVec2,
    rear_z: f64,
    window: &PupilWindow<'_>,
    [u, v]: [f64; 2],
) -> Option<(LensRay, f64)> {
    (!window.is_closed()).then(|| {
        let aim = window.point(u, v);
        toward(place, film, aim.extend(rear_z), window.density(aim))
    })
}

/// The ray to a point that was drawn with a density, and its weight.
fn toward(place: &FilmPlace, film: DVec2, aim: DVec3, density: f64) -> (LensRay, f64) {
    let origin = place.point(film);
    let across = aim - origin;
    let direction = across.normalize();
    let weight = equation_1(across, place.normal(film)) / density;
    (LensRay { origin, direction }, weight)
}

/// cos θ cos θ′/‖x′ − x‖² of the paper's equation 1, with the film's normal at x. Where film and
/// rear plane are parallel this is cos⁴θ/Z²; Z is the same for every ray of a picture, which is
/// why equation 2 can drop it.
#[inline(always)]
pub(super) fn equation_1(across: DVec3, normal: DVec3) -> f64 {
    let squared = across.length_squared();
    (normal.dot(across) * -across.z).max(0.0) / (squared * squared)
}

/// The picture's aspect and the film's must agree, or pixels are not square.
pub(crate) fn pixel_aspect(format: FilmFormat, resolution: Resolution) -> f64 {
    (format.width / f64::from(resolution.width)) / (format.height / f64::from(resolution.height))
}
