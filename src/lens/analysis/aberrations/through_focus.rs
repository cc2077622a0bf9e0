//! Spots and modulation on films in front of the image and behind it.

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::lens::analysis::beam::Beam;
use crate::lens::analysis::diffraction::{Openings, Wavefront};
use crate::lens::analysis::points::{GRID, white_wavefronts};
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
    /// The image of a beam on films up to `range` millimeters from the one at `film_z`, with the
    /// modulation at `frequencies`. Returns none if too few rays get through.
    pub(super) fn of(
        lens: &Lens,
        beam: &Beam<'_>,
        film_z: f64,
        range: f64,
        frequencies: &[f64],
    ) -> Option<Self> {
        let rays = rays(lens, beam);
        if rays.len() <= 8 {
            return None;
        }
        let centroid = spot(&rays, film_z).0;
        let image = centroid.extend(film_z);
        let openings = Openings::of(lens, beam, GRID);
        let waves = white_wavefronts(beam, lens, &openings, image);
        let row = |i: usize| {
            let shift = range * (i as f64 / STEPS as f64 - 1.0);
            let shifted: Vec<_> = waves.iter().map(|(e, w)| (*e, w.shifted(shift))).collect();
            let curve = |axis: usize| {
                let at = |f: &f64| modulation(&shifted, *f, axis);
                frequencies.iter().map(at).collect()
            };
            FocusRow {
                shift,
                rms: spot(&rays, film_z + shift).2,
                tangential: curve(1),
                sagittal: curve(0),
            }
        };
        let own = Wavefront::of(lens, beam, &openings, image);
        Some(Self {
            rows: (0..=2 * STEPS).map(row).collect(),
            spots: SPOTS
                .map(|share| spot(&rays, film_z + share * range).1)
                .to_vec(),
            strehl: own.map(|waves| waves.strehl()),
        })
    }
}

/// The modulation in white light.
fn modulation(waves: &[(f64, Wavefront)], frequency: f64, axis: usize) -> f64 {
    let total: f64 = waves.iter().map(|(efficiency, _)| efficiency).sum();
    let parts = waves.iter().map(|(e, w)| *e * w.transfer(frequency, axis));
    parts.sum::<DVec2>().length() / total
}

/// The rays of a grid across a beam, behind the lens.
fn rays(lens: &Lens, beam: &Beam<'_>) -> Vec<LensRay> {
    let (low, high) = beam.bounds();
    let step = (high - low) / GRID as f64;
    let grid = (0..GRID * GRID).map(|k| DVec2::new((k % GRID) as f64, (k / GRID) as f64));
    grid.filter_map(|at| beam.trace(lens, low + step * (at + 0.5)))
        .collect()
}

/// The centroid of a spot, its points from there, and its root mean square radius.
fn spot(rays: &[LensRay], film_z: f64) -> (DVec2, Vec<DVec2>, f64) {
    let places: Vec<DVec3> = rays.iter().map(|ray| ray.at_z(film_z)).collect();
    let count = places.len() as f64;
    let centroid = places.iter().map(|p| p.truncate()).sum::<DVec2>() / count;
    let spot: Vec<DVec2> = places.iter().map(|p| p.truncate() - centroid).collect();
    let square: f64 = spot.iter().map(|p| p.length_squared()).sum();
    (centroid, spot, (square / count).sqrt())
}
