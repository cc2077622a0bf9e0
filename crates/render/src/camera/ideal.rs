//! A thin lens without aberrations or losses, with which real lenses are compared.
//!
//! It is at the camera's position. Every ray from a film point through the aperture goes to the
//! same point of the plane in focus, and the aperture is a disc: there is no vignetting except
//! cos⁴, no distortion and no chromatic aberration.

use std::f64::consts::{FRAC_PI_4, PI};

use glam::{DMat3, DQuat, DVec3};
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel, dispatch, fused};
use ivcam_base::math::{Meters, Mm};
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::FilmFormat;
use ivcam_optics::sampling::Samples;

use super::film_samples::FilmSamples;
use super::rays::{CameraRay, CameraRays, ExitRays, METERS_FROM_MM};

/// A thin lens without aberrations.
#[derive(Clone, Copy, Debug)]
pub struct IdealLens {
    /// The aperture's radius in millimeters.
    radius: f64,
    /// The distance from the lens to the film in millimeters.
    pub film_distance: f64,
    /// The distance from the lens to the plane in focus in meters.
    distance: f64,
    format: FilmFormat,
    pub(super) world_from_camera: DQuat,
    pub(super) eye: DVec3,
    /// The irradiance on the axis from radiance 1, focused at infinity, in steradians. It is
    /// exposure 1.
    pub axial_irradiance: f64,
}

impl IdealLens {
    /// The lens focused at a distance, with the film at f d/(d − f); none if the distance is not
    /// greater than the focal length.
    pub fn new(
        efl: Mm,
        f_number: f64,
        distance: Meters,
        format: FilmFormat,
        pose: &CameraPose,
    ) -> Option<Self> {
        let radius = 0.5 * efl.0 / f_number;
        let away = Mm::from(distance).0;
        let film_distance = efl.0 / (1.0 - efl.0 / away);
        (away > efl.0).then_some(Self {
            radius,
            film_distance,
            distance: distance.0,
            format,
            world_from_camera: pose.orientation,
            eye: DVec3::ZERO,
            axial_irradiance: PI * radius * radius / (radius * radius + efl.0 * efl.0),
        })
    }

    /// The ray for a point of the picture from 0 to 1 and a point of the unit square.
    pub(super) fn ray(&self, place: [f64; 2], pupil: [f64; 2]) -> CameraRay {
        let one = |[a, b]: [f64; 2]| [vec![a], vec![b]];
        let mut samples = Samples::default();
        (samples.film, samples.pupil) = (one(place), one(pupil));
        let mut rays = CameraRays::default();
        self.shoot(&samples, &mut rays);
        let packet = &rays.packets()[0];
        let ray = packet.rays.ray(0);
        CameraRay {
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
            weight: packet.weights[0],
        }
    }

    /// Makes the rays of samples.
    pub(super) fn shoot(&self, samples: &Samples, rays: &mut CameraRays) {
        let mut lanes = FilmSamples::default();
        for first in (0..samples.len()).step_by(LANES) {
            lanes.take_from(self.format, samples, first);
            let out = rays.next_packet();
            dispatch(Through {
                lens: self,
                samples: &lanes,
                out,
            });
            out.rays.mask = u32::MAX >> (LANES - lanes.count);
            rays.accept(first);
        }
    }
}

/// The kernel that makes the rays from film points through the lens.
struct Through<'a> {
    lens: &'a IdealLens,
    samples: &'a FilmSamples,
    out: &'a mut ExitRays,
}

impl SimdKernel for Through<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let (lens, samples, out) = (self.lens, self.samples, self.out);
        let turn = DMat3::from_quat(lens.world_from_camera);
        let v = lens.film_distance;
        let area = PI * lens.radius * lens.radius;
        let unit = v * v * area / lens.axial_irradiance;
        let [mut px, mut py] = [[0.0; LANES]; 2];
        disc::<FUSED>(&samples.pupil, &mut px, &mut py);
        for i in 0..LANES {
            let (lx, ly) = (lens.radius * px[i], lens.radius * py[i]);
            let [fx, fy] = [samples.film[0][i], samples.film[1][i]];
            let (x, y) = (lx - fx, ly - fy);
            let squared = fused::<FUSED>(x, x, fused::<FUSED>(y, y, v * v));
            out.weights[i] = unit / (squared * squared);
            // If the plane in focus is at infinity, all rays have the direction of the middle ray.
            let near = 1.0 / (lens.distance / METERS_FROM_MM);
            let across = DVec3::new(-fx / v - lx * near, -fy / v - ly * near, -1.0);
            let scale = 1.0 / across.length_squared().sqrt();
            let from = DVec3::new(lx, ly, 0.0) * METERS_FROM_MM;
            for axis in 0..3 {
                let row = turn.row(axis);
                out.rays.origin[axis][i] = (lens.eye[axis] + row.dot(from)) as f32;
                out.rays.direction[axis][i] = (row.dot(across) * scale) as f32;
            }
        }
    }
}

/// Shirley and Chiu's map from the square to the unit disc, for all lanes;
/// `sampling::concentric_disc` maps one point. Its angles are at most an eighth of a turn, for
/// which a short series is enough.
#[inline(always)]
fn disc<const FUSED: bool>([u, v]: &[Lane; 2], x: &mut Lane, y: &mut Lane) {
    for i in 0..LANES {
        let (a, b) = (2.0 * u[i] - 1.0, 2.0 * v[i] - 1.0);
        let wide = a.abs() > b.abs();
        let (r, other) = if wide { (a, b) } else { (b, a) };
        let share = if r == 0.0 { 0.0 } else { other / r };
        let (sin, cos) = sin_cos::<FUSED>(FRAC_PI_4 * share);
        (x[i], y[i]) = if wide {
            (r * cos, r * sin)
        } else {
            (r * sin, r * cos)
        };
    }
}

/// The sine and the cosine of an angle up to π/4, by Taylor's series up to terms of 1e-17.
#[inline(always)]
fn sin_cos<const FUSED: bool>(angle: f64) -> (f64, f64) {
    let square = -angle * angle;
    let (mut sin, mut cos) = (1.0, 1.0);
    for k in (1..=8).rev() {
        let k = f64::from(k);
        sin = fused::<FUSED>(sin, square / (2.0 * k * (2.0 * k + 1.0)), 1.0);
        cos = fused::<FUSED>(cos, square / ((2.0 * k - 1.0) * 2.0 * k), 1.0);
    }
    (angle * sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::lanes::bits;
    use ivcam_optics::sampling::disc::concentric_disc;

    #[test]
    fn points_of_the_disc_are_those_of_the_concentric_map() {
        let n = 64;
        for first in (0..n * n).step_by(LANES) {
            let at = |f: &dyn Fn(usize) -> usize| -> Lane {
                std::array::from_fn(|i| f(first + i) as f64 / (n - 1) as f64)
            };
            let [u, v] = [at(&|k| k % n), at(&|k| k / n)];
            let [mut x, mut y] = [[0.0; LANES]; 2];
            disc::<false>(&[u, v], &mut x, &mut y);
            for i in 0..LANES {
                let [a, b] = concentric_disc(u[i], v[i]);
                assert!((x[i] - a).abs() < 1e-15 && (y[i] - b).abs() < 1e-15);
            }
        }
    }

    /// By 1/f = 1/v + 1/d all rays of a film point meet in its image, −d/v times as far from the
    /// axis. A field of radiance 1 gives the exposure cos⁴ (f/v)², for a small aperture.
    #[test]
    fn all_rays_of_a_film_point_meet_in_its_image_and_have_the_weights_of_the_cosine_law() {
        let (efl, n, d) = (50.0, 16.0, 2.0);
        let pose = CameraPose::view_all(Default::default(), 1.5);
        let format = FilmFormat::STANDARD;
        let lens = IdealLens::new(Mm(efl), n, Meters(d), format, &pose).unwrap();
        assert!((1.0 / efl - 1.0 / lens.film_distance - 1.0 / (1e3 * d)).abs() < 1e-15);
        for place in [[0.5, 0.5], [0.9, 0.2], [0.0, 1.0]] {
            let mut samples = Samples::default();
            for k in 0..256 {
                samples.film[0].push(place[0]);
                samples.film[1].push(place[1]);
                samples.pupil[0].push((f64::from(k % 16) + 0.5) / 16.0);
                samples.pupil[1].push((f64::from(k / 16) + 0.5) / 16.0);
            }
            let mut rays = CameraRays::default();
            lens.shoot(&samples, &mut rays);
            let film = [
                (0.5 - place[0]) * format.width,
                (place[1] - 0.5) * format.height,
            ];
            let v = lens.film_distance;
            let image = DVec3::new(-film[0] * d / v, -film[1] * d / v, -d);
            let back = lens.world_from_camera.inverse();
            let mut exposure = 0.0;
            let packets = rays.packets().iter();
            let lanes = packets.flat_map(|packet| bits(packet.rays.mask).map(move |i| (packet, i)));
            for (packet, lane) in lanes {
                let (ray, weight) = (packet.rays.ray(lane), packet.weights[lane]);
                let (o, w) = (
                    back * ray.origin.as_dvec3(),
                    back * ray.direction.as_dvec3(),
                );
                let off = (image - o).cross(w).length() / w.length();
                assert!(off < 1e-6, "{off} m beside the image");
                exposure += weight / samples.len() as f64;
            }
            let r2 = film[0] * film[0] + film[1] * film[1];
            let cosine = v * v / (v * v + r2);
            let expected = cosine * cosine * (efl / v) * (efl / v);
            assert!(
                (exposure / expected - 1.0).abs() < 2e-3,
                "{exposure} {expected}"
            );
        }
    }
}
