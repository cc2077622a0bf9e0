//! Ghosts: light that reaches the film after two reflections inside the lens.
//!
//! A ghost belongs to a pair of surfaces: light that travels to the film is reflected by the rear
//! one of the pair, then by the front one, and continues to the film. N reflecting surfaces have
//! N(N−1)/2 ghosts. Light after four or more reflections is neglected: each reflection costs a
//! factor of the surface's reflectance, which is 4% at most for common glass, and there must be an
//! even number.

use glam::DVec3;

use crate::lens::lens::Lens;
use crate::lens::trace::element::Element;
use crate::lens::trace::intersect::SurfaceHit;
use crate::lens::trace::ray::{LensRay, Toward, unit};
use crate::prescription::glass::coating::Coating;

/// Two surfaces that reflect, numbered from 0 at the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostPair {
    /// The surface of the second reflection.
    pub front: usize,
    /// The surface of the first reflection.
    pub rear: usize,
}

/// Three wavelengths in nanometers that represent the red, green and blue of a film.
pub const RGB_LINES: [f64; 3] = [611.0, 549.0, 465.0];

impl Lens {
    /// All pairs of surfaces that reflect, from front to rear.
    pub fn ghost_pairs(&self) -> Vec<GhostPair> {
        let reflects = |e: &Element| e.coating != Coating::Ideal && e.indices[0] != e.indices[1];
        let reflecting: Vec<usize> = (0..self.elements().len())
            .filter(|i| reflects(&self.elements()[*i]))
            .collect();
        let with = |(i, &front): (usize, &usize)| {
            let behind = reflecting[i + 1..].to_vec();
            behind
                .into_iter()
                .map(move |rear| GhostPair { front, rear })
        };
        reflecting.iter().enumerate().flat_map(with).collect()
    }

    /// Traces a ray to the film, or backward from it, with reflections at a pair of surfaces.
    ///
    /// Returns the ray behind the lens and the share of its light that remains at three wavelengths
    /// in nanometers. The path is that of the lens's wavelength. Returns none if the ray is lost.
    pub fn trace_ghost(
        &self,
        ray: &LensRay,
        pair: GhostPair,
        toward: Toward,
        wavelengths: [f64; 3],
    ) -> Option<(LensRay, DVec3)> {
        let count = self.elements().len();
        let away = match toward {
            Toward::Film => Toward::Scene,
            Toward::Scene => Toward::Film,
        };
        // The reflecting surfaces and the last one, in the order of travel.
        let (first, second, last) = match toward {
            Toward::Film => (pair.rear, pair.front, count - 1),
            Toward::Scene => (pair.front, pair.rear, 0),
        };
        let mut ray = GhostRay::start(self, ray, toward, wavelengths)?;
        ray.advance_to(first, toward)?;
        ray.reflect(first, toward)?;
        ray.advance_to(second, away)?;
        ray.reflect(second, away)?;
        ray.advance_to(last, toward)?;
        ray.cross(last, toward)?;
        Some(ray.end(toward))
    }
}

/// A ray inside the lens that may travel in both directions.
struct GhostRay<'a> {
    elements: &'a [Element],
    wavelengths: [f64; 3],
    /// A point of the ray, relative to the vertex of the surface `at`.
    p: DVec3,
    /// The unit direction.
    d: DVec3,
    /// The number of the surface that the ray reaches next, or that it is on.
    at: usize,
    /// Whether the ray is on the surface `at`.
    is_on_surface: bool,
    /// The share of the light that remains at the three wavelengths.
    share: DVec3,
}

impl<'a> GhostRay<'a> {
    /// The ray in front of the first surface that it reaches.
    fn start(lens: &'a Lens, ray: &LensRay, toward: Toward, wavelengths: [f64; 3]) -> Option<Self> {
        let elements = lens.elements();
        let at = match toward {
            Toward::Film => 0,
            Toward::Scene => elements.len().checked_sub(1)?,
        };
        let element = elements.get(at)?;
        let mut p = ray.origin - element.vertex_z * DVec3::Z;
        let mut d = unit(ray.direction).filter(|_| ray.origin.is_finite())?;
        element.enter(toward, &mut p, &mut d);
        Some(Self {
            elements,
            wavelengths,
            p,
            d,
            at,
            is_on_surface: false,
            share: DVec3::ONE,
        })
    }

    /// Crosses all surfaces in front of the surface `to`.
    fn advance_to(&mut self, to: usize, toward: Toward) -> Option<()> {
        if self.is_on_surface {
            self.step(toward);
        }
        while self.at != to {
            self.cross(self.at, toward)?;
            self.step(toward);
        }
        Some(())
    }

    /// Makes the next surface in the direction of travel the surface `at`.
    fn step(&mut self, toward: Toward) {
        self.elements[self.at].leave(toward, &mut self.p, &mut self.d);
        match toward {
            Toward::Film => {
                self.p.z -= self.elements[self.at].gap;
                self.at += 1;
            }
            Toward::Scene => {
                self.at -= 1;
                self.p.z += self.elements[self.at].gap;
            }
        }
        self.elements[self.at].enter(toward, &mut self.p, &mut self.d);
        self.is_on_surface = false;
    }

    /// Refracts the ray at a surface.
    fn cross(&mut self, surface: usize, toward: Toward) -> Option<()> {
        let (element, hit) = self.intersect(surface, toward)?;
        let [r, g, b] = self.wavelengths;
        let share = |nm| 1.0 - element.reflectance(toward, hit.cos, nm);
        self.share *= DVec3::new(share(r), share(g), share(b));
        self.d = element.bend(self.d, &hit, toward)?;
        self.p = element.leaving(toward, self.p);
        self.d = element.leaving(toward, self.d);
        Some(())
    }

    /// Reflects the ray at a surface.
    fn reflect(&mut self, surface: usize, toward: Toward) -> Option<()> {
        let (element, hit) = self.intersect(surface, toward)?;
        let [r, g, b] = self.wavelengths;
        let share = |nm| element.reflectance(toward, hit.cos, nm);
        self.share *= DVec3::new(share(r), share(g), share(b));
        self.d -= 2.0 * self.d.dot(hit.normal) * hit.normal;
        Some(())
    }

    /// Moves the ray to where it hits a surface; none if it misses or is blocked.
    fn intersect(&mut self, surface: usize, toward: Toward) -> Option<(&'a Element, SurfaceHit)> {
        let element = &self.elements[surface];
        self.p = element.arriving(toward, self.p);
        self.d = element.arriving(toward, self.d);
        let hit = element.intersect(self.p, self.d, element.sign(toward))?;
        self.p = hit.point;
        self.is_on_surface = true;
        element.is_open_at(self.p).then_some((element, hit))
    }

    /// The ray as it leaves the lens and the share of the light that remains.
    fn end(mut self, toward: Toward) -> (LensRay, DVec3) {
        self.elements[self.at].leave(toward, &mut self.p, &mut self.d);
        let origin = self.p + self.elements[self.at].vertex_z * DVec3::Z;
        let direction = self.d;
        (LensRay { origin, direction }, self.share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::{Prescription, Surface};
    use crate::prescription::glass::Medium;
    use crate::sampling::disc::concentric_disc;
    use crate::sampling::{mix, unit};

    const NM: [f64; 3] = [550.0; 3];

    fn plate() -> Lens {
        let surfaces = vec![
            Surface::sphere(0.0, 4.0, Medium::constant(1.5), 50.0),
            Surface::sphere(0.0, 1.0, Medium::air(), 50.0),
        ];
        Lens::new(Prescription::new("plate", surfaces).with_coating(Coating::Bare))
    }

    /// The ghost crosses a plate of thickness t twice more. It leaves in the direction of the ray,
    /// offset by 2 t tan θ′, with R² T² of the light.
    #[test]
    fn the_ghost_of_a_plate_is_parallel_to_the_ray_and_offset_sideways() {
        let lens = plate();
        let pairs = lens.ghost_pairs();
        assert_eq!(pairs, [GhostPair { front: 0, rear: 1 }]);
        for degrees in [0.0f64, 20.0, 45.0, 60.0] {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let ray = LensRay::new(DVec3::new(0.0, 1.0, -3.0), DVec3::new(0.0, sin, cos));
            let plain = lens.trace_from_scene(&ray).unwrap();
            let (ghost, left) = lens.trace_ghost(&ray, pairs[0], Toward::Film, NM).unwrap();
            assert!((ghost.direction - plain.direction).length() < 1e-15);
            let inside = sin / 1.5;
            let off = 8.0 * inside / (1.0 - inside * inside).sqrt();
            let apart = ghost.origin - plain.origin;
            assert!(
                (apart - DVec3::new(0.0, off, 0.0)).length() < 1e-13,
                "{apart}"
            );
            let r = Coating::Bare.reflectance(1.0, 1.5, cos, 550.0);
            let known = (r * (1.0 - r)) * (r * (1.0 - r));
            assert!((left.x / known - 1.0).abs() < 1e-12, "{left} {known}");
        }
    }

    #[test]
    fn n_reflecting_surfaces_have_n_times_n_minus_one_halves_of_ghosts() {
        let lens = Lens::named("double-gauss").unwrap();
        assert!(
            lens.ghost_pairs().is_empty(),
            "ideal surfaces reflect nothing"
        );
        let mirrors = lens
            .prescription()
            .indices(lens.wavelength())
            .windows(2)
            .filter(|n| n[0] != n[1])
            .count();
        let pairs = lens.with_coating(Coating::Bare).ghost_pairs();
        assert_eq!(pairs.len(), mirrors * (mirrors - 1) / 2);
    }

    /// The paraxial height and reduced angle of a ghost behind the lens, for a ray parallel to the
    /// axis at height 1. At a reflection n changes its sign, and so do the gaps.
    fn paraxial(lens: &Lens, pair: GhostPair) -> (f64, f64) {
        let surfaces = &lens.prescription().surfaces;
        let n = lens.prescription().indices(lens.wavelength());
        let c = |i: usize| surfaces[i].curvature.per_mm();
        let (mut y, mut nu) = (1.0, 0.0);
        // The power of a refraction is (n' − n) c. That of a reflection is (−n − n) c, n being
        // signed.
        let last = surfaces.len() - 1;
        let forward = |from: usize, to: usize, y: &mut f64, nu: &mut f64| {
            for i in from..to {
                *nu -= *y * (n[i + 1] - n[i]) * c(i);
                *y += surfaces[i].thickness * *nu / n[i + 1];
            }
        };
        forward(0, pair.rear, &mut y, &mut nu);
        nu -= y * (-2.0 * n[pair.rear]) * c(pair.rear);
        for i in (pair.front + 1..=pair.rear).rev() {
            // The gap in front of surface i, with index −n and length −t.
            y += surfaces[i - 1].thickness * nu / n[i];
            if i - 1 > pair.front {
                nu -= y * (n[i] - n[i - 1]) * c(i - 1);
            }
        }
        nu -= y * (2.0 * n[pair.front + 1]) * c(pair.front);
        y += surfaces[pair.front].thickness * nu / n[pair.front + 1];
        forward(pair.front + 1, last, &mut y, &mut nu);
        nu -= y * (n[last + 1] - n[last]) * c(last);
        (y, nu)
    }

    #[test]
    fn rays_near_the_axis_follow_the_paraxial_ghost() {
        for name in ["double-gauss", "cooke-triplet", "wide-angle"] {
            let lens = Lens::named(name).unwrap().with_coating(Coating::Bare);
            for pair in lens.ghost_pairs() {
                let h = 1e-6;
                let ray = LensRay::new(DVec3::new(0.0, h, -1.0), DVec3::Z);
                let (out, _) = lens.trace_ghost(&ray, pair, Toward::Film, NM).unwrap();
                let (y, u) = paraxial(&lens, pair);
                let (real_y, real_u) = (out.origin.y / h, out.direction.y / out.direction.z / h);
                let near = |a: f64, b: f64| (a - b).abs() < 1e-7 * (1.0 + b.abs());
                assert!(
                    near(real_y, y) && near(real_u, u),
                    "{name} {pair:?}: {real_y} {y} {real_u} {u}"
                );
            }
        }
    }

    #[test]
    fn a_ghost_traced_back_from_the_film_is_the_same_ray() {
        let lens = Lens::named("double-gauss")
            .unwrap()
            .with_coating(Coating::Bare);
        for pair in lens.ghost_pairs() {
            let ray = LensRay::new(
                DVec3::new(1.0, 2.0, -1.0),
                DVec3::new(0.02, -0.01, 1.0).normalize(),
            );
            let Some((out, left)) = lens.trace_ghost(&ray, pair, Toward::Film, NM) else {
                continue;
            };
            let back = LensRay::new(out.origin, -out.direction);
            let (again, same) = lens.trace_ghost(&back, pair, Toward::Scene, NM).unwrap();
            assert!(
                (again.direction + ray.direction).length() < 1e-10,
                "{pair:?}"
            );
            assert!((left / same - 1.0).abs().max_element() < 1e-9);
        }
    }

    /// The flux of a ghost on a film of 36×24 mm, from a lamp with a radius of 2 degrees and a
    /// radiance of 1, is computed by rays from the lamp over the front, and by rays from the film
    /// over the rear element.
    #[test]
    fn the_light_of_a_ghost_is_the_same_traced_from_the_lamp_and_from_the_film() {
        let lens = Lens::named("double-gauss")
            .unwrap()
            .with_coating(Coating::Bare);
        let film_z = lens.first_order().focal.unwrap().rear_focal_point;
        let lamp = DVec3::new(0.10, 0.15, 1.0).normalize();
        let least = libm::cos(2f64.to_radians());
        let solid_angle = std::f64::consts::TAU * (1.0 - least);
        let surfaces = &lens.prescription().surfaces;
        let (a, b) = (
            surfaces[0].semi_diameter,
            surfaces[surfaces.len() - 1].semi_diameter,
        );
        let random = |i: u64, k: u64| unit(mix(mix(i) ^ (k << 40)));
        let count = 100_000u64;
        for pair in [
            GhostPair { front: 0, rear: 1 },
            GhostPair { front: 3, rear: 8 },
        ] {
            let Some(pair) = lens.ghost_pairs().into_iter().find(|p| *p == pair) else {
                panic!("{pair:?} is no pair")
            };
            let forward = |i: u64| {
                let [x, y] = concentric_disc(random(i, 0), random(i, 1));
                let direction = within(lamp, least, random(i, 2), random(i, 3));
                // The disc at the front vertex is wide enough for the rim of a convex surface.
                let reach = 1.3 * a;
                let origin = DVec3::new(reach * x, reach * y, 0.0);
                let ray = LensRay { origin, direction };
                let area = std::f64::consts::PI * reach * reach;
                let found = lens.trace_ghost(&ray, pair, Toward::Film, NM);
                found.map_or(0.0, |(out, left)| {
                    let t = (film_z - out.origin.z) / out.direction.z;
                    let at = out.origin + t * out.direction;
                    let lands = out.direction.z > 0.0 && at.x.abs() < 18.0 && at.y.abs() < 12.0;
                    f64::from(u8::from(lands)) * left.x * direction.z * area * solid_angle
                })
            };
            let backward = |i: u64| {
                let film = DVec3::new(
                    36.0 * (random(i, 4) - 0.5),
                    24.0 * (random(i, 5) - 0.5),
                    film_z,
                );
                let [x, y] = concentric_disc(random(i, 6), random(i, 7));
                let rear = DVec3::new(b * x, b * y, lens.length());
                let across = rear - film;
                let ray = LensRay::new(film, across);
                let found = lens.trace_ghost(&ray, pair, Toward::Scene, NM);
                found.map_or(0.0, |(out, left)| {
                    let square = across.length_squared();
                    let measure = across.z * across.z / (square * square);
                    let seen = -out.direction.dot(lamp) > least;
                    let area = 36.0 * 24.0 * std::f64::consts::PI * b * b;
                    f64::from(u8::from(seen)) * left.x * measure * area
                })
            };
            let (one, e1) = mean(count, forward);
            let (two, e2) = mean(count, backward);
            let z = (one - two) / e1.hypot(e2);
            assert!(
                z.abs() < 4.0 && one > 10.0 * e1,
                "{pair:?}: {one}±{e1} {two}±{e2}"
            );
        }
    }

    fn mean(count: u64, value: impl Fn(u64) -> f64) -> (f64, f64) {
        let n = count as f64;
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..count {
            let v = value(i);
            sum += v;
            squares += v * v;
        }
        let mean = sum / n;
        (mean, ((squares / n - mean * mean) / n).sqrt())
    }

    /// A direction uniformly distributed in a cone.
    fn within(axis: DVec3, least: f64, u: f64, v: f64) -> DVec3 {
        let cos = 1.0 - u * (1.0 - least);
        let sin = (1.0 - cos * cos).sqrt();
        let (a, b) = axis.any_orthonormal_pair();
        let (s, c) = libm::sincos(std::f64::consts::TAU * v);
        cos * axis + sin * (c * a + s * b)
    }
}
