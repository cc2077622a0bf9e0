//! Chief rays, and the distortion that they show.
//!
//! Film points are in millimeters from the axis, on a film at a z from the front vertex.

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Toward};
use crate::lens::trace::tracer::Tracer;
use crate::prescription::surface::Meridian;

/// The angle of a chief ray, and the deviation of its image height from two ideal projections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// The angle to the axis in scene space, in radians; more than π/2 in some fish-eyes.
    pub angle: f64,
    /// The image height over f tan θ, less 1. It is NaN from 90 degrees on.
    pub f_tan: f64,
    /// The image height over f θ, less 1.
    pub f_theta: f64,
}

impl Lens {
    /// The ray from a film point through the center of the stop, as it leaves the lens: its origin
    /// is on the front surface. Apertures do not block it. Returns none if there is no such ray.
    pub fn chief_ray(&self, film: DVec2, film_z: f64) -> Option<LensRay> {
        let stop = self.first_order().stop?;
        let exit = self.first_order().exit_pupil;
        // Aimed at the paraxial exit pupil first, or along the axis if that is at infinity.
        let rear_z = self.length();
        let toward = exit.map_or(0.0, |p| (film_z - rear_z) / (film_z - p.z));
        let mut aim = DVec2::ZERO;
        // The film point moves outward from the axis in steps, and each step starts from the last
        // aim: a fish-eye's chief rays are far from paraxial at the edge of its field.
        const STEPS: usize = 8;
        // An aim between is only a start for the next, so it need not be exact.
        const NEAR: f64 = 1e-3;
        for step in 1..=STEPS {
            let share = step as f64 / STEPS as f64;
            let target = share * film;
            let start = if step == 1 {
                target * (1.0 - toward)
            } else {
                aim * (step as f64 / (step - 1) as f64)
            };
            let wanted = if step == STEPS { 0.0 } else { NEAR };
            aim = self.aim_at_stop(target, film_z, stop, start, wanted)?;
        }
        self.tracer(Toward::Scene, false)
            .follow(self.film_ray(film, film_z, aim), |_, _| {})
            .ok()
    }

    /// Finds the aim whose ray passes through the center of the stop, by Newton's iteration with
    /// numerical derivatives. It ends where the ray is within `wanted` of the center, as a share of
    /// the exit pupil's radius, or at the rounding error. Returns none if it does not converge.
    fn aim_at_stop(
        &self,
        film: DVec2,
        film_z: f64,
        stop: usize,
        start: DVec2,
        wanted: f64,
    ) -> Option<DVec2> {
        let miss = |aim: DVec2| self.stop_hit(film, film_z, stop, aim);
        let scale = self
            .first_order()
            .exit_pupil
            .map_or(1.0, |p| p.semi_diameter)
            .max(1e-3);
        let step = 1e-5 * scale;
        let mut aim = start;
        let mut at = miss(aim)?;
        let mut stalled = 0;
        for _ in 0..60 {
            if at.length() <= wanted * scale {
                break;
            }
            let dx = (miss(aim + step * DVec2::X)? - miss(aim - step * DVec2::X)?) / (2.0 * step);
            let dy = (miss(aim + step * DVec2::Y)? - miss(aim - step * DVec2::Y)?) / (2.0 * step);
            let determinant = dx.perp_dot(dy);
            let change = DVec2::new(at.perp_dot(dy), dx.perp_dot(at)) / determinant;
            if !change.is_finite() {
                return None;
            }
            let mut part = 1.0;
            let better = loop {
                let next = aim - part * change;
                match miss(next) {
                    Some(value) if value.length() < at.length() => break Some((next, value)),
                    _ if part < 1e-3 => break None,
                    _ => part *= 0.5,
                }
            };
            let Some((next, value)) = better else { break };
            stalled = if value.length() < 0.5 * at.length() {
                0
            } else {
                stalled + 1
            };
            (aim, at) = (next, value);
            if stalled > 2 {
                break;
            }
        }
        (at.length() < wanted.max(1e-9) * scale).then_some(aim)
    }

    /// The point where the ray from a film point to an aim on the rear vertex plane crosses the
    /// stop.
    fn stop_hit(&self, film: DVec2, film_z: f64, stop: usize, aim: DVec2) -> Option<DVec2> {
        let mut found = None;
        let ray = self.film_ray(film, film_z, aim);
        // The surfaces in front of the stop make no difference. The outcome does not matter either:
        // a ray that is totally reflected at the stop has crossed it.
        let tracer = Tracer {
            elements: &self.elements()[stop..],
            ..self.tracer(Toward::Scene, false)
        };
        let _ = tracer.walk(ray, |surface, _, hit| {
            if surface == 0 {
                found = Some(hit.point.truncate());
            }
        });
        found
    }

    /// The ray from a film point to an aim on the rear vertex plane.
    fn film_ray(&self, film: DVec2, film_z: f64, aim: DVec2) -> LensRay {
        let origin = film.extend(film_z);
        LensRay::new(origin, aim.extend(self.length()) - origin)
    }

    /// The distortion at a film point at a height on the x axis or the y axis, in millimeters; none
    /// if it has no chief ray.
    pub fn distortion(&self, plane: Meridian, height: f64, film_z: f64) -> Option<Distortion> {
        let axis = if plane == Meridian::X {
            DVec2::X
        } else {
            DVec2::Y
        };
        let chief = self.chief_ray(height * axis, film_z)?;
        let angle = angle_of(chief.direction);
        let f = self.first_order_in(plane).focal?.front_efl;
        let half_turn = std::f64::consts::FRAC_PI_2;
        let f_tan = if angle < half_turn {
            f * libm::tan(angle)
        } else {
            f64::NAN
        };
        Some(Distortion {
            angle,
            f_tan: height.abs() / f_tan.abs() - 1.0,
            f_theta: height.abs() / (f * angle).abs() - 1.0,
        })
    }

    /// The height in millimeters on the film's y axis at which the chief ray of a scene angle, in
    /// radians, arrives. The search starts from the height `near`. At a wavelength other than the
    /// one for which the film was placed, the height shows the lateral color.
    pub fn image_height(&self, angle: f64, near: f64, film_z: f64) -> Option<f64> {
        self.height_where(near, film_z, |chief| {
            Some(angle_of(chief.direction) - angle)
        })
    }

    /// The height on the film's y axis, in millimeters, at which a function of the chief ray is 0,
    /// by the secant method from the height `near`.
    pub(crate) fn height_where(
        &self,
        near: f64,
        film_z: f64,
        error: impl Fn(&LensRay) -> Option<f64>,
    ) -> Option<f64> {
        let at = |h: f64| error(&self.chief_ray(DVec2::new(0.0, h), film_z)?);
        let (mut a, mut b) = (near, near * (1.0 + 1e-4));
        let (mut fa, mut fb) = (at(a)?, at(b)?);
        for _ in 0..40 {
            if fb == fa || fb == 0.0 {
                break;
            }
            let next = b - fb * (b - a) / (fb - fa);
            if !next.is_finite() {
                return None;
            }
            let change = (next - b).abs();
            (a, fa, b) = (b, fb, next);
            if change <= 1e-15 * b.abs() {
                break;
            }
            fb = at(b)?;
            if fb.abs() >= fa.abs() && change < 1e-9 * b.abs() {
                // The rounding errors of the rays are reached.
                return Some(a);
            }
        }
        Some(b)
    }
}

/// The angle between a ray into the scene and the axis, in radians.
pub(crate) fn angle_of(direction: DVec3) -> f64 {
    libm::atan2(direction.truncate().length(), -direction.z)
}
