//! Plain surfaces by all their lights, a bundle of rays at once.

use glam::Vec3;

use crate::scene::wide::bits;
use crate::scene::{BUNDLE, HitLanes, Light, RayLanes, Sides, of_lane};

use super::{Shader, Shading, Work};

impl Shader<'_> {
    /// The radiances of rays that meet plain surfaces or nothing at all, and which those are:
    /// bits.
    pub(super) fn plain(
        &self,
        rays: &RayLanes,
        hits: &HitLanes,
        radiances: &mut Sides,
        work: &mut Work,
    ) -> u32 {
        let mut done = rays.mask & !hits.mask;
        for lane in bits(done) {
            let direction = of_lane(&rays.direction, lane);
            set_lane(radiances, lane, self.scene.background().color(direction));
        }
        let lit = matches!(
            self.shading,
            Shading::Diffuse | Shading::Phong | Shading::Recursive
        );
        if !lit || self.options.as_opengl && self.shading != Shading::Recursive {
            return done;
        }
        self.scene.plain_points(rays, hits, &mut work.points);
        let mut left = work.points.mask;
        while left != 0 {
            let set = work.points.lights(left.trailing_zeros() as usize);
            let lanes = work.points.with_lights(set) & left;
            left &= !lanes;
            if self.lit_by_set(set, lanes, radiances, work) {
                done |= lanes;
            }
        }
        done
    }

    /// Adds up the lights of a set; false if one of them is none of the plain ones.
    fn lit_by_set(&self, set: u32, lanes: u32, radiances: &mut Sides, work: &mut Work) -> bool {
        let lights = self.scene.lights_of_set(set).iter().chain(&self.headlight);
        // A light of VRML 97 may have a share that comes from everywhere.
        if lights.clone().any(|light| light.ambient != Vec3::ZERO) {
            return false;
        }
        work.points.glow(lanes, radiances);
        for light in lights.filter(|light| light.color != Vec3::ZERO) {
            self.add_plain_light(light, lanes, radiances, work);
        }
        if self.shading != Shading::Recursive {
            for lane in bits(lanes) {
                let color = of_lane(radiances, lane);
                set_lane(radiances, lane, color.clamp(Vec3::ZERO, Vec3::ONE));
            }
        }
        true
    }

    fn add_plain_light(&self, light: &Light, lanes: u32, radiances: &mut Sides, work: &mut Work) {
        let Work { points, counts, .. } = work;
        points.reach(light, lanes);
        let mut through = [1.0; BUNDLE];
        if self.shading == Shading::Recursive {
            counts.shadow += u64::from(points.lit.rays.mask.count_ones());
            self.scene.transmittances(&points.lit.rays, &mut through);
        }
        points.add(light.color, &through, radiances);
    }
}

pub(super) fn set_lane(all: &mut Sides, lane: usize, value: Vec3) {
    (all[0][lane], all[1][lane], all[2][lane]) = (value.x, value.y, value.z);
}
