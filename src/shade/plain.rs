//! Plain surfaces by all their lights, a bundle of rays at once.

use glam::Vec3;

use crate::scene::wide::bits;
use crate::scene::{BUNDLE, Hit, Light, PlainPoints, Ray};

use super::{Shader, Shading, Work};

impl Shader<'_> {
    /// The radiances of rays that meet plain surfaces or nothing at all, and which those are:
    /// bits.
    pub(super) fn plain(
        &self,
        rays: &[Ray],
        hits: &[Option<Hit>; BUNDLE],
        radiances: &mut [Vec3],
        work: &mut Work,
    ) -> u32 {
        let mut done = 0;
        for (i, (ray, radiance)) in rays.iter().zip(&mut *radiances).enumerate() {
            if hits[i].is_none() {
                *radiance = self.scene.background().color(ray.direction);
                done |= 1 << i;
            }
        }
        let lit = matches!(
            self.shading,
            Shading::Diffuse | Shading::Phong | Shading::Recursive
        );
        if !lit || self.options.as_opengl && self.shading != Shading::Recursive {
            return done;
        }
        let mut points = self.scene.plain_points(rays, hits);
        let mut left = points.mask;
        while left != 0 {
            let set = points.lights[left.trailing_zeros() as usize];
            points.mask = left;
            points.mask = points.with_lights(set);
            left &= !points.mask;
            if self.lit_by_set(set, &points, radiances, work) {
                done |= points.mask;
            }
        }
        done
    }

    /// Adds up the lights of a set; false if one of them is none of the plain ones.
    fn lit_by_set(
        &self,
        set: u32,
        points: &PlainPoints,
        radiances: &mut [Vec3],
        work: &mut Work,
    ) -> bool {
        let lights = self.scene.lights_of_set(set).iter().chain(&self.headlight);
        // A light of VRML 97 may have a share that comes from everywhere.
        if lights.clone().any(|light| light.ambient != Vec3::ZERO) {
            return false;
        }
        for lane in bits(points.mask) {
            radiances[lane] = of_lane(&points.glow, lane);
        }
        for light in lights.filter(|light| light.color != Vec3::ZERO) {
            self.add_plain_light(light, points, radiances, work);
        }
        if self.shading != Shading::Recursive {
            for lane in bits(points.mask) {
                radiances[lane] = radiances[lane].clamp(Vec3::ZERO, Vec3::ONE);
            }
        }
        true
    }

    fn add_plain_light(
        &self,
        light: &Light,
        points: &PlainPoints,
        radiances: &mut [Vec3],
        work: &mut Work,
    ) {
        let lit = points.lit_by(light);
        let mut from = [0; BUNDLE];
        let mut count = 0;
        for lane in bits(points.mask) {
            from[count] = lane;
            count += usize::from(lit.share[lane] > 0.0);
        }
        let from = &from[..count];
        let mut through = [1.0; BUNDLE];
        if self.shading == Shading::Recursive {
            work.to_light.clear();
            work.to_light.extend(from.iter().map(|&lane| {
                let mut ray = Ray::new(of_lane(&lit.origin, lane), of_lane(&lit.toward, lane));
                // Up to the light itself and not to what lies behind it.
                ray.t_max = lit.distance[lane] * (1.0 - 1e-5);
                ray
            }));
            work.counts.shadow += count as u64;
            self.scene
                .transmittances(&work.to_light, &mut through[..count]);
        }
        for (&lane, through) in from.iter().zip(through) {
            let diffuse = of_lane(&points.diffuse, lane);
            radiances[lane] += light.color * diffuse * (lit.share[lane] * through);
        }
    }
}

fn of_lane(all: &[[f32; BUNDLE]; 3], lane: usize) -> Vec3 {
    Vec3::new(all[0][lane], all[1][lane], all[2][lane])
}
