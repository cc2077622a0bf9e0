//! Figures of merit of one lens among many, for optimizers and tolerances.
//!
//! They are those of the data sheet by fewer rays: a spot has 144 in each color, the best focus
//! 128, and the outline of a beam 96 points.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::point_rays::{PointAim, PointRays, stop_radius_of};
use crate::lens::analysis::beam::Beam;
use crate::lens::analysis::curves::{Conjugate, DistortionReference};
use crate::lens::analysis::points::geometric;
use crate::lens::lens::Lens;
use crate::lens::optics::chief_ray::angle_of;

/// The number of rings in the pupil.
const RINGS: usize = 6;
/// The shares of the area within each ring: the nodes of Chebyshev's quadrature, whose weights are
/// equal (Abramowitz and Stegun, *Handbook of Mathematical Functions*, 25.4.28). It is exact for
/// polynomials of degree 7 in the square of the radius.
const RING_SHARES: [f64; RINGS] = [
    0.066_876_590_946_09,
    0.288_740_673_119_444,
    0.366_682_299_241_647_5,
    0.633_317_700_758_352_5,
    0.711_259_326_880_556,
    0.933_123_409_053_91,
];
/// The number of rays on a ring, in directions between which the pupil has equal areas.
const SPOKES: usize = 24;
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
        let (film, film_z) = (DVec2::new(0.0, height), self.conjugate.film_z);
        let outline = self.lens.pupil_outline(film, film_z, OUTLINE)?;
        let of = |line| PointRays::of(self.lens, line, height, self.conjugate, self.radius);
        let lines: Vec<PointRays<'_>> = self.lines.iter().map(of).collect::<Option<_>>()?;
        let own = &lines[lines.len() / 2];
        let places = self.places(own, film.extend(film_z), outline.0)?;
        // Of a lens with rotational symmetry the other half is mirrored.
        let sides = if self.lens.is_rotational() { 2 } else { 1 };
        let both = |at: DVec2| [at, DVec2::new(-at.x, at.y)].into_iter().take(sides);
        let (mut spot, mut waves) = (Vec::new(), Vec::new());
        for (i, line) in lines.iter().enumerate() {
            let color = (line.image - own.image).truncate();
            for place in &places {
                // The places are inside the beam at the lens's own wavelength, so that apertures do
                // not block the rays: no ray of another color comes or goes.
                let Some(ray) = line.through(*place, false) else {
                    continue;
                };
                spot.extend(both(ray.arrival).map(|arrival| arrival + color));
                if i == lines.len() / 2
                    && let Some(pupil) = own.at_stop(*place)
                {
                    waves.extend(both(pupil).map(|pupil| (pupil, ray.waves)));
                }
            }
        }
        if waves.len() < RINGS {
            return None;
        }
        let centroid = spot.iter().sum::<DVec2>() / spot.len() as f64;
        let spot: Vec<DVec2> = spot.into_iter().map(|p| p - centroid).collect();
        let square: f64 = spot.iter().map(|p| p.length_squared()).sum();
        let modulation = geometric(&spot, self.frequencies);
        let light = self.lens.irradiance_through(film, film_z, &outline).0;
        let chief = self.lens.chief_ray(film, film_z);
        Some(MeritPoint {
            height,
            angle: chief.map_or(0.0, |chief| angle_of(chief.direction).to_degrees()),
            rms: (square / spot.len() as f64).sqrt(),
            wavefront: wavefront_rms(&waves),
            distortion: chief.and_then(|chief| self.projection.distortion(&chief, height)),
            illumination: light / self.axis,
            modulation: std::iter::zip(modulation.tangential, modulation.sagittal)
                .map(|(tangential, sagittal)| [tangential, sagittal])
                .collect(),
        })
    }

    /// Places across the chief ray, in millimeters, whose rays have equal shares of the light:
    /// equal areas of the beam in front of the lens. Of a lens with rotational symmetry they are
    /// those of one half. `center` is inside the pupil of the film point.
    fn places(&self, rays: &PointRays<'_>, film: DVec3, center: DVec2) -> Option<Vec<DVec2>> {
        let (directions, spokes) = self.directions();
        let measured = |middle: DVec2| {
            let middle = match self.lens.is_rotational() {
                true => DVec2::new(0.0, middle.y),
                false => middle,
            };
            Some((middle, rays.rims(middle, &directions)?))
        };
        let of_film = || rays.aim(rays.at_stop_from_film(film, center)?, PointAim::default());
        let of_beam = || Beam::of(self.lens, film.y, film.z, self.conjugate.distance)?.inside();
        let found = of_film().and_then(|aim| measured(aim.place));
        let (middle, rims) = found.or_else(|| measured(of_beam()?))?;
        let ends = std::iter::zip(directions, rims).map(|(direction, rim)| {
            let place = rim * direction;
            let closed = rays.closed_parts(middle, place).into_iter();
            BeamRim {
                place,
                closed: closed.map(|[from, to]| [from * from, to * to]).collect(),
            }
        });
        let ends: Vec<BeamRim> = ends.collect();
        let areas: Vec<f64> = ends.windows(2).map(|e| e[0].area_to(&e[1])).collect();
        let total: f64 = areas.iter().sum();
        let (mut edge, mut before) = (0, 0.0);
        let mut places = Vec::with_capacity(RINGS * spokes);
        for spoke in 0..spokes {
            let share = total * (spoke as f64 + 0.5) / spokes as f64;
            while edge + 1 < areas.len() && before + areas[edge] < share {
                before += areas[edge];
                edge += 1;
            }
            let [from, to] = [ends.get(edge)?, ends.get(edge + 1)?];
            let part = (share - before) / areas[edge];
            let nearest = if part < 0.5 { from } else { to };
            let end = from.place.lerp(to.place, part);
            places.extend(RING_SHARES.map(|share| middle + nearest.out(share) * end));
        }
        Some(places)
    }

    /// Directions over a turn, both ends included, and the number of spokes. Of a lens with
    /// rotational symmetry they are those of the half with positive x.
    fn directions(&self) -> (Vec<DVec2>, usize) {
        let [count, spokes] = match self.lens.is_rotational() {
            true => [OUTLINE / 2, SPOKES / 2],
            false => [OUTLINE, SPOKES],
        };
        let direction = |i: usize| {
            let (sin, cos) = libm::sincos(TAU * (i as f64 / OUTLINE as f64 - 0.25));
            DVec2::new(cos, sin)
        };
        ((0..=count).map(direction).collect(), spokes)
    }
}

/// A point of the rim of a beam in front of the lens, relative to its middle.
struct BeamRim {
    place: DVec2,
    /// The parts of the way there that are closed, as squares of shares of the distance.
    closed: Vec<[f64; 2]>,
}

impl BeamRim {
    /// The share of the area on the way there that is open.
    fn open(&self) -> f64 {
        1.0 - self.closed.iter().map(|[from, to]| to - from).sum::<f64>()
    }

    /// Twice the open area of the triangle to another point.
    fn area_to(&self, other: &Self) -> f64 {
        0.5 * self.place.perp_dot(other.place).abs() * (self.open() + other.open())
    }

    /// The share of the distance within which a share of the open area lies.
    fn out(&self, share: f64) -> f64 {
        let past = |share: f64, [from, to]: &[f64; 2]| match share < *from {
            true => share,
            false => share + to - from,
        };
        self.closed.iter().fold(share * self.open(), past).sqrt()
    }
}

/// The rms of the waves at pupil coordinates beside the plane that fits them best.
fn wavefront_rms(rays: &[(DVec2, f64)]) -> f64 {
    let count = rays.len() as f64;
    let mean = |value: &dyn Fn(&(DVec2, f64)) -> f64| rays.iter().map(value).sum::<f64>() / count;
    let (x, y, w) = (
        mean(&|ray| ray.0.x),
        mean(&|ray| ray.0.y),
        mean(&|ray| ray.1),
    );
    let [xx, yy, xy] = [
        mean(&|ray| (ray.0.x - x) * (ray.0.x - x)),
        mean(&|ray| (ray.0.y - y) * (ray.0.y - y)),
        mean(&|ray| (ray.0.x - x) * (ray.0.y - y)),
    ];
    let [xw, yw] = [
        mean(&|ray| (ray.0.x - x) * (ray.1 - w)),
        mean(&|ray| (ray.0.y - y) * (ray.1 - w)),
    ];
    let determinant = xx * yy - xy * xy;
    let (a, b) = match determinant > 0.0 {
        true => (
            (xw * yy - yw * xy) / determinant,
            (yw * xx - xw * xy) / determinant,
        ),
        false => (0.0, 0.0),
    };
    let rest = |ray: &(DVec2, f64)| {
        let off = ray.1 - w - a * (ray.0.x - x) - b * (ray.0.y - y);
        off * off
    };
    mean(&rest).sqrt()
}
