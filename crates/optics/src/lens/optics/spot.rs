//! Spots by real rays: the widest beam along the axis, the spot of a point, and the film position
//! of the smallest spot.

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Loss};

/// The spot that the rays of one scene point make on the film. Lengths are in millimeters.
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// The points at which the rays hit the film.
    pub points: Vec<DVec2>,
    /// The mean of the points.
    pub centroid: DVec2,
    /// The root mean square distance from the centroid.
    pub rms: f64,
    /// The largest distance from the centroid.
    pub largest: f64,
    /// The cross-section of the beam that gets through, in square millimeters.
    pub beam_area: f64,
    /// The shift of the film, away from the lens, for which `rms` is smallest.
    pub best_shift: f64,
    /// The smallest `rms`.
    pub best_rms: f64,
}

/// The widest beam along the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxialBeam {
    /// Half of the beam's diameter in front of the lens, in millimeters.
    pub height: f64,
    /// The loss of the next higher ray; none if none is lost.
    pub limit: Option<Loss>,
}

impl Lens {
    /// The widest beam parallel to the axis that gets through. It is found by single rays with y >
    /// 0.
    pub fn axial_beam(&self) -> AxialBeam {
        let (height, limit) = self.axial_reach(DVec2::Y);
        AxialBeam { height, limit }
    }

    /// The height of the highest ray parallel to the axis that gets through, in millimeters, in a
    /// direction across the axis, and the loss of the next higher ray.
    pub(in crate::lens) fn axial_reach(&self, across: DVec2) -> (f64, Option<Loss>) {
        let far = self.far();
        self.widest_ray(1.5, |height| {
            LensRay::new((height * across).extend(-far), DVec3::Z)
        })
    }

    /// The height of the highest ray from the point of the axis at a distance in front of the first
    /// vertex, in the plane through that vertex. Lengths are in millimeters, and the distance may
    /// be infinite.
    pub(crate) fn beam_height(&self, distance: f64) -> f64 {
        self.widest_ray(1.5, |height| self.axial_ray(distance, height))
            .0
    }

    /// The ray from the point of the axis at a distance through a height in the plane of the front
    /// vertex.
    pub(crate) fn axial_ray(&self, distance: f64, height: f64) -> LensRay {
        match distance.is_finite() {
            true => LensRay::new(-distance * DVec3::Z, DVec3::new(0.0, height, distance)),
            false => LensRay::new(DVec3::new(0.0, height, -self.far()), DVec3::Z),
        }
    }

    /// The greatest height in millimeters whose ray gets through, and the loss of the next higher
    /// one, without what closes the middle of a surface. Heights are tried in 512 steps up to
    /// `reach` times the largest semi-diameter.
    fn widest_ray(&self, reach: f64, ray: impl Fn(f64) -> LensRay) -> (f64, Option<Loss>) {
        let lens = self.unobstructed();
        let trace = |height: f64| lens.trace_from_scene(&ray(height));
        let widest = reach * self.prescription().widest_semi_diameter();
        let step = widest / 512.0;
        let lost = (1..=512).find_map(|i| trace(i as f64 * step).err().map(|loss| (i, loss)));
        let (mut low, mut high, mut limit) = match lost {
            Some((i, loss)) => ((i - 1) as f64 * step, i as f64 * step, Some(loss)),
            None => (widest, widest, None),
        };
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match trace(middle) {
                Ok(_) => low = middle,
                Err(loss) => (high, limit) = (middle, Some(loss)),
            }
        }
        (low, limit)
    }

    /// The spot of the point at infinity whose chief ray arrives at a film point; none if there is
    /// no chief ray. `grid` by `grid` evenly spaced rays cover the beam.
    pub fn spot(&self, film: DVec2, film_z: f64, grid: usize) -> Option<Spot> {
        let chief = self.chief_ray(film, film_z)?;
        let direction = -chief.direction;
        let across = direction.any_orthonormal_vector();
        let along = direction.cross(across);
        let widest = self.prescription().widest_semi_diameter();
        let back = 4.0 * (widest + self.length().abs());
        let start = chief.origin - back * direction;
        let ray = |a: f64, b: f64| LensRay::new(start + a * across + b * along, direction);
        // A coarse grid finds the bounding box of the rays that get through; the grid covers that
        // box.
        let mut reach = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let coarse = 160;
        let cell = 4.0 * widest / coarse as f64;
        for j in 0..=coarse {
            for i in 0..=coarse {
                let (a, b) = (
                    i as f64 * cell - 2.0 * widest,
                    j as f64 * cell - 2.0 * widest,
                );
                if self.trace_from_scene(&ray(a, b)).is_ok() {
                    reach = (reach.0.min(DVec2::new(a, b)), reach.1.max(DVec2::new(a, b)));
                }
            }
        }
        if reach.0.x > reach.1.x {
            reach = (DVec2::ZERO, DVec2::ZERO);
        }
        let (from, to) = (reach.0 - cell, reach.1 + cell);
        let step = (to - from) / grid as f64;
        let mut hits = Vec::new();
        for j in 0..grid {
            for i in 0..grid {
                let place = from + step * (DVec2::new(i as f64, j as f64) + 0.5);
                if let Ok(out) = self.trace_from_scene(&ray(place.x, place.y)) {
                    hits.push(out);
                }
            }
        }
        Some(Spot::of(&hits, film_z, step.x * step.y * hits.len() as f64))
    }

    /// The z of the film, in millimeters, for which the root mean square spot of an object on the
    /// axis is smallest, by real rays. `distance` is from the front vertex, in millimeters, and may
    /// be infinite. Returns none if too few rays get through.
    pub fn best_focus(&self, distance: f64) -> Option<f64> {
        self.best_focus_of(distance, self.beam_height(distance), 256)
    }

    /// The film of [`Self::best_focus`] by rays on some rings of a beam of this height in the plane
    /// of the front vertex.
    pub(crate) fn best_focus_of(&self, distance: f64, beam: f64, rings: usize) -> Option<f64> {
        let ray = |height: f64| self.axial_ray(distance, height);
        let mut hits = Vec::new();
        for i in 0..rings {
            // The rays are at the middles of rings of equal area.
            let ray = ray(beam * ((i as f64 + 0.5) / rings as f64).sqrt());
            // Rays on both sides of the axis: their centroid is on it.
            for turned in [
                ray,
                mirrored(&ray),
                opposite(&ray),
                opposite(&mirrored(&ray)),
            ] {
                hits.extend(self.trace_from_scene(&turned));
            }
        }
        if hits.len() < 8 {
            return None;
        }
        let rear = self.length();
        let spot = Spot::of(&hits, rear, 0.0);
        let z = rear + spot.best_shift;
        z.is_finite().then_some(z)
    }
}

/// A ray turned by half a turn about the axis.
fn opposite(ray: &LensRay) -> LensRay {
    let turn = |v: DVec3| DVec3::new(-v.x, -v.y, v.z);
    LensRay::new(turn(ray.origin), turn(ray.direction))
}

/// A ray with x and y exchanged, for lenses that differ in x and y.
fn mirrored(ray: &LensRay) -> LensRay {
    let turn = |v: DVec3| DVec3::new(v.y, v.x, v.z);
    LensRay::new(turn(ray.origin), turn(ray.direction))
}

impl Spot {
    /// The spot that rays leaving the lens make on a film.
    pub fn of(rays: &[LensRay], film_z: f64, beam_area: f64) -> Self {
        let slopes: Vec<DVec2> = rays
            .iter()
            .map(|r| r.direction.truncate() / r.direction.z)
            .collect();
        let points: Vec<DVec2> = rays
            .iter()
            .zip(&slopes)
            .map(|(r, slope)| r.origin.truncate() + (film_z - r.origin.z) * *slope)
            .collect();
        let n = points.len() as f64;
        let centroid = points.iter().sum::<DVec2>() / n;
        let mean_slope = slopes.iter().sum::<DVec2>() / n;
        let (mut square, mut largest, mut both, mut slope_square) = (0.0, 0.0f64, 0.0, 0.0);
        for (point, slope) in points.iter().zip(&slopes) {
            let (p, s) = (*point - centroid, *slope - mean_slope);
            square += p.length_squared();
            largest = largest.max(p.length());
            both += p.dot(s);
            slope_square += s.length_squared();
        }
        let best_shift = -both / slope_square;
        let least = (square - both * both / slope_square).max(0.0);
        Self {
            points,
            centroid,
            rms: (square / n).sqrt(),
            largest,
            beam_area,
            best_shift,
            best_rms: (least / n).sqrt(),
        }
    }
}
