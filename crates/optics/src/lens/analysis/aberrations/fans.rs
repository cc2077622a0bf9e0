//! Ray fans, and the wavefront of a point with its Zernike coefficients.
//!
//! Pupil coordinates are those of `point_rays`. Wavefront aberrations are in
//! waves of the ray's wavelength, relative to the sphere around the chief ray's arrival on the film
//! through the paraxial exit pupil.

use std::collections::HashSet;

use glam::{DVec2, IVec2};
use serde::Serialize;

use super::point_rays::{PointAim, PointRays, stop_radius};
use super::zernike::{TERMS, fit, value};
use crate::lens::analysis::curves::Conjugate;
use crate::lens::lens::Lens;

/// The number of rays of a fan on each side of the chief ray.
pub(crate) const STEPS: usize = 20;
/// The number of places across the unit disc at which the wavefront is sampled.
const SAMPLES: usize = 32;
/// The distance between two of these places.
const STEP: f64 = 2.0 / SAMPLES as f64;
/// The number of times that the distance between two places is halved to find the rim of the beam.
/// The rim is found to 2.4e-4 of the disc's radius.
const HALVINGS: usize = 8;

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
    /// Its largest less its least value with the rim of the beam, without piston and tilt.
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

/// The wavefront on a grid of the unit disc, with the aims of its rays.
fn samples(rays: &PointRays<'_>) -> Vec<(DVec2, f64, PointAim)> {
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
                    found.push((pupil, ray.waves, aim));
                }
            }
        }
    }
    found
}

/// A place of the unit disc whose ray gets through, beside one whose ray does not.
struct RimStart {
    inside: DVec2,
    aim: PointAim,
    /// The direction of the other place.
    side: DVec2,
}

impl RimStart {
    /// The wavefront at the rim of the beam on the way to the other place, found by halving.
    fn rim(&self, rays: &PointRays<'_>) -> Option<(DVec2, f64)> {
        let (mut near, mut far) = ((0.0, self.aim), STEP);
        let mut last = None;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near.0 + far);
            let pupil = self.inside + middle * self.side;
            let is_on_disc = pupil.length() <= 1.0;
            match is_on_disc.then(|| rays.trace(pupil, near.1)).flatten() {
                Some((ray, aim)) => {
                    near = (middle, aim);
                    last = Some((pupil, ray.waves));
                }
                None => far = middle,
            }
        }
        last
    }

    /// Starts beside this one, in steps of an eighth of the grid's.
    fn beside(&self, rays: &PointRays<'_>) -> Vec<Self> {
        let start = |i: i32| {
            let inside = self.inside + f64::from(i) / 8.0 * STEP * self.side.perp();
            let (_, aim) = rays.trace(inside, self.aim)?;
            Some(Self {
                inside,
                aim,
                ..*self
            })
        };
        (-8..=8).filter_map(start).collect()
    }
}

/// The wavefront at the rim of the beam in the unit disc, where its extremes usually are: on each
/// line between two neighbors of the grid of which one gets through, and beside the extremes over
/// those, because the corners of a vignetted beam are between the lines. `level` is subtracted.
fn rim(
    rays: &PointRays<'_>,
    found: &[(DVec2, f64, PointAim)],
    level: impl Fn(&(DVec2, f64)) -> f64,
) -> Vec<f64> {
    let cell = |at: DVec2| ((at + 1.0) / STEP).floor().as_ivec2();
    let open: HashSet<IVec2> = found.iter().map(|(at, ..)| cell(*at)).collect();
    let mut rim = Vec::new();
    for (inside, _, aim) in found {
        for side in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
            if open.contains(&cell(inside + STEP * side)) {
                continue;
            }
            let start = RimStart {
                inside: *inside,
                aim: *aim,
                side,
            };
            rim.extend(start.rim(rays).map(|at| (level(&at), start)));
        }
    }
    rim.sort_by(|a, b| a.0.total_cmp(&b.0));
    let extremes = rim.first().into_iter().chain(rim.last());
    let beside = extremes.flat_map(|(_, start)| start.beside(rays));
    let beside: Vec<f64> = beside
        .filter_map(|start| Some(level(&start.rim(rays)?)))
        .collect();
    rim.iter().map(|(value, _)| *value).chain(beside).collect()
}

/// The wavefront and its coefficients; none if too few rays get through.
fn wavefront(rays: &PointRays<'_>) -> Option<WavefrontFit> {
    let aimed = samples(rays);
    let found: Vec<(DVec2, f64)> = aimed.iter().map(|(at, w, _)| (*at, *w)).collect();
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
    let beside = |coefficients: &[f64], (at, w): &(DVec2, f64)| -> f64 {
        let terms = coefficients.iter().enumerate();
        w - terms.map(|(j, c)| c * value(j + 1, *at)).sum::<f64>()
    };
    let rms =
        |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let level: Vec<f64> = found.iter().map(|at| beside(&plane, at)).collect();
    let rest: Vec<f64> = found.iter().map(|at| beside(&zernike, at)).collect();
    let all = [&level[..], &rim(rays, &aimed, |at| beside(&plane, at))].concat();
    let largest = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    Some(WavefrontFit {
        rms: rms(&level),
        peak_to_valley: largest - least,
        residual: rms(&rest),
        zernike,
        open,
    })
}
