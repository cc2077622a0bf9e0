//! Finds the rays from film points that meet points of the scene.

use glam::{DMat2, DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, bits};
use ivcam_optics::lens::{Bundle, Lens, LensRay};

use crate::camera::lens_camera::LensCamera;

/// The steps of Newton's iteration. The map from aims to points is nearly affine, and each step
/// squares the error.
const STEPS: usize = 3;
/// The distance between the aims of which a derivative is the difference, as a share of the
/// pupil's radius.
const DIFFERENCE: f64 = 1e-4;
/// The last step of a search that has converged, at most, as a share of the pupil's radius. What is
/// left after it is about the square.
const CONVERGED: f64 = 1e-3;

/// A ray to be found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// The film point, in millimeters from the film's middle.
    pub film: DVec2,
    /// The aim at which the search begins, in millimeters.
    pub start: DVec2,
    /// The radius of the pupil, in millimeters.
    pub radius: f64,
    /// The point that the ray meets, in lens space.
    pub target: DVec3,
}

/// A ray that was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// The point of the rear vertex plane at which the ray is aimed.
    pub aim: DVec2,
    /// The area across the ray at its target over the area of aims that cover it.
    pub stretch: f64,
    /// The ray in front of the lens, in lens space.
    pub ray: LensRay,
}

impl LensCamera {
    /// Finds rays through a lens as if no aperture blocked them. `wanted` has at most [`LANES`].
    pub(super) fn meet(&self, lens: &Lens, wanted: &[Wanted]) -> [Option<Meeting>; LANES] {
        let mut found = [None; LANES];
        let mut aims = [DVec2::ZERO; LANES];
        for (aim, wanted) in aims.iter_mut().zip(wanted) {
            *aim = wanted.start;
        }
        let mut live = u32::MAX >> (LANES - wanted.len());
        for step in 1..=STEPS {
            let bundles = self.trace_around(lens, wanted, &aims, live);
            for lane in bits(live) {
                let wanted = &wanted[lane];
                let Some((change, stretch)) = linear_step(&bundles, lane, wanted) else {
                    live &= !(1 << lane);
                    continue;
                };
                let is_last = step == STEPS;
                if is_last && change.length() > CONVERGED * wanted.radius {
                    live &= !(1 << lane);
                    continue;
                }
                aims[lane] -= change.clamp_length_max(wanted.radius);
                found[lane] = is_last.then(|| Meeting {
                    aim: aims[lane],
                    stretch,
                    ray: bundles[0].ray(lane),
                });
            }
            if live == 0 {
                break;
            }
        }
        found
    }

    /// Traces the rays to some aims, and to those beside them in x and in y.
    fn trace_around(
        &self,
        lens: &Lens,
        wanted: &[Wanted],
        aims: &[DVec2; LANES],
        live: u32,
    ) -> [Bundle; 3] {
        [DVec2::ZERO, DVec2::X, DVec2::Y].map(|aside| {
            let mut bundle = Bundle::default();
            for lane in bits(live) {
                let Wanted { film, radius, .. } = wanted[lane];
                let aim = aims[lane] + DIFFERENCE * radius * aside;
                bundle.set(lane, &self.ray_to(film, aim));
            }
            lens.trace_bundle_unblocked(&mut bundle);
            bundle
        })
    }

    /// The ray from a film point to an aim.
    pub(super) fn ray_to(&self, film: DVec2, aim: DVec2) -> LensRay {
        let origin = self.place.point(film);
        LensRay::new(origin, (aim.extend(self.rear_z) - origin).normalize())
    }
}

/// The step of Newton's iteration for a lane, and the area across the ray over that of aims.
fn linear_step(bundles: &[Bundle; 3], lane: usize, wanted: &Wanted) -> Option<(DVec2, f64)> {
    let plane = FacingPlane::through(wanted.target)?;
    let crossing = |bundle: &Bundle| match bundle.passed(lane) {
        true => plane.crossing(&bundle.ray(lane)),
        false => None,
    };
    let [at, x, y] = [0, 1, 2].map(|k| crossing(&bundles[k]));
    let (at, x, y) = (at?, x?, y?);
    let derivative = DMat2::from_cols(x - at, y - at) * (1.0 / (DIFFERENCE * wanted.radius));
    let determinant = derivative.determinant();
    let change = derivative.inverse() * at;
    let across = bundles[0].ray(lane).direction.dot(plane.normal);
    (change.is_finite() && determinant != 0.0).then(|| (change, (determinant * across).abs()))
}

/// A plane through a point, in lens space, that faces the front vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacingPlane {
    point: DVec3,
    pub normal: DVec3,
    /// The directions of its coordinates.
    pub axes: [DVec3; 2],
}

impl FacingPlane {
    /// The plane through a point; `None` for the front vertex itself.
    pub(super) fn through(point: DVec3) -> Option<Self> {
        let normal = point.try_normalize()?;
        let (x, y) = normal.any_orthonormal_pair();
        Some(Self {
            point,
            normal,
            axes: [x, y],
        })
    }

    /// Where a ray crosses the plane, from its point; `None` if it travels along the plane or away.
    pub(super) fn crossing(&self, ray: &LensRay) -> Option<DVec2> {
        let speed = ray.direction.dot(self.normal);
        let from = ray.origin - self.point;
        let at = from - ray.direction * (from.dot(self.normal) / speed);
        let [x, y] = self.axes;
        (speed > 0.0).then(|| DVec2::new(at.dot(x), at.dot(y)))
    }
}
