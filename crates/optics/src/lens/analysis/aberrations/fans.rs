//! Ray fans, and the wavefront of a point with its Zernike coefficients.
//!
//! Pupil coordinates are those of `point_rays`. Wavefront aberrations are in
//! waves of the ray's wavelength, relative to the sphere around the chief ray's arrival on the film
//! through the paraxial exit pupil.

use glam::DVec2;
use serde::Serialize;

use super::point_rays::{PointAim, PointRays, stop_radius};
use super::zernike::{TERMS, fit, value};
use crate::lens::analysis::curves::Conjugate;
use crate::lens::lens::Lens;

/// The number of rays of a fan on each side of the chief ray.
pub(crate) const STEPS: usize = 20;
/// The number of places across the unit disc at which the wavefront is sampled.
const SAMPLES: usize = 32;

/// The fans of a point at one wavelength.
#[derive(Clone, Debug, Serialize)]
pub struct Fans {
    /// The wavelength in nanometers.
    pub wavelength_nm: f64,
    /// The rays in the meridian, from the lower rim (−1) to the upper (1).
    pub tangential: Vec<FanRay>,
    /// The rays across the meridian.
    pub sagittal: Vec<FanRay>,
}

/// A ray of a fan.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FanRay {
    /// The pupil coordinate.
    pub pupil: f64,
    /// The arrival on the film across the meridian, from that of the lens's own wavelength's chief
    /// ray, in millimeters.
    pub x: f64,
    /// The arrival in the meridian, likewise.
    pub y: f64,
    /// The wavefront aberration in waves, from the chief ray of the same wavelength.
    pub waves: f64,
}

/// The wavefront of a point at the lens's own wavelength, in waves.
#[derive(Clone, Debug, Serialize)]
pub struct WavefrontFit {
    /// The fringe Zernike coefficients from the first; fewer if vignetting leaves too little of the
    /// disc to determine them.
    pub zernike: Vec<f64>,
    /// The root mean square of the wavefront over the rays that get through, without piston and
    /// tilt.
    pub rms: f64,
    /// Its largest less its least value, without piston and tilt.
    pub peak_to_valley: f64,
    /// The root mean square of what the coefficients do not describe.
    pub residual: f64,
    /// The share of the unit disc that gets through.
    pub open: f64,
}

/// The rays of one point at the F line, at the lens's own wavelength and at the C line.
pub struct PointFans {
    /// The fans in the order of the wavelengths; only that of the lens's own wavelength if no glass
    /// has dispersion.
    pub fans: Vec<Fans>,
    /// The wavefront at the lens's own wavelength; `None` if vignetting leaves too few rays.
    pub wavefront: Option<WavefrontFit>,
}

impl PointFans {
    /// The fans of the point whose chief ray arrives at a height. `lines` are the lens at the three
    /// wavelengths. Returns none if the point has no chief ray.
    pub fn of(lines: &[Lens; 3], height: f64, conjugate: Conjugate) -> Option<Self> {
        let base = &lines[1];
        let radius = stop_radius(base, conjugate.distance)?;
        let own = PointRays::of(base, base, height, conjugate, radius)?;
        let dispersive = base.prescription().is_dispersive();
        let used: &[usize] = if dispersive { &[0, 1, 2] } else { &[1] };
        let fans = used.iter().filter_map(|line| {
            let lens = &lines[*line];
            let rays = PointRays::of(base, lens, height, conjugate, radius)?;
            let color = (rays.image - own.image).truncate();
            Some(Fans {
                wavelength_nm: lens.wavelength(),
                tangential: fan(&rays, DVec2::Y, color),
                sagittal: fan(&rays, DVec2::X, color),
            })
        });
        Some(Self {
            fans: fans.collect(),
            wavefront: wavefront(&own),
        })
    }
}

/// The rays along a diameter of the pupil that get through.
fn fan(rays: &PointRays<'_>, axis: DVec2, color: DVec2) -> Vec<FanRay> {
    let side = |sign: f64| {
        let found = rays.along(sign * axis, STEPS).into_iter().enumerate();
        found.filter_map(move |(i, ray)| {
            let ray = ray?;
            Some(FanRay {
                pupil: sign * i as f64 / STEPS as f64,
                x: ray.arrival.x + color.x,
                y: ray.arrival.y + color.y,
                waves: ray.waves,
            })
        })
    };
    let mut all: Vec<FanRay> = side(-1.0).filter(|ray| ray.pupil < 0.0).collect();
    all.reverse();
    all.extend(side(1.0));
    all
}

/// The wavefront on a grid of the unit disc.
fn samples(rays: &PointRays<'_>) -> Vec<(DVec2, f64)> {
    let cell = |i: usize| (2.0 * i as f64 + 1.0) / SAMPLES as f64 - 1.0;
    let mut found = Vec::new();
    for i in 0..SAMPLES {
        // Each column starts at the middle, where the rays are easiest to aim.
        for sign in [1.0, -1.0] {
            let mut near = PointAim::default();
            for j in SAMPLES / 2..SAMPLES {
                let pupil = DVec2::new(cell(i), sign * cell(j));
                if pupil.length() > 1.0 {
                    break;
                }
                if let Some((ray, aim)) = rays.trace(pupil, near) {
                    near = aim;
                    found.push((pupil, ray.waves));
                }
            }
        }
    }
    found
}

/// The wavefront and its coefficients; none if too few rays get through.
fn wavefront(rays: &PointRays<'_>) -> Option<WavefrontFit> {
    let found = samples(rays);
    let cell = |i: usize| (2.0 * i as f64 + 1.0) / SAMPLES as f64 - 1.0;
    let all = (0..SAMPLES * SAMPLES)
        .map(|k| DVec2::new(cell(k % SAMPLES), cell(k / SAMPLES)))
        .filter(|p| p.length() <= 1.0)
        .count();
    let open = found.len() as f64 / all as f64;
    let terms = match open {
        o if o > 0.6 => TERMS,
        o if o > 0.3 => 16,
        _ => 9,
    };
    let zernike = fit(&found, terms)?;
    let plane = fit(&found, 3)?;
    let beside = |coefficients: &[f64]| -> Vec<f64> {
        let known = |at: DVec2| -> f64 {
            let terms = coefficients.iter().enumerate();
            terms.map(|(j, c)| c * value(j + 1, at)).sum()
        };
        found.iter().map(|(at, waves)| waves - known(*at)).collect()
    };
    let rms =
        |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let level = beside(&plane);
    let largest = level.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = level.iter().copied().fold(f64::INFINITY, f64::min);
    Some(WavefrontFit {
        rms: rms(&level),
        peak_to_valley: largest - least,
        residual: rms(&beside(&zernike)),
        zernike,
        open,
    })
}
