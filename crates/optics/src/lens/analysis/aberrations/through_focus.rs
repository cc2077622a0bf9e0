//! Spots and modulation on films in front of the image and behind it.

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::lens::analysis::diffraction::Wavefront;
use crate::lens::analysis::points::{PointWaves, diffraction};
use crate::lens::lens::Lens;
use crate::lens::trace::ray::LensRay;

/// The number of film positions on each side of the film.
const STEPS: usize = 10;
/// The film positions for which there are spots, as shares of the range.
pub(crate) const SPOTS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// The image of a point on a film that is shifted.
#[derive(Clone, Debug, Serialize)]
pub struct FocusRow {
    /// The shift of the film away from the lens, in millimeters.
    pub shift: f64,
    /// The root mean square radius of the spot, in millimeters.
    pub rms: f64,
    /// The modulation of lines across the meridian in white light, for each frequency.
    pub tangential: Vec<f64>,
    /// The modulation of lines along the meridian.
    pub sagittal: Vec<f64>,
}

/// The image of a point through focus.
pub(super) struct ThroughFocus {
    pub rows: Vec<FocusRow>,
    /// The spot at each of [`SPOTS`], from its centroid, in millimeters.
    pub spots: Vec<Vec<DVec2>>,
    /// The Strehl ratio on the film.
    pub strehl: Option<f64>,
}

impl ThroughFocus {
    /// The image of a point on films up to `range` millimeters from the one of its waves, with the
    /// modulation at `frequencies`.
    pub(super) fn of(lens: &Lens, point: &PointWaves<'_>, range: f64, frequencies: &[f64]) -> Self {
        let (rays, film_z) = (&point.rays, point.image.z);
        let row = |i: usize| {
            let shift = range * (i as f64 / STEPS as f64 - 1.0);
            let shifted = point.white.iter().map(|(e, w)| (*e, w.shifted(shift)));
            let modulation = diffraction(&shifted.collect::<Vec<_>>(), frequencies);
            FocusRow {
                shift,
                rms: spot(rays, film_z + shift).1,
                tangential: modulation.tangential,
                sagittal: modulation.sagittal,
            }
        };
        let own = Wavefront::of(lens, &point.beam, &point.openings, point.image);
        Self {
            rows: (0..=2 * STEPS).map(row).collect(),
            spots: SPOTS
                .map(|share| spot(rays, film_z + share * range).0)
                .to_vec(),
            strehl: own.map(|waves| waves.strehl()),
        }
    }
}

/// The points of a spot from its centroid, and its root mean square radius.
fn spot(rays: &[LensRay], film_z: f64) -> (Vec<DVec2>, f64) {
    let places: Vec<DVec3> = rays.iter().map(|ray| ray.at_z(film_z)).collect();
    let count = places.len() as f64;
    let centroid = places.iter().map(|p| p.truncate()).sum::<DVec2>() / count;
    let spot: Vec<DVec2> = places.iter().map(|p| p.truncate() - centroid).collect();
    let square: f64 = spot.iter().map(|p| p.length_squared()).sum();
    (spot, (square / count).sqrt())
}
