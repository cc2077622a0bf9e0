//! Figures of merit of one lens among many, for optimizers and tolerances.
//!
//! They are those of the data sheet by fewer rays: a spot has 72 in each color, the best focus 128,
//! and the outline of a pupil 96 points.

use std::f64::consts::TAU;

use glam::DVec2;
use serde::Serialize;

use super::point_rays::{PointAim, PointRays, PupilRay, stop_radius_of};
use crate::lens::analysis::curves::{Conjugate, DistortionReference};
use crate::lens::analysis::points::geometric;
use crate::lens::lens::Lens;
use crate::lens::optics::chief_ray::angle_of;

/// The number of rings of equal area in the pupil.
const RINGS: usize = 6;
/// The number of rays on a ring.
const SPOKES: usize = 12;
/// The number of rings by which the best focus is found.
const FOCUS_RINGS: usize = 32;
/// The number of points of the outline of a pupil. What the polygon lacks cancels in relative
/// illumination.
const OUTLINE: usize = 96;

/// Where the film stands.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeritFilm {
    /// Where the rms spot of the axis is least.
    Best,
    /// At the paraxial image.
    Paraxial,
    /// At a z in millimeters from the front vertex.
    At(f64),
}

/// What figures of merit are computed for.
#[derive(Clone, Debug)]
pub struct MeritSetting {
    /// The distance of the object from the front vertex in millimeters; it may be infinite.
    pub distance: f64,
    /// Where the film stands.
    pub film: MeritFilm,
    /// Half of the film's diagonal in millimeters, which decides what distortion is measured
    /// against.
    pub image_height: f64,
    /// The heights of the points on the film, in millimeters.
    pub heights: Vec<f64>,
    /// The frequencies of the modulation, in line pairs per millimeter.
    pub frequencies: Vec<f64>,
}

/// The figures of merit of a lens. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct Merit {
    /// The focal length.
    pub efl: f64,
    /// The distance from the last vertex to the rear focal point.
    pub bfl: f64,
    /// The focal length over the diameter of the widest axial beam.
    pub f_number: f64,
    /// The z of the film, from the front vertex.
    pub film_z: f64,
    /// The points; none for one without light.
    pub points: Vec<Option<MeritPoint>>,
}

/// The figures of merit of a point. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct MeritPoint {
    /// The height on the film.
    pub height: f64,
    /// The angle of the chief ray in the scene, in degrees.
    pub angle: f64,
    /// The rms radius of the spot of all colors about its centroid.
    pub rms: f64,
    /// The rms of the wavefront at the lens's wavelength, in waves, without piston and tilt.
    pub wavefront: f64,
    /// The distortion of the data sheet as a share.
    pub distortion: Option<f64>,
    /// The light over that of the axis.
    pub illumination: f64,
    /// The modulation by rays at each frequency, tangential and sagittal.
    pub modulation: Vec<[f64; 2]>,
}

impl Merit {
    /// Computes the figures of merit; none for an afocal lens, or one without light or a stop.
    pub fn of(lens: &Lens, setting: &MeritSetting) -> Option<Self> {
        let focal = lens.first_order().focal?;
        let beam = lens.beam_height(setting.distance);
        let conjugate = |film_z: f64| Conjugate {
            distance: setting.distance,
            film_z,
        };
        let film_z = match setting.film {
            MeritFilm::Best => lens.best_focus_of(setting.distance, beam, FOCUS_RINGS)?,
            MeritFilm::Paraxial => conjugate(0.0).paraxial_image(lens)?,
            MeritFilm::At(z) => z,
        };
        let axial = match setting.distance.is_finite() {
            true => lens.axial_beam().height,
            false => beam,
        };
        let lines = match lens.prescription().is_dispersive() {
            true => lens
                .spectral_lines()
                .map(|nm| lens.at_wavelength(nm))
                .to_vec(),
            false => vec![lens.clone()],
        };
        let points = MeritPoints {
            lens,
            lines,
            conjugate: conjugate(film_z),
            projection: conjugate(film_z).projection(lens, setting.image_height),
            radius: stop_radius_of(lens, setting.distance, beam)?,
            axis: lens.irradiance_by(DVec2::ZERO, film_z, OUTLINE).0,
            frequencies: &setting.frequencies,
        };
        Some(Self {
            efl: focal.efl,
            bfl: focal.bfl,
            f_number: focal.efl.abs() / (2.0 * axial),
            film_z,
            points: setting.heights.iter().map(|h| points.at(*h)).collect(),
        })
    }

    /// The largest rms spot of the points; none if a point has no light.
    pub fn worst_rms(&self) -> Option<f64> {
        let rms = |point: &Option<MeritPoint>| point.as_ref().map(|point| point.rms);
        let all: Option<Vec<f64>> = self.points.iter().map(rms).collect();
        Some(all?.into_iter().fold(0.0, f64::max))
    }
}

/// What the points of a lens share.
struct MeritPoints<'a> {
    lens: &'a Lens,
    /// The lens at its spectral lines, of which the middle one is its own.
    lines: Vec<Lens>,
    conjugate: Conjugate,
    /// What distortion is measured against.
    projection: DistortionReference,
    /// The height of the widest axial ray at the stop.
    radius: f64,
    /// The light on the axis, in steradians.
    axis: f64,
    frequencies: &'a [f64],
}

impl MeritPoints<'_> {
    fn at(&self, height: f64) -> Option<MeritPoint> {
        let film = DVec2::new(0.0, height);
        let rays = |line: &Lens| {
            PointRays::of(self.lens, line, height, self.conjugate, self.radius)
                .map(|rays| (rays.image, bundle(&rays, self.lens.is_rotational())))
        };
        let all: Option<Vec<_>> = self.lines.iter().map(rays).collect();
        let all = all?;
        let (own, mono) = &all[all.len() / 2];
        if mono.len() < RINGS {
            return None;
        }
        let spot = all.iter().flat_map(|(image, rays)| {
            let color = (*image - *own).truncate();
            rays.iter().map(move |(_, ray)| ray.arrival + color)
        });
        let spot: Vec<DVec2> = spot.collect();
        let centroid = spot.iter().sum::<DVec2>() / spot.len() as f64;
        let spot: Vec<DVec2> = spot.into_iter().map(|p| p - centroid).collect();
        let square: f64 = spot.iter().map(|p| p.length_squared()).sum();
        let modulation = geometric(&spot, self.frequencies);
        let (film_z, light) = (
            self.conjugate.film_z,
            self.lens
                .irradiance_by(film, self.conjugate.film_z, OUTLINE)
                .0,
        );
        let chief = self.lens.chief_ray(film, film_z);
        Some(MeritPoint {
            height,
            angle: chief.map_or(0.0, |chief| angle_of(chief.direction).to_degrees()),
            rms: (square / spot.len() as f64).sqrt(),
            wavefront: wavefront_rms(mono),
            distortion: chief.and_then(|chief| self.projection.distortion(&chief, height)),
            illumination: light / self.axis,
            modulation: std::iter::zip(modulation.tangential, modulation.sagittal)
                .map(|(tangential, sagittal)| [tangential, sagittal])
                .collect(),
        })
    }
}

/// The rays of a point that get through the pupil, with their pupil coordinates. A lens with
/// rotational symmetry has those of the other half mirrored.
fn bundle(rays: &PointRays<'_>, is_symmetric: bool) -> Vec<(DVec2, PupilRay)> {
    let mut found = Vec::with_capacity(RINGS * SPOKES);
    let spokes = if is_symmetric { SPOKES / 2 } else { SPOKES };
    for spoke in 0..spokes {
        let angle = TAU * ((spoke as f64 + 0.5) / SPOKES as f64 - 0.25);
        let (sin, cos) = libm::sincos(angle);
        let mut near = PointAim::default();
        for ring in 0..RINGS {
            let r = ((ring as f64 + 0.5) / RINGS as f64).sqrt();
            let pupil = r * DVec2::new(cos, sin);
            if let Some((ray, aim)) = rays.trace(pupil, near) {
                near = aim;
                found.push((pupil, ray));
            }
        }
    }
    if is_symmetric {
        let half = found.clone();
        found.extend(half.into_iter().map(|(pupil, mut ray)| {
            ray.arrival.x = -ray.arrival.x;
            (DVec2::new(-pupil.x, pupil.y), ray)
        }));
    }
    found
}

/// The rms of the waves beside the plane that fits them best.
fn wavefront_rms(rays: &[(DVec2, PupilRay)]) -> f64 {
    let count = rays.len() as f64;
    let mean =
        |value: &dyn Fn(&(DVec2, PupilRay)) -> f64| rays.iter().map(value).sum::<f64>() / count;
    let (x, y, w) = (
        mean(&|ray| ray.0.x),
        mean(&|ray| ray.0.y),
        mean(&|ray| ray.1.waves),
    );
    let [xx, yy, xy] = [
        mean(&|ray| (ray.0.x - x) * (ray.0.x - x)),
        mean(&|ray| (ray.0.y - y) * (ray.0.y - y)),
        mean(&|ray| (ray.0.x - x) * (ray.0.y - y)),
    ];
    let [xw, yw] = [
        mean(&|ray| (ray.0.x - x) * (ray.1.waves - w)),
        mean(&|ray| (ray.0.y - y) * (ray.1.waves - w)),
    ];
    let determinant = xx * yy - xy * xy;
    let (a, b) = match determinant > 0.0 {
        true => (
            (xw * yy - yw * xy) / determinant,
            (yw * xx - xw * xy) / determinant,
        ),
        false => (0.0, 0.0),
    };
    let rest = |ray: &(DVec2, PupilRay)| {
        let off = ray.1.waves - w - a * (ray.0.x - x) - b * (ray.0.y - y);
        off * off
    };
    mean(&rest).sqrt()
}
