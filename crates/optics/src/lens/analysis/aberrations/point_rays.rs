//! Rays of one object point through given places of the stop.
//!
//! A place is a pair of pupil coordinates: the point where the ray crosses the stop, over the
//! height at which the widest ray from the axis crosses it. So (0, 0) is the chief ray, and for a
//! point on the axis the unit circle is the beam. x is across the meridian and y in it. Apertures
//! block rays, so a vignetted beam covers a part of the unit disc.

use std::iter::zip;

use glam::{DMat2, DVec2, DVec3};
use ivcam_base::math::lanes::LANES;

use crate::lens::analysis::curves::Conjugate;
use crate::lens::analysis::ideal_lenses::ObjectsOfIdealLenses;
use crate::lens::lens::Lens;
use crate::lens::pupil::search::rim::{Bracket, close};
use crate::lens::trace::ray::{LensRay, Toward};
use crate::lens::trace::tracer::Tracer;

/// The rays of one object point at one wavelength. Lengths are in millimeters.
pub(super) struct PointRays<'a> {
    lens: &'a Lens,
    film_z: f64,
    stop: usize,
    /// The radius of the unit circle at the stop.
    radius: f64,
    /// The chief ray's point on the front surface, and its direction toward the film.
    start: DVec3,
    direction: DVec3,
    /// The object point; none for parallel light.
    source: Option<DVec3>,
    /// The index of each medium, from the one in front of the lens.
    indices: Vec<f64>,
    ideal: ObjectsOfIdealLenses,
    /// The radius of the reference sphere: the distance from the paraxial exit pupil on the axis to
    /// the image point; infinite if that pupil is at infinity.
    sphere: f64,
    /// The chief ray's arrival on the film.
    pub image: DVec3,
    /// The optical path of the chief ray to the image point.
    path: f64,
}

/// A ray of a point that got through the lens.
#[derive(Clone, Copy, Debug)]
pub(super) struct PupilRay {
    /// The place where it arrives on the film, from the chief ray's, in millimeters.
    pub arrival: DVec2,
    /// The optical path difference in waves: that of the chief ray less that of this ray, both to
    /// the reference sphere. It is positive where the wavefront is ahead of the sphere.
    pub waves: f64,
}

/// A place across the chief ray, in millimeters, whose ray crosses the stop at wanted coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointAim {
    pub place: DVec2,
    /// The slopes of the coordinates over the place, if they are known.
    slopes: Option<DMat2>,
}

/// The height at the stop of the widest ray from the object point on the axis, in millimeters.
pub(super) fn stop_radius(lens: &Lens, distance: f64) -> Option<f64> {
    stop_radius_of(lens, distance, lens.beam_height(distance))
}

/// The height at the stop of the ray from the object point on the axis that has a height in the
/// plane of the front vertex, in millimeters.
pub(super) fn stop_radius_of(lens: &Lens, distance: f64, height: f64) -> Option<f64> {
    let stop = lens.first_order().stop?;
    let ray = lens.axial_ray(distance, height);
    let radius = lens.hits_on_surfaces(&ray).get(stop)?.length();
    (radius > 0.0).then_some(radius)
}

impl<'a> PointRays<'a> {
    /// The rays of the object point whose chief ray arrives at a height on the film at the
    /// wavelength of `base`. `lens` may be that lens at another wavelength, and `radius` is its
    /// [`stop_radius`] at the wavelength of `base`.
    pub(super) fn of(
        base: &Lens,
        lens: &'a Lens,
        height: f64,
        conjugate: Conjugate,
        radius: f64,
    ) -> Option<Self> {
        let chief = base.chief_ray(DVec2::new(0.0, height), conjugate.film_z)?;
        let direction = -chief.direction;
        let source = conjugate.distance.is_finite().then(|| {
            let far = (-conjugate.distance - chief.origin.z) / chief.direction.z;
            chief.origin + far * chief.direction
        });
        if source.is_some_and(|s| !s.is_finite() || s.z >= chief.origin.z) {
            return None;
        }
        let mut this = Self {
            lens,
            film_z: conjugate.film_z,
            stop: lens.first_order().stop?,
            radius,
            start: chief.origin,
            direction,
            source,
            indices: lens.prescription().indices(lens.wavelength()),
            ideal: ObjectsOfIdealLenses::new(lens, conjugate.distance),
            sphere: f64::INFINITY,
            image: DVec3::ZERO,
            path: 0.0,
        };
        let place = this.aim(DVec2::ZERO, PointAim::default())?.place;
        let (out, path) = this.arrival(place, false)?;
        this.image = out.at_z(this.film_z);
        if let Some(pupil) = lens.first_order().exit_pupil {
            this.sphere = (this.image - pupil.z * DVec3::Z).length();
        }
        let n = this.indices[this.indices.len() - 1];
        this.path = path + n * (this.image - out.origin).dot(out.direction);
        Some(this)
    }

    /// The ray through a place across the chief ray, in millimeters.
    fn ray(&self, place: DVec2) -> LensRay {
        let up = DVec3::new(0.0, self.direction.z, -self.direction.y);
        let through = self.start + place.x * DVec3::X + place.y * up;
        match self.source {
            Some(origin) => LensRay::new(origin, through - origin),
            None => LensRay::new(
                through - (1.0 + self.lens.length().abs()) * self.direction,
                self.direction,
            ),
        }
    }

    /// The point at which the ray through a place crosses the stop, over the unit radius.
    pub(super) fn at_stop(&self, place: DVec2) -> Option<DVec2> {
        let mut found = None;
        // The surfaces behind the stop make no difference. The outcome does not matter either: a
        // ray that is totally reflected at the stop has crossed it.
        let tracer = Tracer {
            elements: &self.lens.elements()[..=self.stop],
            ..self.lens.tracer(Toward::Film, false)
        };
        let _ = tracer.walk(self.ray(place), |surface, _, hit| {
            if surface == self.stop {
                found = Some(hit.point.truncate() / self.radius);
            }
        });
        found
    }

    /// The pupil coordinates of the ray from a film point to an aim on the rear vertex plane.
    pub(super) fn at_stop_from_film(&self, film: DVec3, aim: DVec2) -> Option<DVec2> {
        let mut found = None;
        let ray = LensRay::new(film, aim.extend(self.lens.length()) - film);
        let tracer = self.lens.tracer(Toward::Scene, false);
        let _ = tracer.walk(ray, |surface, _, hit| {
            if surface == self.stop {
                found = Some(hit.point.truncate() / self.radius);
            }
        });
        found
    }

    /// The distances in millimeters from a place inside the beam to its rim, in directions across
    /// the chief ray, without what closes the middle of a surface; none if the place is outside.
    pub(super) fn rims(&self, inside: DVec2, directions: &[DVec2]) -> Option<Vec<f64>> {
        let farthest = 3.2 * self.lens.prescription().widest_semi_diameter();
        let fill = self.lens.fills_toward_film(&[self.ray(inside)]).fill[0];
        let mut rims = Vec::with_capacity(directions.len());
        for directions in directions.chunks(LANES) {
            let guess = rims.last().copied().unwrap_or(self.radius);
            let mut brackets = vec![Bracket::new(fill - 1.0, guess); directions.len()];
            close(&mut brackets, 1e-10, farthest, |brackets| {
                let places = zip(brackets, directions).map(|(b, d)| inside + b.next * d);
                let rays: Vec<LensRay> = places.map(|place| self.ray(place)).collect();
                let found = self.lens.fills_toward_film(&rays);
                (found.fill, found.limit)
            });
            rims.extend(brackets.iter().map(|bracket| bracket.high));
        }
        (fill < 1.0).then_some(rims)
    }

    /// The parts of a line in the beam, from a place to a point `across` it, that the closed middle
    /// of a surface takes, from 0 at the place to 1.
    pub(super) fn closed_parts(&self, place: DVec2, across: DVec2) -> Vec<[f64; 2]> {
        let ray = |t: f64| self.ray(place + t * across);
        match self.lens.is_obstructed() {
            true => self.lens.closed_parts_of(ray, Toward::Film),
            false => Vec::new(),
        }
    }

    /// The slopes of [`Self::at_stop`] at a place, by central differences.
    fn slopes(&self, place: DVec2) -> Option<DMat2> {
        let step = 1e-4 * self.radius;
        let slope = |axis: DVec2| {
            let (a, b) = (
                self.at_stop(place + step * axis)?,
                self.at_stop(place - step * axis)?,
            );
            Some((a - b) / (2.0 * step))
        };
        Some(DMat2::from_cols(slope(DVec2::X)?, slope(DVec2::Y)?))
    }

    /// The place whose ray crosses the stop at pupil coordinates, by Newton's iteration from a
    /// place nearby.
    ///
    /// The slopes come from the neighbor and are corrected after each step by Broyden's formula,
    /// which takes one ray instead of five. They are measured where a step gains less than a
    /// factor of four.
    pub(super) fn aim(&self, pupil: DVec2, near: PointAim) -> Option<PointAim> {
        let mut place = near.place;
        let mut miss = self.at_stop(place)? - pupil;
        let mut is_measured = near.slopes.is_none();
        let mut slopes = match near.slopes {
            Some(slopes) => slopes,
            None => self.slopes(place)?,
        };
        for _ in 0..40 {
            if miss.length() < 1e-13 {
                break;
            }
            let change = -slopes.inverse() * miss;
            let next = place + change;
            let value = next.is_finite().then(|| self.at_stop(next)).flatten();
            let value = value.map(|at| at - pupil);
            let gain = value.map_or(f64::INFINITY, |value| value.length() / miss.length());
            if gain >= 1.0 && (is_measured || miss.length() < 1e-12) {
                // The slopes are as good as they get: the rounding errors are reached.
                break;
            }
            if let Some(value) = value.filter(|_| gain < 1.0) {
                let surprise = value - miss - slopes * change;
                slopes += outer(surprise, change / change.length_squared());
                (place, miss) = (next, value);
            }
            is_measured = gain > 0.25;
            if is_measured {
                slopes = self.slopes(place)?;
            }
        }
        let slopes = Some(slopes);
        (miss.length() < 1e-10).then_some(PointAim { place, slopes })
    }

    /// The ray through a place behind the lens, with its optical path to its last hit.
    fn arrival(&self, place: DVec2, apertures: bool) -> Option<(LensRay, f64)> {
        let ray = self.ray(place);
        let path = self.lens.trace_path(&ray, Toward::Film, apertures);
        let out = path.outcome.ok().filter(|out| out.direction.z > 1e-3)?;
        let first = *path.hits.first()?;
        // Parallel light is in phase on the plane through `start` across the chief ray.
        let lead = match self.source {
            Some(origin) => (first - origin).length(),
            None => (first - self.start).dot(self.direction),
        };
        let mut optical = self.indices[0] * lead;
        let behind = self.indices[1..].iter().zip(&self.lens.elements()[1..]);
        for (legs, (n, element)) in path.hits.windows(2).zip(behind) {
            // The length is signed, because a ray may travel backward between surfaces that cross.
            let leg = legs[1] - legs[0];
            optical += n * leg.length().copysign(element.along(leg));
        }
        Some((out, optical + self.ideal.path(self.lens, &ray)))
    }

    /// The ray through pupil coordinates, and its aim, from which that of a neighbor may start.
    /// Returns none if the ray is blocked or lost.
    pub(super) fn trace(&self, pupil: DVec2, near: PointAim) -> Option<(PupilRay, PointAim)> {
        let aim = self.aim(pupil, near)?;
        Some((self.through(aim.place, true)?, aim))
    }

    /// The ray through a place across the chief ray, in millimeters. Returns none if it is lost, or
    /// blocked by an aperture.
    pub(super) fn through(&self, place: DVec2, apertures: bool) -> Option<PupilRay> {
        let (out, path) = self.arrival(place, apertures)?;
        let n = self.indices[self.indices.len() - 1];
        // The foot of the perpendicular from the image point, and from there to the sphere.
        let along = (self.image - out.origin).dot(out.direction);
        let miss = (out.origin + along * out.direction - self.image).length_squared();
        let sphere = match self.sphere.is_finite() {
            true => miss / (self.sphere + (self.sphere * self.sphere - miss).sqrt()),
            false => 0.0,
        };
        let behind = path + n * (along + sphere) - self.path;
        Some(PupilRay {
            arrival: (out.at_z(self.film_z) - self.image).truncate(),
            waves: -behind / (self.lens.wavelength() * 1e-6),
        })
    }

    /// The rays through pupil coordinates that are in steps along a line from the center; none for
    /// those that are lost.
    pub(super) fn along(&self, direction: DVec2, steps: usize) -> Vec<Option<PupilRay>> {
        let mut near = PointAim::default();
        let mut rays = Vec::with_capacity(steps + 1);
        for i in 0..=steps {
            // The rim itself may round to either side of the aperture.
            let pupil = direction * (i as f64 / steps as f64).min(1.0 - 1e-9);
            let found = self.trace(pupil, near).or_else(|| {
                // A blocked ray still shows where its neighbor goes.
                near = self.aim(pupil, near).unwrap_or(near);
                None
            });
            if let Some((_, aim)) = found {
                near = aim;
            }
            rays.push(found.map(|(ray, _)| ray));
        }
        rays
    }
}

/// The matrix a bᵀ.
fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(b.x * a, b.y * a)
}
