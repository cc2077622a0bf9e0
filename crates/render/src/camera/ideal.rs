//! A thin lens without aberrations or losses, with which real lenses are compared.
//!
//! It is at the camera's position, unless it is moved against the film. Every ray from a film point
//! through the aperture goes to the image of that point by the lens equation, and the aperture is a
//! disc: there is no vignetting except cos⁴, no distortion and no chromatic aberration.
//!
//! The lens is aplanatic: by Abbe's sine condition the sine of the marginal ray's angle at the film
//! is 1/(2N), so the light on the axis is π/(4 N²) at any f-number, and every part of the aperture
//! brings the same. A film point gets cos⁴ of the angle of the ray through the middle.

use std::f64::consts::{FRAC_PI_4, PI};

use glam::{DMat3, DQuat, DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel, dispatch, fused};
use ivcam_base::math::{Meters, Mm};
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{FilmPlace, FirstOrder, Focus, FocusMethod, Movements, PlaceFault};
use ivcam_optics::sampling::CameraSamples;

use super::aim::equation_1;
use super::film_samples::FilmSamples;
use super::rays::{CameraRay, CameraRays, ExitRays, METERS_FROM_MM};

/// A thin lens without aberrations.
#[derive(Clone, Copy, Debug)]
pub struct IdealLens {
    /// The aperture's radius in millimeters.
    radius: f64,
    /// The distance from the lens to the film in millimeters, before the lens is moved.
    pub film_distance: f64,
    /// The focal length in millimeters.
    focal_length: f64,
    format: FilmFormat,
    /// The film in lens space, whose origin is the middle of the lens.
    place: FilmPlace,
    world_from_lens: DQuat,
    /// The middle of the lens, from the scene's origin, in meters.
    eye: DVec3,
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
            focal_length: efl.0,
            format,
            place: FilmPlace::flat(film_distance),
            world_from_lens: pose.orientation,
            eye: DVec3::ZERO,
            axial_irradiance: PI * radius * radius / (efl.0 * efl.0),
        })
    }

    /// The lens moved against the film, which may be bent.
    ///
    /// # Errors
    ///
    /// Returns an error if the film cannot be placed.
    pub fn moved(mut self, movements: &Movements, pose: &CameraPose) -> Result<Self, PlaceFault> {
        let (f, v) = (self.focal_length, self.film_distance);
        let focus = Focus {
            method: FocusMethod::Film,
            distance: 1.0 / (1.0 / f - 1.0 / v),
            film_z: v,
            magnification: 1.0 - v / f,
            image_distance: v,
            extension: v - f,
        };
        let optics = FirstOrder::in_air(f, 0.0);
        self.place = FilmPlace::behind(&optics, 0.0, &focus, movements, self.format)?;
        self.set_pose(pose.orientation, DVec3::ZERO);
        Ok(self)
    }

    /// Sets the orientation and the position of the camera, in meters from the scene's origin.
    pub(super) fn set_pose(&mut self, orientation: DQuat, eye: DVec3) {
        self.world_from_lens = orientation * self.place.camera_from_lens;
        self.eye = eye + orientation * (self.place.offset * METERS_FROM_MM);
    }

    /// The ray for a point of the picture from 0 to 1 and a point of the unit square.
    pub(super) fn ray(&self, place: [f64; 2], pupil: [f64; 2]) -> CameraRay {
        let one = |[a, b]: [f64; 2]| [vec![a], vec![b]];
        let mut samples = CameraSamples::default();
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
    pub(super) fn shoot(&self, samples: &CameraSamples, rays: &mut CameraRays) {
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
        let turn = DMat3::from_quat(lens.world_from_lens);
        let unit = PI * lens.radius * lens.radius / lens.axial_irradiance;
        let [mut px, mut py] = [[0.0; LANES]; 2];
        disc::<FUSED>(&samples.pupil, &mut px, &mut py);
        for i in 0..LANES {
            let (lx, ly) = (lens.radius * px[i], lens.radius * py[i]);
            let film = DVec2::new(samples.film[0][i], samples.film[1][i]);
            let point = lens.place.point(film);
            out.weights[i] = unit * equation_1(-point, lens.place.normal(film));
            // The vergence behind the lens. If it is 0, all rays have the direction of the middle
            // ray.
            let near = 1.0 / lens.focal_length - 1.0 / point.z;
            let (x, y) = (point.x / point.z, point.y / point.z);
            let across = DVec3::new(-x - lx * near, -y - ly * near, -1.0);
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

    /// The rays of a film point through 256 points of the aperture, in camera space in meters, with
    /// their weights.
    fn beam(lens: &IdealLens, pose: &CameraPose, place: [f64; 2]) -> Vec<(DVec3, DVec3, f64)> {
        let mut samples = CameraSamples::default();
        for k in 0..256 {
            samples.film[0].push(place[0]);
            samples.film[1].push(place[1]);
            samples.pupil[0].push((f64::from(k % 16) + 0.5) / 16.0);
            samples.pupil[1].push((f64::from(k / 16) + 0.5) / 16.0);
        }
        let mut rays = CameraRays::default();
        lens.shoot(&samples, &mut rays);
        let back = pose.orientation.inverse();
        let lanes = rays.packets().iter();
        let lanes = lanes.flat_map(|packet| bits(packet.rays.mask).map(move |i| (packet, i)));
        let ray = |(packet, lane): (&ExitRays, usize)| {
            let ray = packet.rays.ray(lane);
            let [o, d] = [ray.origin, ray.direction].map(|v| back * v.as_dvec3());
            (o, d, packet.weights[lane])
        };
        lanes.map(ray).collect()
    }

    /// By 1/f = 1/v + 1/d all rays of a film point meet in its image, −d/v times as far from the
    /// axis. A field of radiance 1 gives the exposure cos⁴ (f/v)², at any aperture.
    #[test]
    fn all_rays_of_a_film_point_meet_in_its_image_and_have_the_weights_of_the_cosine_law() {
        let (efl, d) = (50.0, 2.0);
        let pose = CameraPose::view_all(Default::default(), 1.5);
        let format = FilmFormat::STANDARD;
        for n in [0.7, 1.0, 16.0] {
            let lens = IdealLens::new(Mm(efl), n, Meters(d), format, &pose).unwrap();
            let v = lens.film_distance;
            assert!((1.0 / efl - 1.0 / v - 1.0 / (1e3 * d)).abs() < 1e-15);
            assert!((lens.axial_irradiance / (PI / (4.0 * n * n)) - 1.0).abs() < 1e-14);
            for place in [[0.5, 0.5], [0.9, 0.2], [0.0, 1.0]] {
                let film = [
                    (0.5 - place[0]) * format.width,
                    (place[1] - 0.5) * format.height,
                ];
                let image = DVec3::new(-film[0] * d / v, -film[1] * d / v, -d);
                let rays = beam(&lens, &pose, place);
                for (o, w, _) in &rays {
                    let off = (image - *o).cross(*w).length() / w.length();
                    assert!(off < 1e-6, "{off} m beside the image");
                }
                let exposure = rays.iter().map(|ray| ray.2).sum::<f64>() / rays.len() as f64;
                let r2 = film[0] * film[0] + film[1] * film[1];
                let cosine = v * v / (v * v + r2);
                let expected = cosine * cosine * (efl / v) * (efl / v);
                assert!((exposure / expected - 1.0).abs() < 1e-12);
            }
        }
    }

    /// Merklinger's hinge rule: a lens that is tilted by α turns the plane of sharp focus about a
    /// line at the distance f/sin α from the lens, in the plane through the lens that is parallel
    /// to the film.
    #[test]
    fn a_tilted_lens_is_sharp_on_a_plane_through_its_hinge() {
        let (efl, tilt) = (50.0, 0.1);
        let pose = CameraPose::view_all(Default::default(), 1.5);
        let format = FilmFormat::STANDARD;
        let lens = IdealLens::new(Mm(efl), 2.0, Meters(3.0), format, &pose).unwrap();
        let movements = Movements {
            tilt,
            ..Movements::default()
        };
        let lens = lens.moved(&movements, &pose).unwrap();
        let images = [[0.5, 0.5], [0.1, 0.3], [0.8, 0.45]].map(|place| {
            let rays = beam(&lens, &pose, place);
            // The point where the first ray meets the one that is farthest from it.
            let (a, b) = (rays[0], rays[255]);
            let across = a.1.cross(b.1);
            let t = (b.0 - a.0).cross(b.1).dot(across) / across.length_squared();
            let image = a.0 + t * a.1;
            for (o, w, _) in rays {
                let off = (image - o).cross(w).length() / w.length();
                assert!(off < 1e-4, "{off} m beside the image of {place:?}");
            }
            image
        });
        let normal = (images[1] - images[0]).cross(images[2] - images[0]);
        // The hinge: below the lens, which points down.
        let middle = pose.orientation.inverse() * lens.eye;
        let hinge = middle - DVec3::Y * efl / tilt.sin() * METERS_FROM_MM;
        let off = normal.normalize().dot(hinge - images[0]);
        assert!(off.abs() < 2e-4, "{off} m beside the hinge");
    }

    /// A lens that is raised by a length moves the picture by as much, and a bent film is sharp
    /// where its points have their images.
    #[test]
    fn a_raised_lens_moves_the_picture_and_a_bent_film_bends_the_sharp_plane() {
        let pose = CameraPose::view_all(Default::default(), 1.5);
        let format = FilmFormat::STANDARD;
        let lens = IdealLens::new(Mm(50.0), 2.0, Meters(3.0), format, &pose).unwrap();
        let movements = |rise: f64, film_radius: Option<f64>| Movements {
            rise,
            film_radius,
            ..Movements::default()
        };
        let raised = lens.moved(&movements(4.0, None), &pose).unwrap();
        let v = lens.film_distance;
        let (origin, direction, _) = beam(&raised, &pose, [0.5, 0.5])[0];
        let image = origin + direction * (-3.0 / direction.z);
        assert!(
            (image.y - (4.0 * METERS_FROM_MM + 3.0 * 4.0 / v)).abs() < 1e-5,
            "{image}"
        );
        let bent = lens.moved(&movements(0.0, Some(-100.0)), &pose).unwrap();
        let height: f64 = 0.5 * format.height;
        let z = v - height * height / (100.0 + (1e4 - height * height).sqrt());
        let distance = 1.0 / (1.0 / 50.0 - 1.0 / z);
        let image = DVec3::new(0.0, -height * distance / z, -distance) * METERS_FROM_MM;
        for (o, w, _) in beam(&bent, &pose, [0.5, 1.0]) {
            let off = (image - o).cross(w).length() / w.length();
            assert!(off < 1e-4, "{off} m beside the image");
        }
    }
}
