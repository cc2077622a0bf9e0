//! Images of points: spots, outlines of beams, and modulation.
//!
//! Lengths are in millimeters, heights are on the film.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::lens::analysis::beam::{Beam, polygon_area};
use crate::lens::analysis::diffraction::{Openings, Wavefront};
use crate::lens::lens::Lens;
use crate::lens::trace::ray::LensRay;

/// The number of rays along each side of the grid across a beam.
pub(super) const GRID: usize = 64;
/// The wavelengths in nanometers from which the modulation in white light is computed, with the
/// luminous efficiency of each (CIE 1924).
pub(super) const EFFICIENCY: [(f64, f64); 5] = [
    (480.0, 0.139),
    (520.0, 0.710),
    (560.0, 0.995),
    (600.0, 0.631),
    (640.0, 0.175),
];

/// The image of a point. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct PointImage {
    /// The height on the film.
    pub height: f64,
    /// The angle of the chief ray in the scene, in degrees.
    pub angle_degrees: f64,
    /// The root mean square radius of the spot at the d line.
    pub rms: f64,
    /// The points at which rays of the F, d and C lines arrive, relative to the centroid of the d
    /// line.
    #[serde(skip)]
    pub spots: [Vec<DVec2>; 3],
    /// The outline of the beam that gets through, perpendicular to the chief ray, over the radius
    /// of the axial beam.
    pub pupil: Vec<[f64; 2]>,
    /// The cross-section of the beam over that of the axial beam.
    pub pupil_area: f64,
    /// The modulation by rays alone.
    pub geometric: Modulation,
    /// The modulation with diffraction.
    pub diffraction: Modulation,
}

/// The modulation at the frequencies of the sheet.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Modulation {
    /// The modulation of lines across the meridian.
    pub tangential: Vec<f64>,
    /// The modulation of lines along the meridian.
    pub sagittal: Vec<f64>,
}

/// The rays and waves of a point, from which its image on the film and beside it is computed.
pub(super) struct PointWaves<'a> {
    pub beam: Beam<'a>,
    /// The rays of a grid as they leave the lens, at its own wavelength.
    pub rays: Vec<LensRay>,
    /// The mean of the places where they arrive on the film: the reference of the waves' phases.
    pub image: DVec3,
    pub openings: Openings,
    /// The waves of white light, each with the luminous efficiency of its wavelength.
    pub white: Vec<(f64, Wavefront)>,
}

impl<'a> PointWaves<'a> {
    /// The rays and waves of a beam; none if too few rays get through.
    pub(super) fn of(lens: &Lens, beam: Beam<'a>, film_z: f64) -> Option<Self> {
        let grid = beam.grid(GRID);
        let rays: Vec<LensRay> = beam.trace(lens, &grid).into_iter().flatten().collect();
        if rays.len() <= 8 {
            return None;
        }
        let places = rays.iter().map(|ray| ray.at_z(film_z).truncate());
        let image = (places.sum::<DVec2>() / rays.len() as f64).extend(film_z);
        let openings = Openings::of(lens, &beam, GRID);
        let wave = |(nm, efficiency): &(f64, f64)| {
            let line = lens.at_wavelength(*nm);
            Some((*efficiency, Wavefront::of(&line, &beam, &openings, image)?))
        };
        Some(Self {
            white: EFFICIENCY.iter().filter_map(wave).collect(),
            beam,
            rays,
            image,
            openings,
        })
    }
}

/// The image of a point. `lines` are the lens at the F line, at its own wavelength and at the C
/// line; `axial` is the radius of the axial beam.
pub(super) fn point_image(
    waves: &PointWaves<'_>,
    lines: &[Lens; 3],
    axial: f64,
    frequencies: &[f64],
) -> PointImage {
    let (beam, film_z) = (&waves.beam, waves.image.z);
    let own = waves.rays.iter().map(|ray| ray.at_z(film_z).truncate());
    let places = [
        arrivals(beam, &lines[0], film_z),
        own.collect(),
        arrivals(beam, &lines[2], film_z),
    ];
    let count = waves.rays.len() as f64;
    let centroid = waves.image.truncate();
    let spots = places.map(|places| places.iter().map(|p| *p - centroid).collect::<Vec<_>>());
    let square: f64 = spots[1].iter().map(|p| p.length_squared()).sum();
    let outline = beam.outline();
    PointImage {
        height: beam.height,
        angle_degrees: libm::acos(beam.d.z.clamp(-1.0, 1.0)).to_degrees(),
        rms: (square / count).sqrt(),
        geometric: geometric(&spots[1], frequencies),
        diffraction: diffraction(&waves.white, frequencies),
        spots,
        pupil: outline.iter().map(|p| (*p / axial).to_array()).collect(),
        pupil_area: polygon_area(&outline) / (0.5 * TAU * axial * axial),
    }
}

/// The points at which a grid of rays across the beam hits the film.
pub(super) fn arrivals(beam: &Beam<'_>, lens: &Lens, film_z: f64) -> Vec<DVec2> {
    let rays = beam.trace(lens, &beam.grid(GRID)).into_iter().flatten();
    rays.map(|out| out.at_z(film_z).truncate()).collect()
}

/// The modulation in white light, weighted by luminous efficiency. The transfer functions of the
/// wavelengths are added as complex numbers, so that lateral color is included.
pub(super) fn diffraction(waves: &[(f64, Wavefront)], frequencies: &[f64]) -> Modulation {
    let total: f64 = waves.iter().map(|(efficiency, _)| efficiency).sum();
    let curve = |axis: usize| -> Vec<f64> {
        let at = |f: &f64| {
            let parts = waves
                .iter()
                .map(|(efficiency, w)| *efficiency * w.transfer(*f, axis));
            parts.sum::<DVec2>().length() / total
        };
        frequencies.iter().map(at).collect()
    };
    Modulation {
        tangential: curve(1),
        sagittal: curve(0),
    }
}

/// The modulation of lines by the spot alone: the Fourier transform of the spot.
pub(super) fn geometric(spot: &[DVec2], at: &[f64]) -> Modulation {
    let curve = |axis: usize| -> Vec<f64> {
        at.iter()
            .map(|f| {
                let sum = spot.iter().fold(DVec2::ZERO, |sum, p| {
                    let phase = TAU * f * p[axis];
                    sum + DVec2::new(libm::cos(phase), libm::sin(phase))
                });
                sum.length() / spot.len() as f64
            })
            .collect()
    };
    Modulation {
        tangential: curve(1),
        sagittal: curve(0),
    }
}
