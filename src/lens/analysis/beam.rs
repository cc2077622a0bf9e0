//! The beam from one object point to one height of the film.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

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
        let surfaces = &lens.prescription().surfaces;
        let reach = surfaces
            .iter()
            .map(|s| s.semi_diameter)
            .filter(|r| r.is_finite());
        let reach = DVec2::splat(1.6 * reach.fold(0.0, f64::max));
        let (mut from, mut to) = (-reach, reach);
        for round in 0..16 {
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            let step = (to - from) / 48.0;
            for j in 0..=48 {
                for i in 0..=48 {
                    let p = from + step * DVec2::new(f64::from(i), f64::from(j));
                    if this.passes(lens, p) {
                        (low, high) = (low.min(p), high.max(p));
                    }
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
            return LensRay {
                origin,
                direction: through - origin,
            };
        }
        let surfaces = &self.lens.prescription().surfaces;
        let back = 4.0 * surfaces[0].semi_diameter.min(1e6) + self.lens.length();
        LensRay {
            origin: through - back * self.d,
            direction: self.d,
        }
    }

    /// Whether the ray through a place gets through a lens, which may be this one at any
    /// wavelength.
    pub fn passes(&self, lens: &Lens, place: DVec2) -> bool {
        lens.trace_from_scene(&self.ray(place)).is_ok()
    }

    /// The ray through a place as it leaves the lens; none if it is lost, or nearly parallel to the
    /// film.
    pub fn trace(&self, lens: &Lens, place: DVec2) -> Option<LensRay> {
        let out = lens.trace_from_scene(&self.ray(place)).ok()?;
        (out.direction.z > 1e-3).then_some(out)
    }

    /// The ray through a place as it leaves the lens, and its optical path in millimeters to the
    /// foot of the perpendicular from the point `image` on the film. Apertures do not block it.
    /// `indices` are those of the media.
    pub(crate) fn arrival(
        &self,
        lens: &Lens,
        place: DVec2,
        indices: &[f64],
        image: DVec3,
    ) -> Option<(LensRay, f64)> {
        let ray = self.ray(place);
        let path = lens.trace_path(&ray, Toward::Film, false);
        let out = path.outcome.ok().filter(|out| out.direction.z > 1e-3)?;
        let first = path.hits.first()?;
        let mut optical = indices[0] * (*first - ray.origin).length();
        for (legs, n) in path.hits.windows(2).zip(&indices[1..]) {
            // The length is signed, because a ray may travel backward between surfaces that cross.
            let leg = legs[1] - legs[0];
            optical += n * leg.length().copysign(leg.z);
        }
        let n = indices[indices.len() - 1];
        let rest = n * (image - out.origin).dot(out.direction);
        Some((out, optical + rest))
    }

    /// The lower and the upper corner of a box around the places whose rays get through.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        (self.low, self.high)
    }

    /// The outline of the places whose rays get through, as 96 points; empty if none was found.
    pub(crate) fn outline(&self) -> Vec<DVec2> {
        let middle = 0.5 * (self.low + self.high);
        let Some(inside) = self.inside(middle) else {
            return Vec::new();
        };
        let far = (self.high - self.low).length();
        (0..96)
            .map(|i| {
                let angle = TAU * f64::from(i) / 96.0;
                let direction = DVec2::new(libm::cos(angle), libm::sin(angle));
                let (mut near, mut out) = (0.0, far);
                for _ in 0..18 {
                    let half = 0.5 * (near + out);
                    if self.passes(self.lens, inside + half * direction) {
                        near = half
                    } else {
                        out = half
                    }
                }
                inside + near * direction
            })
            .collect()
    }

    /// A place whose ray gets through: the middle, or the mean of those on a grid.
    fn inside(&self, middle: DVec2) -> Option<DVec2> {
        if self.passes(self.lens, middle) {
            return Some(middle);
        }
        let size = self.high - self.low;
        let grid = (0..=12).flat_map(|j| (0..=12).map(move |i| (f64::from(i), f64::from(j))));
        let mut found = (DVec2::ZERO, 0.0);
        for (i, j) in grid {
            let p = self.low + size * DVec2::new(i, j) / 12.0;
            if self.passes(self.lens, p) {
                found = (found.0 + p, found.1 + 1.0);
            }
        }
        let center = found.0 / found.1;
        (found.1 > 0.0 && self.passes(self.lens, center)).then_some(center)
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
