//! The irradiance on the film, and the area of the pupil on the rear vertex plane.

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::pupil::search::pupil_search::PupilSearch;

impl Lens {
    /// The irradiance at a film point from a scene of radiance 1, in steradians, by equation 1 of
    /// the paper: ∫ cos⁴θ / Z² over the pupil on the rear vertex plane. Lengths are in millimeters.
    pub fn irradiance(&self, film: DVec2, film_z: f64) -> f64 {
        self.irradiance_and_area(film, film_z).0
    }

    /// Whether light reaches a height on the film, in millimeters.
    pub(crate) fn is_lit(&self, height: f64, film_z: f64) -> bool {
        let film = DVec2::new(0.0, height).extend(film_z);
        PupilSearch::finely(self).is_lit(film)
    }

    /// The height on the film up to which there is light, at most `height`. Both, and `film_z`, are
    /// in millimeters.
    pub fn lit_height(&self, height: f64, film_z: f64) -> f64 {
        if self.is_lit(height, film_z) {
            return height;
        }
        let (mut lit, mut dark) = (0.0, height);
        for _ in 0..20 {
            let middle = 0.5 * (lit + dark);
            *(if self.is_lit(middle, film_z) {
                &mut lit
            } else {
                &mut dark
            }) = middle;
        }
        lit
    }

    /// The irradiance, and the area of the pupil on the rear vertex plane in square millimeters.
    pub(crate) fn irradiance_and_area(&self, film: DVec2, film_z: f64) -> (f64, f64) {
        let surfaces = self.prescription().surfaces.len().max(1);
        let points = (POINTS * FEW_SURFACES / surfaces).clamp(MIN_POINTS, POINTS);
        self.irradiance_by(film, film_z, points)
    }

    /// The irradiance and the area by an outline of a number of points.
    pub(crate) fn irradiance_by(&self, film: DVec2, film_z: f64, points: usize) -> (f64, f64) {
        match self.pupil_outline(film, film_z, points) {
            Some(outline) => self.irradiance_through(film, film_z, &outline),
            None => (0.0, 0.0),
        }
    }

    /// A point inside the pupil on the rear vertex plane, and at least a number of points of the
    /// outline relative to it; none if no light reaches the film point.
    pub(crate) fn pupil_outline(
        &self,
        film: DVec2,
        film_z: f64,
        points: usize,
    ) -> Option<(DVec2, Vec<DVec2>)> {
        PupilSearch::finely(self).outline_points(film.extend(film_z), points)
    }

    /// The irradiance and the area by the outline of a pupil.
    pub(crate) fn irradiance_through(
        &self,
        film: DVec2,
        film_z: f64,
        (center, rims): &(DVec2, Vec<DVec2>),
    ) -> (f64, f64) {
        let z = film_z - self.length();
        let center = *center;
        let (mut light, mut area) = (0.0, 0.0);
        for i in 0..rims.len() {
            let (p, q) = (rims[i], rims[(i + 1) % rims.len()]);
            let twice = p.perp_dot(q).abs();
            area += 0.5 * twice;
            // The integral over a triangle with a corner at the center, by Gauss's points along its
            // median.
            let middle = 0.5 * (p + q);
            for (t, weight) in GAUSS {
                let d2 = (center + t * middle - film).length_squared();
                let cos2 = z * z / (z * z + d2);
                light += twice * weight * t * cos2 * cos2 / (z * z);
            }
        }
        if !self.is_obstructed() {
            return (light, area);
        }
        let rims: Vec<DVec2> = rims.iter().step_by(RIMS_PER_SPOKE).copied().collect();
        let closed = self.obstructed(film.extend(film_z), center, &rims);
        (light - closed.0, area - closed.1)
    }

    /// The light that obstructions take from a pupil whose outline has these points about its
    /// center, and the area that they take from it.
    fn obstructed(&self, film: DVec3, center: DVec2, rims: &[DVec2]) -> (f64, f64) {
        let z = film.z - self.length();
        let (mut light, mut area) = (0.0, 0.0);
        for i in 0..rims.len() {
            let (p, q) = (rims[i], rims[(i + 1) % rims.len()]);
            let (twice, middle) = (p.perp_dot(q).abs(), 0.5 * (p + q));
            for [from, to] in self.closed_parts(film, center, middle) {
                area += 0.5 * twice * (to * to - from * from);
                for (share, weight) in GAUSS {
                    let t = from + (to - from) * share;
                    let d2 = (center + t * middle - film.truncate()).length_squared();
                    let cos2 = z * z / (z * z + d2);
                    light += twice * (to - from) * weight * t * cos2 * cos2 / (z * z);
                }
            }
        }
        (light, area)
    }
}

/// The number of points on the pupil's outline. The area of a polygon of this many corners in a
/// circle is 3e-6 less than the circle's.
const POINTS: usize = 1440;
/// The number of points of the outline for each spoke along which obstructions are searched. A
/// polygon of 480 corners in a circle has 3e-5 less than its area, which is a part of the pupil's.
const RIMS_PER_SPOKE: usize = 3;
/// The number of surfaces up to which the outline has [`POINTS`] points. It has fewer for a longer
/// lens, so that a data sheet takes about the same number of intersections for any lens.
const FEW_SURFACES: usize = 40;
/// The least number of points: the polygon's area is 0.07% less than the circle's.
const MIN_POINTS: usize = 96;

/// The points and weights of Gauss's quadrature with six points on (0, 1).
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_18),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_18),
];
