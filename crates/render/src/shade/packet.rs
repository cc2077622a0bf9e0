//! Computes the radiances of a packet of rays, with the points lit in lanes.

use glam::Vec3;
use ivcam_base::math::lanes::{LANES, Lanes, Vec3Lanes, bits, of_lane, set_lane};

use super::lanes::PointLanes;
use super::lighting::{eye, fogged};
use super::many_lights::MANY_LIGHTS;
use super::shader::{Pending, ShadeOptions, Shader, Work};
use super::shading::Shading;
use crate::bvh::{Hit, PacketHits, Ray, RayPacket};
use crate::scene::{Light, Point};

impl Shader<'_> {
    /// Computes the radiances of the rays that hit nothing or a point that this path can light, and
    /// returns a bit mask of those rays.
    pub(super) fn shade_packet(
        &self,
        rays: &RayPacket,
        hits: &PacketHits,
        radiances: &mut Vec3Lanes,
        work: &mut Work,
    ) -> u32 {
        let done = rays.mask & !hits.mask;
        for lane in bits(done) {
            let direction = of_lane(&rays.direction, lane);
            set_lane(radiances, lane, self.scene.background().color(direction));
        }
        work.points
            .gather(self.scene, self.surface_values(), rays, hits);
        if self.shading == Shading::Gl {
            return done | self.interpolate_all(rays, hits, radiances, work);
        }
        let plain = work.points.plain;
        let others = hits.mask & !plain;
        if others == 0 {
            return done | self.lit(plain, radiances, work);
        }
        let paths = std::array::from_fn(|lane| {
            let hit = hits.hit(lane).filter(|_| others >> lane & 1 == 1)?;
            Some((Pending::first(&rays.ray(lane), lane), Some(hit)))
        });
        let mut colors = [Vec3::ZERO; LANES];
        let lit = self.accumulate_all(&paths, radiances, &mut colors, work);
        self.follow_all(&mut colors, work);
        for lane in bits(others) {
            set_lane(radiances, lane, colors[lane]);
        }
        done | plain & lit | others
    }

    /// Returns the point at the hit of a lane. If it was not placed in lanes, it is added to the
    /// points to be lit.
    #[inline(always)]
    fn point(&self, lane: usize, ray: &Ray, hit: &Hit, points: &mut PointLanes) -> Point<'_> {
        if points.placed_here >> lane & 1 == 1 {
            let placed = points.on_triangle(lane);
            let mut point = self.scene.point_on_triangle(ray, hit, &placed);
            point.mix_texture();
            if point.has_color_of_texture() {
                points.recolor(lane, &point);
            }
            return point;
        }
        let point = self.scene.point(ray, hit);
        if !point.surface.base_color {
            points.take(lane, &point, self.shading != Shading::Diffuse);
        }
        point
    }

    /// Lights the end points of paths together with the points that are already in `work`, and adds
    /// their radiance to the colors of the paths' lanes. Returns a bit mask of the lanes that were
    /// lit together.
    fn accumulate_all(
        &self,
        paths: &[Option<(Pending, Option<Hit>)>; LANES],
        radiances: &mut Vec3Lanes,
        colors: &mut [Vec3; LANES],
        work: &mut Work,
    ) -> u32 {
        let points: [Option<Point<'_>>; LANES] = std::array::from_fn(|slot| {
            let (path, hit) = paths[slot].as_ref()?;
            Some(self.point(slot, &path.ray, hit.as_ref()?, &mut work.points))
        });
        let lit = self.lit(work.points.mask, radiances, work);
        for (slot, (path, point)) in paths.iter().zip(&points).enumerate() {
            let Some((path, hit)) = path else { continue };
            let color = &mut colors[path.lane];
            let (Some(hit), Some(point)) = (hit, point) else {
                *color += path.share * self.scene.background().color(path.ray.direction);
                continue;
            };
            let light = if lit >> slot & 1 == 1 {
                of_lane(radiances, slot)
            } else {
                self.light_point(point, &mut work.counts)
            };
            self.accumulate(hit, point, light, path, color, &mut work.pending);
        }
        lit
    }

    /// Interpolates the radiances of points on triangles between their lit corners: model `g` in
    /// lanes. Returns a bit mask of the lanes for which that was possible.
    fn interpolate_all(
        &self,
        rays: &RayPacket,
        hits: &PacketHits,
        radiances: &mut Vec3Lanes,
        work: &mut Work,
    ) -> u32 {
        let mut lanes = work.points.plain;
        let others = work.points.mask & work.points.placed_here & !lanes;
        let points: [Option<Point<'_>>; LANES] = std::array::from_fn(|lane| {
            if others >> lane & 1 == 0 {
                return None;
            }
            let (ray, hit) = (rays.ray(lane), hits.hit(lane)?);
            let placed = work.points.on_triangle(lane);
            let mut point = self.scene.point_on_triangle(&ray, &hit, &placed);
            point.prepare_for_opengl();
            lanes |= u32::from(point.surface.is_opaque()) << lane;
            Some(point)
        });
        let rest: Lanes<f32> = std::array::from_fn(|lane| 1.0 - hits.u[lane] - hits.v[lane]);
        let corners = [(0.0, 0.0, &rest), (1.0, 0.0, &hits.u), (0.0, 1.0, &hits.v)];
        let (mut sum, mut corner) = (Vec3Lanes::default(), hits.clone());
        for (u, v, weights) in corners {
            (corner.u, corner.v) = ([u; LANES], [v; LANES]);
            work.points
                .gather(self.scene, self.surface_values(), rays, &corner);
            for lane in bits(lanes & others) {
                if let Some(point) = points[lane].as_ref().filter(|p| p.has_white_diffuse()) {
                    work.points.recolor(lane, point);
                }
            }
            lanes = self.lit(lanes, radiances, work);
            for (sum, light) in sum.iter_mut().zip(&*radiances) {
                for lane in 0..LANES {
                    sum[lane] += weights[lane] * light[lane];
                }
            }
        }
        for lane in bits(lanes) {
            let mut color = of_lane(&sum, lane);
            if let Some(point) = &points[lane] {
                let ShadeOptions {
                    backward, start, ..
                } = self.options;
                let eye = eye(of_lane(&rays.origin, lane), backward, start);
                color = fogged(point.textured(color), point, eye, backward);
            }
            set_lane(radiances, lane, color);
        }
        lanes
    }

    /// Traces the pending rays, and adds the radiance of each to its lane's color. They are traced
    /// in the order in which they were found, so the order of each lane's sum does not depend on
    /// the other lanes.
    fn follow_all(&self, colors: &mut [Vec3; LANES], work: &mut Work) {
        let mut lit = Vec3Lanes::default();
        while !work.pending.is_empty() {
            let count = work.pending.len().min(LANES);
            work.counts.scene += count as u64;
            let (mut rays, mut hits) = (RayPacket::default(), PacketHits::default());
            let mut alone = 0;
            for (slot, next) in work.pending[..count].iter().enumerate() {
                rays.set(slot, &next.ray);
                alone |= u32::from(!next.joins_packet()) << slot;
            }
            let all = rays.mask;
            rays.mask &= !alone;
            self.scene.hits_any_side(&rays, &mut hits);
            rays.mask = all;
            let mut paths = [const { None }; LANES];
            for (slot, next) in work.pending.drain(..count).enumerate() {
                if alone >> slot & 1 == 1 {
                    hits.set(slot, self.next_hit(&next));
                }
                paths[slot] = Some((next, hits.hit(slot)));
            }
            work.points
                .gather(self.scene, self.surface_values(), &rays, &hits);
            self.accumulate_all(&paths, &mut lit, colors, work);
        }
    }

    /// Lights the points of some lanes, before texture and fog. Returns a bit mask of the lanes for
    /// which that was possible.
    fn lit(&self, lanes: u32, radiances: &mut Vec3Lanes, work: &mut Work) -> u32 {
        match self.shading {
            Shading::Flat | Shading::Normal | Shading::Ambient => {
                work.points.show(self.shading, lanes, radiances);
                return lanes;
            }
            Shading::Diffuse
            | Shading::Phong
            | Shading::Gl
            | Shading::Recursive
            | Shading::Path => {}
        }
        work.points.face_viewer(&self.options);
        let (mut left, mut known) = (lanes, 0);
        while left != 0 {
            let set = work.points.lights(left.trailing_zeros() as usize);
            let lanes = work.points.with_lights(set) & left;
            left &= !lanes;
            if self.lit_by_set(set, lanes, radiances, work) {
                known |= lanes;
            }
        }
        known
    }

    /// Adds up the lights of a set. Returns false, without doing so, if one of them has an ambient
    /// part.
    fn lit_by_set(&self, set: u32, lanes: u32, radiances: &mut Vec3Lanes, work: &mut Work) -> bool {
        let lights = self.scene.lights_of_set(set).chain(&self.options.headlight);
        // Only a VRML 97 light has an ambient part.
        if lights.clone().any(|light| light.ambient != Vec3::ZERO) {
            return false;
        }
        work.points.glow(lanes, radiances);
        let lights = lights.filter(|light| light.color != Vec3::ZERO);
        if self.shading == Shading::Recursive && self.scene.light_count(set) > MANY_LIGHTS {
            self.add_some_lights(lights, lanes, radiances, work);
        } else {
            lights.for_each(|light| self.add_light(light, lanes, radiances, work));
        }
        if self.shading != Shading::Recursive {
            for lane in bits(lanes) {
                let color = of_lane(radiances, lane);
                set_lane(radiances, lane, color.clamp(Vec3::ZERO, Vec3::ONE));
            }
        }
        true
    }

    /// Adds one light to the radiances of some lanes.
    fn add_light(&self, light: &Light, lanes: u32, radiances: &mut Vec3Lanes, work: &mut Work) {
        let Work { points, counts, .. } = work;
        points.reach(light, lanes);
        if points.lit.rays.mask == 0 {
            return;
        }
        let mut through = [1.0; LANES];
        if self.casts_shadows(light) {
            counts.shadow += u64::from(points.lit.rays.mask.count_ones());
            self.scene.transmittances(&points.lit.rays, &mut through);
        }
        points.add(light.color, &through, radiances);
    }
}
