//! Rays from film points to lens points, and their weights by the paper's equation 1.

use glam::{DVec2, DVec3};
use ivcam_optics::film::{FilmFormat, Resolution};
use ivcam_optics::lens::{FilmPlace, LensRay, PupilWindow};
use ivcam_optics::sampling::DiscMap;

/// Where on the lens to aim (see `lens::pupil`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The whole rear element, sampled by a map from the unit square. The 1999 program does this.
    RearElement(DiscMap),
    /// The measured exit pupil. This is the default.
    ExitPupil,
}

/// The film point, in millimeters from the film's middle, of a point of the upright picture from 0
/// to 1. The image on the film is upside down.
pub(super) fn film_point(format: FilmFormat, x: f64, y: f64) -> DVec2 {
    DVec2::new((0.5 - x) * format.width, (y - 0.5) * format.height)
}

/// The ray from a film point to the point of a window for a point of the unit square, and equation
/// 1 over the density of such points; none if the window is closed.
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

/// The ray from a film point to a point that was sampled with a density, and its weight.
fn toward(place: &FilmPlace, film: DVec2, aim: DVec3, density: f64) -> (LensRay, f64) {
    let origin = place.point(film);
    let across = aim - origin;
    let direction = across.normalize();
    let weight = equation_1(across, place.normal(film)) / density;
    (LensRay { origin, direction }, weight)
}

/// The factor cos θ cos θ′/‖x′ − x‖² of the paper's equation 1, with the film's normal at x. If the
/// film and the rear vertex plane are parallel, it is cos⁴θ/Z². Z is the same for every ray of a
/// picture, so equation 2 can omit it.
#[inline(always)]
pub(super) fn equation_1(across: DVec3, normal: DVec3) -> f64 {
    let squared = across.length_squared();
    (normal.dot(across) * -across.z).max(0.0) / (squared * squared)
}

/// The width of a pixel on the film over its height. It is 1 if the aspect ratios of the picture
/// and the film agree.
pub fn pixel_aspect(format: FilmFormat, resolution: Resolution) -> f64 {
    (format.width / f64::from(resolution.width)) / (format.height / f64::from(resolution.height))
}
