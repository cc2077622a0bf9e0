//! The beam from one object point to one height of the film.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::lens::analysis::ideal_lenses::ObjectsOfIdealLenses;
use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Toward};

/// The beam that arrives at a height of the film. Its rays are given by places in a plane across
/// the chief ray, in millimeters.
pub struct Beam<'a> {
    lens: &'a Lens,
    /// The height on the film, in millimeters.
    pub height: f64,
    /// A point of the chief ray in front of the lens, in millimeters.
    start: DVec3,
    /// The unit direction of the chief ray in front of the lens, toward the film.
    pub d: DVec3,
    /// The object point, in millimeters; none for parallel light.
    source: Option<DVec3>,
    /// The unit vector across the meridian.
    u: DVec3,
    /// The unit vector in the meridian, perpendicular to the chief ray.
    v: DVec3,
    /// The lower corner of the bounding box of the places whose rays get through.
    low: DVec2,
    /// The upper corner of that box.
    high: DVec2,
}

impl<'a> Beam<'a> {
    /// The beam of the point whose chief ray arrives at `height`, in a plane perpendicular to the
    /// axis at a `distance` from the front vertex. The distance is in millimeters and may be
    /// infinite. Returns none if there is no chief ray or no light gets through.
    pub fn of(lens: &'a Lens, height: f64, film_z: f64, distance: f64) -> Option<Self> {
        let chief = lens.chief_ray(DVec2::new(0.0, height), film_z)?;
        let d = -chief.direction;
        let source = distance.is_finite().then(|| {
            let far = (-distance - chief.origin.z) / chief.direction.z;
            chief.origin + far * chief.direction
        });
        if source.is_some_and(|s| !s.is_finite() || s.z >= chief.origin.z) {
            // A fish-eye's chief ray may never reach the plane.
            return None;
        }
        let mut this = Self {
            lens,
            height,
            start: chief.origin,
            d,
            source,
            u: DVec3::X,
            v: DVec3::new(0.0, d.z, -d.y),
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
        };
        // A coarse grid covers the whole front, and finer ones the box that was found, until no ray
        // that gets through is at its border: a coarse grid misses the tips of a narrow figure.
        let reach = DVec2::splat(1.6 * lens.prescription().widest_semi_diameter());
        let (mut from, mut to) = (-reach, reach);
        for round in 0..16 {
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            let step = (to - from) / 48.0;
            let grid = (0..49 * 49).map(|k| DVec2::new(f64::from(k % 49), f64::from(k / 49)));
            let places: Vec<DVec2> = grid.map(|at| from + step * at).collect();
            for (p, passes) in places.iter().zip(this.passing(lens, &places)) {
                if passes {
                    (low, high) = (low.min(*p), high.max(*p));
                }
            }
            if low.x > high.x {
                // The beam fits between the points of the grid: search nearer to the chief ray.
                (from, to) = (0.15 * from, 0.15 * to);
                continue;
            }
            let touches = low.cmplt(from + 0.5 * step).any() || high.cmpgt(to - 0.5 * step).any();
            (from, to) = (low - step, high + step);
            (this.low, this.high) = (from, to);
            if round >= 3 && !touches {
                break;
            }
        }
        (this.low.x < this.high.x).then_some(this)
    }

    /// The ray of the beam through a place across it.
    fn ray(&self, place: DVec2) -> LensRay {
        let through = self.start + place.x * self.u + place.y * self.v;
        if let Some(origin) = self.source {
            return LensRay::new(origin, through - origin);
        }
        let surfaces = &self.lens.prescription().surfaces;
        let back = 4.0 * surfaces[0].semi_diameter.min(1e6) + self.lens.length().abs();
        LensRay::new(through - back * self.d, self.d)
    }

    /// The middles of the cells of a grid across the beam, row by row.
    pub(crate) fn grid(&self, cells: usize) -> Vec<DVec2> {
        let step = (self.high - self.low) / cells as f64;
        let middle = |k: usize| DVec2::new((k % cells) as f64, (k / cells) as f64) + 0.5;
        let all = (0..cells * cells).map(|k| self.low + step * middle(k));
        all.collect()
    }

    /// Whether the rays through places get through a lens, which may be this one at any wavelength.
    pub fn passing(&self, lens: &Lens, places: &[DVec2]) -> Vec<bool> {
        let all = lens.trace_all(&self.rays(places), Toward::Film);
        all.iter().map(std::result::Result::is_ok).collect()
    }

    /// The rays through places as they leave the lens; none for each that is lost, or nearly
    /// parallel to the film.
    pub fn trace(&self, lens: &Lens, places: &[DVec2]) -> Vec<Option<LensRay>> {
        let all = lens.trace_all(&self.rays(places), Toward::Film).into_iter();
        all.map(|out| out.ok().filter(|out| out.direction.z > 1e-3))
            .collect()
    }

    /// The rays through places as they leave the lens, and the optical path of each in millimeters
    /// to the foot of the perpendicular from the point `image` on the film. Apertures do not block
    /// the rays. `indices` are those of the media.
    pub(crate) fn arrivals(
        &self,
        lens: &Lens,
        places: &[DVec2],
        indices: &[f64],
        image: DVec3,
    ) -> Vec<Option<(LensRay, f64)>> {
        let n = indices[indices.len() - 1];
        let rays = self.rays(places);
        let distance = self.source.map_or(f64::INFINITY, |source| -source.z);
        let ideal = ObjectsOfIdealLenses::new(lens, distance);
        let all = lens.optical_paths(&rays, indices).into_iter().zip(&rays);
        all.map(|(found, ray)| {
            let (out, path) = found.filter(|(out, _)| out.direction.z > 1e-3)?;
            let path = path + ideal.path(lens, ray);
            Some((out, path + n * (image - out.origin).dot(out.direction)))
        })
        .collect()
    }

    /// The rays of the beam through places.
    fn rays(&self, places: &[DVec2]) -> Vec<LensRay> {
        places.iter().map(|place| self.ray(*place)).collect()
    }

    /// The lower and the upper corner of a box around the places whose rays get through.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        (self.low, self.high)
    }

    /// The outline of the places whose rays get through, as 96 points; empty if none was found.
    /// What closes the middle of a surface is left out.
    pub(crate) fn outline(&self) -> Vec<DVec2> {
        let Some(inside) = self.inside() else {
            return Vec::new();
        };
        let far = (self.high - self.low).length();
        let direction = |i: u32| {
            let (sin, cos) = libm::sincos(TAU * f64::from(i) / 96.0);
            DVec2::new(cos, sin)
        };
        let directions: Vec<DVec2> = (0..96).map(direction).collect();
        let mut spans = vec![(0.0, far); directions.len()];
        let lens = &self.lens.unobstructed();
        let at = |(direction, distance): (&DVec2, f64)| inside + distance * *direction;
        for _ in 0..18 {
            let middles = spans.iter().map(|(near, out)| 0.5 * (near + out));
            let places: Vec<DVec2> = directions.iter().zip(middles).map(at).collect();
            for (span, passes) in spans.iter_mut().zip(self.passing(lens, &places)) {
                let half = 0.5 * (span.0 + span.1);
                *(if passes { &mut span.0 } else { &mut span.1 }) = half;
            }
        }
        let nearest = spans.iter().map(|(near, _)| *near);
        directions.iter().zip(nearest).map(at).collect()
    }

    /// The points at which the rays of the outline hit each surface, in the order of the surfaces
    /// and in millimeters from the axis.
    pub(crate) fn footprints(&self) -> Vec<Vec<DVec2>> {
        let mut all = vec![Vec::new(); self.lens.prescription().surfaces.len()];
        for place in self.outline() {
            let hits = self.lens.hits_on_surfaces(&self.ray(place));
            for (print, hit) in all.iter_mut().zip(hits) {
                print.push(hit);
            }
        }
        all
    }

    /// A place whose ray gets through, but for what closes the middle of a surface: the middle, or
    /// the mean of those on a grid.
    pub(super) fn inside(&self) -> Option<DVec2> {
        let middle = 0.5 * (self.low + self.high);
        let lens = &self.lens.unobstructed();
        let passes = |place: DVec2| self.passing(lens, &[place])[0];
        if passes(middle) {
            return Some(middle);
        }
        let size = self.high - self.low;
        let grid = (0..13 * 13).map(|k| DVec2::new(f64::from(k % 13), f64::from(k / 13)));
        let grid: Vec<DVec2> = grid.map(|at| self.low + size * at / 12.0).collect();
        let passing = self.passing(lens, &grid);
        let found: Vec<DVec2> = grid
            .into_iter()
            .zip(passing)
            .filter_map(|(p, passes)| passes.then_some(p))
            .collect();
        let center = found.iter().sum::<DVec2>() / found.len() as f64;
        (!found.is_empty() && passes(center)).then_some(center)
    }

    /// The radius of a circle of the same area as the beam, in millimeters.
    pub(crate) fn outline_radius(&self) -> f64 {
        (polygon_area(&self.outline()) / (0.5 * TAU)).sqrt()
    }
}

/// The area of a polygon.
pub(crate) fn polygon_area(corners: &[DVec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let twice: f64 = corners.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    0.5 * twice.abs()
}
