//! The radiances of model `i`, for single rays and packets.

use glam::Vec3;
use ivcam_base::math::lanes::{Lanes, Vec3Lanes, bits, set_lane};
use ivcam_optics::sampling::{PathPoints, mix};

use super::path::{CameraPath, PathLights, PathSettings, PathSurface, PathTracer};
use super::shader::{Shader, Work};
use super::shading::Shading;
use crate::bvh::{Hit, PacketHits, Ray, RayPacket};

impl Shader<'_> {
    /// Whether each ray needs the random numbers of its sample.
    pub(crate) fn follows_paths(&self) -> bool {
        self.shading == Shading::Path
    }

    /// Computes the radiances along the rays of a packet whose hits are known. Without the numbers
    /// of samples, those of a ray depend on its bits. Of the emission of what a ray meets, it gets
    /// the share `glow`.
    pub(crate) fn path_radiances(
        &self,
        (rays, hits): (&RayPacket, &PacketHits),
        points: Option<&Lanes<PathPoints>>,
        glow: &Lanes<f32>,
        radiances: &mut Vec3Lanes,
        work: &mut Work,
    ) {
        let paths = bits(rays.mask).map(|lane| {
            let ray = rays.ray(lane);
            CameraPath {
                lane,
                ray,
                hit: hits.hit(lane),
                points: points.map_or_else(|| points_of_ray(&ray), |points| points[lane]),
                glow: glow[lane],
            }
        });
        let Work {
            paths: own, counts, ..
        } = work;
        self.tracer().follow(paths, own, counts, |lane, light| {
            set_lane(radiances, lane, light);
        });
    }

    /// Returns the radiance along a ray whose hit is known.
    pub(super) fn path_radiance(&self, ray: &Ray, hit: Option<Hit>, work: &mut Work) -> Vec3 {
        let path = CameraPath {
            lane: 0,
            ray: *ray,
            hit,
            points: points_of_ray(ray),
            glow: 1.0,
        };
        let (mut radiance, Work { paths, counts, .. }) = (Vec3::ZERO, work);
        self.tracer()
            .follow(std::iter::once(path), paths, counts, |_, light| {
                radiance = light;
            });
        radiance
    }

    /// Returns the light that a camera ray gets from the emission of what it meets.
    pub(crate) fn seen_emission(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        self.tracer().seen_emission(ray, hit)
    }

    fn tracer(&self) -> PathTracer<'_> {
        let settings = PathSettings {
            own: &self.options.path,
            headlight: self.options.headlight.as_ref(),
            backward: self.options.backward,
            start: self.options.start,
            shadows_at_eye: self.options.shadows_at_eye,
            mirrors: self.options.mirrors,
        };
        let (lights, surfaces) = self.path_lights.get_or_init(|| {
            let surfaces = self.scene.surfaces().iter();
            let surfaces = surfaces.map(|surface| PathSurface::of(surface, &settings));
            (PathLights::of(self.scene, &settings), surfaces.collect())
        });
        PathTracer {
            scene: self.scene,
            lights: *lights,
            surfaces,
            settings,
        }
    }
}

/// The random numbers of a ray that belongs to no sample.
fn points_of_ray(ray: &Ray) -> PathPoints {
    let [x, y, z] = ray.origin.to_array().map(f32::to_bits);
    let [a, b, c] = ray.direction.to_array().map(f32::to_bits);
    let pair = |a: u32, b: u32| u64::from(a) << 32 | u64::from(b);
    PathPoints::independent(mix(pair(x, y) ^ mix(pair(z, a) ^ mix(pair(b, c)))))
}
