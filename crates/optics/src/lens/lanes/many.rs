//! Traces any number of rays from the scene to the film side, a bundle at a time.

use glam::DVec3;
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel, Width, dispatch};
use ivcam_base::work;

use crate::lens::lanes::bundle::{Bundle, EMPTY};
use crate::lens::lanes::fills::SURFACE_STEPS;
use crate::lens::lanes::follow::stretch;
use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Loss, LossKind, Toward, unit};
use crate::lens::trace::tracer::Tracer;

impl Lens {
    /// Traces rays in lens space, in millimeters, toward the film or the scene. Returns the rays as
    /// they leave the lens, in order, or the surface where a ray is lost and how. A direction need
    /// not have unit length.
    ///
    /// A ray without a direction or with a coordinate that is not finite misses the first surface
    /// that it would meet. There is no limit of work unless the program sets one for the thread
    /// (`ivcam_base::work::Budget`); all rays after its end miss, too.
    pub fn trace_all(
        &self,
        rays: &[LensRay],
        toward: Toward,
    ) -> Vec<std::result::Result<LensRay, Loss>> {
        let mut bundle = Bundle::default();
        let first = match toward {
            Toward::Film => 0,
            Toward::Scene => self.prescription().surfaces.len().saturating_sub(1),
        };
        let missed = Loss {
            surface: first,
            kind: LossKind::Missed,
        };
        let steps = SURFACE_STEPS * self.prescription().surfaces.len() as u64;
        let mut all = Vec::with_capacity(rays.len());
        for rays in rays.chunks(LANES) {
            if work::spend(steps).is_err() {
                all.resize(all.len() + rays.len(), Err(missed));
                continue;
            }
            bundle.set_all(rays);
            self.trace_bundle(&mut bundle, toward, Width::detect());
            all.extend((0..rays.len()).map(|lane| {
                let lost = || bundle.loss(lane).unwrap_or(missed);
                bundle.outcome(lane).ok_or_else(lost)
            }));
        }
        all
    }

    /// The rays as they leave the lens toward the film, with the optical path of each from its
    /// origin to its last hit, in millimeters. Apertures do not block the rays; the result is none
    /// for a ray that misses a surface or is totally reflected. `indices` are those of the media,
    /// from the one in front of the lens. If the account of this thread is used up, the result is
    /// none for all further rays.
    pub(crate) fn optical_paths(
        &self,
        rays: &[LensRay],
        indices: &[f64],
    ) -> Vec<Option<(LensRay, f64)>> {
        let tracer = &self.tracer(Toward::Film, false);
        let mut bundle = Bundle::default();
        let mut all = Vec::with_capacity(rays.len());
        for rays in rays.chunks(LANES) {
            if work::spend(SURFACE_STEPS * tracer.elements.len() as u64).is_err() {
                all.resize(all.len() + rays.len(), None);
                continue;
            }
            bundle.set_all(rays);
            let bundle = &mut bundle;
            let paths = dispatch(OpticalPaths {
                tracer,
                indices,
                bundle,
            });
            all.extend((0..rays.len()).map(|lane| Some((bundle.outcome(lane)?, paths[lane]))));
        }
        all
    }
}

impl Bundle {
    /// Puts up to [`LANES`] rays into the first lanes and empties the others.
    pub(super) fn set_all(&mut self, rays: &[LensRay]) {
        for lane in 0..LANES {
            let ray = rays.get(lane).filter(|ray| ray.origin.is_finite());
            match ray.and_then(|ray| Some((ray.origin, unit(ray.direction)?))) {
                Some((origin, direction)) => self.set(lane, &LensRay { origin, direction }),
                None => self.lost[lane] = EMPTY,
            }
        }
    }

    /// The ray of a lane; none if it was lost.
    fn outcome(&self, lane: usize) -> Option<LensRay> {
        self.passed(lane).then(|| self.ray(lane))
    }
}

/// The kernel of [`Lens::optical_paths`].
struct OpticalPaths<'a> {
    tracer: &'a Tracer<'a>,
    indices: &'a [f64],
    bundle: &'a mut Bundle,
}

impl SimdKernel for OpticalPaths<'_> {
    type Output = Lane;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Lane {
        let mut paths = [0.0; LANES];
        let mut vertex_z = 0.0;
        let b = self.bundle;
        for (i, n) in (0..self.tracer.elements.len()).zip(self.indices) {
            let (x, y, z) = (b.x, b.y, b.z);
            // Positions are relative to the vertex of the surface before.
            let gap = match i {
                0 => 0.0,
                _ => self.tracer.elements[i - 1].gap,
            };
            // A mirror turns the hit around.
            let facing = match self.tracer.elements[i].is_mirror {
                true => -1.0,
                false => 1.0,
            };
            vertex_z = stretch::<false, FUSED>(self.tracer, b, i..i + 1, None);
            let frame = self.tracer.elements[i].frame.as_deref();
            let back = frame.map(|f| (f.entering(Toward::Film), f.leaving(Toward::Film).inverse()));
            for lane in 0..LANES {
                let mut from = DVec3::new(x[lane], y[lane], z[lane] - gap);
                let mut hit = DVec3::new(b.x[lane], b.y[lane], b.z[lane]);
                if let Some((enter, back)) = &back {
                    (from, hit) = (enter.transform_point3(from), back.transform_point3(hit));
                }
                let (x, y) = (hit.x - from.x, hit.y - from.y);
                let z = facing * hit.z - from.z;
                let length = (x * x + y * y + z * z).sqrt();
                // Inside the lens the length is signed, because a ray may travel backward between
                // surfaces that cross; a tilt of less than 90 degrees keeps the sign of z.
                let signed = if i == 0 { length } else { length.copysign(z) };
                paths[lane] += n * signed;
            }
        }
        for z in &mut b.z {
            *z += vertex_z;
        }
        paths
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Parallel rays of a grid that is half as wide again as the entrance pupil.
    fn rays(lens: &Lens) -> Vec<LensRay> {
        let pupil = lens.first_order().entrance_pupil.unwrap();
        let direction = DVec3::new(0.02, 0.1, 1.5);
        let place = |k: usize| 1.5 * pupil.semi_diameter * (k as f64 / 10.0 - 1.0);
        let grid = (0..21 * 21).map(|k| (place(k % 21), place(k / 21)));
        grid.map(|(x, y)| LensRay::new(DVec3::new(x, y, pupil.z) - 60.0 * direction, direction))
            .collect()
    }

    #[test]
    fn many_rays_leave_a_lens_as_each_alone_does() {
        for name in ["double-gauss", "canon-14", "anamorphic"] {
            let lens = Lens::named(name).unwrap();
            let rays = rays(&lens);
            let together = lens.trace_all(&rays, Toward::Film);
            assert_eq!(together.len(), rays.len());
            let mut passed = 0;
            for (ray, found) in rays.iter().zip(&together) {
                let alone = lens.trace_from_scene(ray);
                assert_eq!(alone.err(), found.err(), "{name} {ray:?}");
                if let (Ok(a), Ok(b)) = (alone, found) {
                    passed += 1;
                    assert!((a.origin - b.origin).length() < 1e-11, "{name} {ray:?}");
                    assert!((a.direction - b.direction).length() < 1e-13, "{name}");
                }
            }
            assert!(passed > 40, "{name}: {passed} rays pass");
        }
    }

    #[test]
    fn optical_paths_are_the_sums_of_their_legs() {
        let lens = Lens::named("canon-14").unwrap();
        let indices = lens.prescription().indices(lens.wavelength());
        let rays = rays(&lens);
        for (ray, found) in rays.iter().zip(lens.optical_paths(&rays, &indices)) {
            let path = lens.trace_path(ray, Toward::Film, false);
            assert_eq!(path.outcome.is_ok(), found.is_some());
            let Some((_, optical)) = found else { continue };
            let mut sum = indices[0] * (path.hits[0] - ray.origin).length();
            for (legs, n) in path.hits.windows(2).zip(&indices[1..]) {
                let leg = legs[1] - legs[0];
                sum += n * leg.length().copysign(leg.z);
            }
            assert!((optical - sum).abs() < 1e-10, "{optical} {sum}");
        }
    }
}
