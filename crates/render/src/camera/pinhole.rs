//! A camera without an aperture.

use glam::{DQuat, DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel, dispatch};
use ivcam_inventor::pose::{CameraPose, Projection, ViewExtent};
use ivcam_optics::sampling::CameraSamples;

use super::rays::{CameraRay, CameraRays, ExitRays};

/// A camera without an aperture: the scene's own camera, as Inventor renders it.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    pub(super) world_from_camera: DQuat,
    projection: Projection,
    /// Half of the view's width and height: at distance 1 for a perspective camera, at any distance
    /// for an orthographic one.
    half: DVec2,
    /// The middle of the view, from the camera's axis.
    center: DVec2,
    /// Half of the width and height of the view, where those of the picture are 1. The picture is
    /// black outside the view.
    frame: DVec2,
    /// The distance in meters at which the rays of an orthographic camera start.
    near: f64,
    /// The image of a point at the tangent r of its field angle lies at r·(1 + k₁r² + k₂r⁴):
    /// OpenCV's radial distortion.
    distortion: [f64; 2],
    pub(super) eye: DVec3,
}

/// The number of Newton's steps that invert the distortion. Five reach 1e-12 where the picture of a
/// straight line does not fold back.
const INVERSION_STEPS: usize = 8;

impl Pinhole {
    /// The camera of a pose at the scene's origin, for a picture of an aspect ratio.
    /// [`CameraPose::view_extent`] says what is seen if that is not the camera's own.
    pub fn new(pose: &CameraPose, aspect: f64) -> Self {
        let ViewExtent {
            half,
            center,
            frame,
        } = pose.view_extent(aspect);
        let near = match pose.projection {
            Projection::Perspective { .. } => 0.0,
            Projection::Orthographic { .. } => pose.near,
        };
        Self {
            world_from_camera: pose.orientation,
            projection: pose.projection,
            half,
            center,
            frame,
            near,
            distortion: [0.0; 2],
            eye: DVec3::ZERO,
        }
    }

    /// Returns the camera with radial distortion: the image of a point at the tangent r of its
    /// field angle lies at r·(1 + k₁r² + k₂r⁴), as in OpenCV's camera model, whose focal length is
    /// the pinhole's. An orthographic camera has none.
    pub fn distorted(self, distortion: [f64; 2]) -> Self {
        let distortion = match self.projection {
            Projection::Perspective { .. } => distortion,
            Projection::Orthographic { .. } => [0.0; 2],
        };
        Self { distortion, ..self }
    }

    fn is_distorted(&self) -> bool {
        self.distortion != [0.0; 2]
    }

    /// Returns the point without distortion, at distance 1, whose image is at `image`; none where
    /// the distortion folds the picture back.
    #[inline(always)]
    fn undistorted(&self, image: DVec2) -> Option<DVec2> {
        let [k1, k2] = self.distortion;
        let distance = image.length();
        let slope = |r2: f64| 1.0 + r2 * (3.0 * k1 + 5.0 * k2 * r2);
        let mut r = distance;
        for _ in 0..INVERSION_STEPS {
            let r2 = r * r;
            let off = r * (1.0 + r2 * (k1 + k2 * r2)) - distance;
            r -= off / slope(r2).max(0.1);
        }
        let r2 = r * r;
        let scale = 1.0 + r2 * (k1 + k2 * r2);
        let is_found = (r * scale - distance).abs() <= 1e-9 * (1.0 + distance) && slope(r2) > 0.0;
        is_found.then(|| image / scale)
    }

    /// The ray of a point of the picture from 0 to 1; none outside the view.
    pub(super) fn ray(&self, x: f64, y: f64) -> Option<CameraRay> {
        let (is_inside, origin, direction) = match self.is_distorted() {
            true => self.any_ray::<true>(x, y),
            false => self.any_ray::<false>(x, y),
        };
        is_inside.then_some(CameraRay {
            origin,
            direction,
            weight: 1.0,
        })
    }

    /// Returns the origin and the direction of the ray of a point of the picture, and whether the
    /// point is inside the view. `DISTORTED` says whether the camera has distortion.
    #[inline(always)]
    fn any_ray<const DISTORTED: bool>(&self, x: f64, y: f64) -> (bool, DVec3, DVec3) {
        let view = DVec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y);
        let mut is_inside = (view.x.abs() <= self.frame.x) & (view.y.abs() <= self.frame.y);
        let mut at = view * self.half + self.center;
        if DISTORTED {
            match self.undistorted(at) {
                Some(point) => at = point,
                None => is_inside = false,
            }
        }
        let (origin, direction) = match self.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, DVec3::new(at.x, at.y, -1.0)),
            Projection::Orthographic { .. } => (at.extend(-self.near), DVec3::NEG_Z),
        };
        let turned = self.world_from_camera * direction;
        let origin = self.eye + self.world_from_camera * origin;
        (is_inside, origin, turned.normalize())
    }

    /// Makes the rays of samples.
    pub(super) fn shoot(&self, samples: &CameraSamples, rays: &mut CameraRays) {
        for first in (0..samples.len()).step_by(LANES) {
            let count = LANES.min(samples.len() - first);
            let [mut x, mut y] = [[0.0; LANES]; 2];
            x[..count].copy_from_slice(&samples.film[0][first..first + count]);
            y[..count].copy_from_slice(&samples.film[1][first..first + count]);
            let out = rays.next_packet();
            let inside = dispatch(Projected {
                pinhole: self,
                places: [&x, &y],
                out,
            });
            out.rays.mask = inside & u32::MAX >> (LANES - count);
            rays.accept(first);
        }
    }
}

/// The kernel that makes the rays of points of the picture. They have the bits of single rays.
struct Projected<'a> {
    pinhole: &'a Pinhole,
    places: [&'a Lane; 2],
    out: &'a mut ExitRays,
}

impl SimdKernel for Projected<'_> {
    /// A bit mask of the points inside the view.
    type Output = u32;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> u32 {
        match self.pinhole.is_distorted() {
            true => self.project::<true>(),
            false => self.project::<false>(),
        }
    }
}

impl Projected<'_> {
    #[inline(always)]
    fn project<const DISTORTED: bool>(self) -> u32 {
        let (out, [x, y]) = (self.out, self.places);
        let mut inside = [0u32; LANES];
        for i in 0..LANES {
            let (is_inside, origin, direction) = self.pinhole.any_ray::<DISTORTED>(x[i], y[i]);
            inside[i] = u32::from(is_inside);
            for axis in 0..3 {
                out.rays.origin[axis][i] = origin[axis] as f32;
                out.rays.direction[axis][i] = direction[axis] as f32;
            }
        }
        out.weights = [1.0; LANES];
        (0..LANES).fold(0, |all, i| all | inside[i] << i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::lanes::bits;

    #[test]
    fn the_image_of_a_ray_is_where_the_distortion_puts_it() {
        let pose = CameraPose {
            projection: Projection::Perspective { height_angle: 1.0 },
            ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
        };
        let [k1, k2] = [-0.28, 0.07];
        let plain = Pinhole::new(&pose, 1.5);
        let bent = plain.distorted([k1, k2]);
        for (x, y) in [(0.5, 0.5), (0.1, 0.8), (0.95, 0.3), (0.0, 0.0)] {
            let direction = bent.ray(x, y).unwrap().direction;
            let seen = bent.world_from_camera.inverse() * direction;
            let at = DVec2::new(seen.x, seen.y) / -seen.z;
            let r2 = at.length_squared();
            let image = at * (1.0 + k1 * r2 + k2 * r2 * r2) / plain.half;
            assert!((image.x - (2.0 * x - 1.0)).abs() < 1e-9, "{x} {y}");
            assert!((image.y - (1.0 - 2.0 * y)).abs() < 1e-9, "{x} {y}");
        }
        // With k₁ = −1 no point has its image farther than 2/3·√(1/3) from the center.
        let folded = plain.distorted([-1.0, 0.0]);
        assert!(folded.ray(0.5, 0.45).is_some() && folded.ray(0.0, 0.0).is_none());
    }

    #[test]
    fn rays_of_a_view_off_the_axis_are_those_of_its_pose() {
        let pose = CameraPose {
            position: DVec3::ZERO,
            center: DVec2::new(0.2, 0.05),
            ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
        };
        let pinhole = Pinhole::new(&pose, 1.5);
        for (x, y) in [(0.0, 0.0), (0.3, 0.9), (1.0, 0.5)] {
            let own = pose.ray(DVec2::new(x, y), 1.5).direction;
            let ray = pinhole.ray(x, y).unwrap();
            assert!(ray.direction.distance(own) < 1e-15, "{x} {y}");
        }
    }

    #[test]
    fn rays_in_lanes_have_the_bits_of_single_rays() {
        let perspective = Projection::Perspective { height_angle: 0.8 };
        let orthographic = Projection::Orthographic { height: 2.0 };
        for projection in [perspective, orthographic] {
            let pose = CameraPose {
                projection,
                viewport_mapping: ivcam_inventor::pose::ViewportMapping::CropViewportFillFrame,
                orientation: DQuat::from_rotation_x(0.3) * DQuat::from_rotation_z(1.2),
                center: DVec2::new(0.3, -0.1),
                ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
            };
            let pinhole = Pinhole::new(&pose, 1.5);
            let mut samples = CameraSamples::default();
            for i in 0..75 {
                let place = f64::from(i) / 74.0;
                samples.film[0].push(place);
                samples.film[1].push(1.0 - place * place);
            }
            let mut rays = CameraRays::default();
            pinhole.shoot(&samples, &mut rays);
            let mut seen = 0;
            for packet in rays.packets() {
                for lane in bits(packet.rays.mask) {
                    let sample = packet.samples[lane] as usize;
                    let [x, y] = [samples.film[0][sample], samples.film[1][sample]];
                    let known = pinhole.ray(x, y).expect("inside the view");
                    let (origin, direction) = packet.ray(lane);
                    assert_eq!(origin, known.origin.as_vec3().to_array());
                    assert_eq!(direction, known.direction.as_vec3().to_array());
                    assert_eq!(packet.weights[lane], 1.0);
                    seen += 1;
                }
            }
            let inside = |i: &usize| {
                pinhole
                    .ray(samples.film[0][*i], samples.film[1][*i])
                    .is_some()
            };
            assert_eq!(seen, (0..75).filter(inside).count());
            assert!((20..75).contains(&seen), "{seen}");
        }
    }
}
