//! The light of one lamp at a turn of a path: a light of the file, a luminous shape, or the
//! environment.
//!
//! A light of the file shows ρ·I·cos θ on a matte color ρ, by the old equation. With the BRDF ρ/π
//! it brings the irradiance π·I·cos θ. Its size only moves the point that it is seen at, and that a
//! spot's cone starts from: the attenuation stays that of its center.

use std::f32::consts::PI;

use glam::Vec3;
use ivcam_inventor::traversal::state::LightKind;

use super::frame::{ShadingFrame, cone_direction};
use super::material::ScatteringMaterial;
use super::options::Flash;
use super::sky::SUN_ANGLE;
use super::tracer::PathTracer;
use super::vertex::Vertex;
use crate::bvh::Ray;
use crate::scene::{IncidentLight, LampFace, Light, SHADOW_END, Surface, sound_color};

/// The largest number of lights of which each is considered; of more, as many are drawn.
const CONSIDERED: usize = 16;

/// The largest radius of a lamp, as a share of the distance from which it is seen.
const LARGEST: f32 = 0.9;

/// A ray toward a lamp, with the light that comes along it if nothing is in the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct LampRay {
    pub ray: Ray,
    pub light: Vec3,
    /// Whether the lamp is a thing that other rays may meet.
    pub is_seen: bool,
    /// Whether anything may be in the way.
    pub has_shadow: bool,
}

/// The part of a light that was found in one of two ways, by the power heuristic.
pub(super) fn power_heuristic(own: f32, other: f32) -> f32 {
    if own == f32::INFINITY {
        return 1.0;
    }
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

impl PathTracer<'_> {
    /// Draws some lights of the file in proportion to their light at a point without shadows, and
    /// passes their rays. If at most `most` lights shine on the point, each is taken once.
    pub(super) fn file_lights(
        &self,
        (surface, vertex): (&Surface, &Vertex),
        most: usize,
        choice: [f32; 2],
        u: [f32; 2],
        mut found: impl FnMut(LampRay),
    ) {
        let settings = &self.settings;
        let own = settings.own;
        let set = self.scene.lights_of(surface);
        let count = self.scene.light_count(surface.lights)
            + usize::from(settings.headlight.is_some())
            + usize::from(own.sun.is_some());
        let lights = set.chain(settings.headlight).chain(&own.sun);
        let is_sized = own.light_radius > 0.0
            || own.sun_angle > 0.0
            || own.sun.is_some()
            || own.flash.is_some();
        let mut shining: [Option<(&Light, IncidentLight, f32)>; CONSIDERED] = [None; CONSIDERED];
        let (mut next, mut used, mut total) = (0, 0, 0.0f32);
        for (number, light) in lights.enumerate() {
            if count > CONSIDERED && number != stratum(next, count, choice[1]) {
                continue;
            }
            next += 1;
            let (incident, widest) = self.reach(light, vertex.position());
            // A large lamp may shine on a point that its center does not shine on.
            let value = match is_sized {
                true => incident.color.abs() * widest,
                false => vertex.eval(incident.toward).0 * incident.color.abs(),
            };
            let weight = value.element_sum();
            if weight > 0.0 && weight.is_finite() {
                shining[used] = Some((light, incident, weight));
                (used, total) = (used + 1, total + weight);
            }
        }
        let considered = count.max(1) as f32 / next.max(1) as f32;
        // The lights lie end to end on a line, and the picks at equal distances.
        let (mut end, mut before) = (choice[0], 0u32);
        for (light, incident, weight) in shining.iter().flatten() {
            let expected = weight / total * most as f32;
            end += expected;
            let picks = end as u32 - before;
            before += picks;
            let factor = match used <= most {
                true => 1.0,
                false => picks as f32 / expected,
            };
            if factor > 0.0 {
                let lamp = self.light_at((light, incident), vertex, u, factor * considered);
                lamp.into_iter().for_each(&mut found);
            }
        }
    }

    /// The flash, if a light is the headlight.
    fn flash_of(&self, light: &Light) -> Option<&Flash> {
        let is_headlight = |own: &Light| std::ptr::eq(own, light);
        let flash = self.settings.own.flash.as_ref();
        flash.filter(|_| self.settings.headlight.is_some_and(is_headlight))
    }

    /// The light that arrives at a point from the center of a light, and the greatest factor of the
    /// cones of its points. That of a lamp with a size is not in the light.
    fn reach(&self, light: &Light, point: Vec3) -> (IncidentLight, f32) {
        if self.has_soft_cone(light) {
            let bare = Light {
                kind: LightKind::Point,
                ..*light
            };
            let incident = bare.reach(point);
            let (toward, distance) = (incident.toward, incident.distance);
            let radius = self.settings.own.light_radius.min(LARGEST * distance);
            // The direction toward the lamp that is nearest to its axis.
            let axis = -light.direction;
            let along = toward.dot(axis);
            let nearest = match along * (distance * distance + radius * radius).sqrt() < distance {
                true => {
                    let aside = (axis - along * toward).normalize_or_zero();
                    (distance * toward + radius * aside).normalize_or(toward)
                }
                false => axis,
            };
            return (incident, light.cone(nearest));
        }
        let mut incident = light.reach(point);
        if let Some(flash) = self.flash_of(light) {
            let to = flash.position - point;
            incident.toward = to.normalize_or(incident.toward);
            incident.distance = to.length();
        }
        (incident, 1.0)
    }

    /// Whether a light has a cone, and a size that makes its edge soft.
    fn has_soft_cone(&self, light: &Light) -> bool {
        let has_cone = !matches!(light.kind, LightKind::Directional | LightKind::Point);
        has_cone && self.settings.own.light_radius > 0.0
    }

    /// The light of a light of the file at a point, times a factor. `incident` is that of its
    /// center.
    fn light_at(
        &self,
        (light, incident): (&Light, &IncidentLight),
        vertex: &Vertex,
        u: [f32; 2],
        factor: f32,
    ) -> Option<LampRay> {
        let own = self.settings.own;
        let is_sun = own.sun.as_ref().is_some_and(|sun| std::ptr::eq(sun, light));
        let sun_angle = own.sun_angle.max(if is_sun { SUN_ANGLE } else { 0.0 });
        let flash = self.flash_of(light);
        let radius = flash.map_or(own.light_radius, |flash| flash.radius);
        let (toward, distance) = match light.kind {
            LightKind::Directional if flash.is_none() && sun_angle > 0.0 => {
                let edge = libm::cosf(0.5 * sun_angle.min(PI));
                (cone_direction(incident.toward, edge, u), f32::INFINITY)
            }
            LightKind::Directional if flash.is_none() => (incident.toward, f32::INFINITY),
            _ if radius > 0.0 => {
                // A disc that faces the point, as large as the sphere looks from far away.
                let radius = radius.min(LARGEST * incident.distance);
                let (r, turn) = (radius * u[0].sqrt(), std::f32::consts::TAU * u[1]);
                let across = Vec3::new(r * libm::cosf(turn), r * libm::sinf(turn), 0.0);
                let to = incident.distance * incident.toward
                    + ShadingFrame::around(incident.toward).world(across);
                (to.normalize_or(incident.toward), to.length())
            }
            _ => (incident.toward, incident.distance),
        };
        let cone = match self.has_soft_cone(light) {
            true => light.cone(toward),
            false => 1.0,
        };
        let light_here = vertex.eval(toward).0 * incident.color * (PI * factor * cone);
        if light_here == Vec3::ZERO {
            return None;
        }
        let mut ray = vertex.leave(toward);
        ray.t_max = distance * SHADOW_END;
        Some(LampRay {
            ray,
            light: light_here,
            is_seen: false,
            has_shadow: self.settings.shadows_at_eye || flash.is_some() || !light.at_eye,
        })
    }

    /// Draws a point on a luminous shape. `finer` continues the first of the numbers `u` beyond
    /// its 24 bits, of which the choice among a million shapes needs 20.
    pub(super) fn luminous_shape(
        &self,
        vertex: &Vertex,
        u: [f32; 2],
        finer: f32,
    ) -> Option<LampRay> {
        let emitters = self.scene.emitters();
        let across = f64::from(u[0]) + f64::from(finer) * f64::exp2(-24.0);
        let lamp = emitters.sample(self.scene, &vertex.lit_face(), (across, u[1]))?;
        let to = lamp.position - vertex.position();
        let distance = to.length();
        let toward = to / distance;
        let (scattered, pdf) = vertex.eval(toward);
        if scattered == Vec3::ZERO || !(distance > 0.0) {
            return None;
        }
        let mut ray = vertex.leave(toward);
        let (emission, normal, clear) = match emitters.face(&lamp) {
            Some(LampFace {
                even: Some(even),
                normal,
                clearance,
                ..
            }) => {
                let emission = sound_color(*even * self.settings.own.emission);
                (emission, *normal, *clearance)
            }
            _ => {
                let mut hit = lamp.hit;
                hit.t = distance;
                if !self.scene.is_seen(&ray, &hit) {
                    return None;
                }
                let there = self.scene.point(&ray, &hit);
                let emission = ScatteringMaterial::emission_of(&there, &self.settings);
                let emission = emission * (1.0 - there.transparency);
                (emission, there.geometric, there.clearance())
            }
        };
        let facing = normal.dot(toward).abs();
        let density = lamp.density * distance * distance / facing;
        let weight = power_heuristic(density, pdf) / density;
        let light = scattered * emission * weight;
        // The ray ends clear of the lamp.
        let start = (ray.origin - vertex.position()).dot(toward);
        ray.t_max = (distance - start) * (1.0 - 1e-4) - clear / facing.max(0.01);
        (light != Vec3::ZERO && light.is_finite()).then_some(LampRay {
            ray,
            light,
            is_seen: true,
            has_shadow: true,
        })
    }

    /// Draws a direction of the environment picture.
    pub(super) fn environment_light(
        &self,
        vertex: &Vertex,
        choice: [f32; 2],
        u: [f32; 2],
    ) -> Option<LampRay> {
        let environment = self.settings.own.environment.as_ref()?;
        if environment.is_black() {
            return None;
        }
        let toward = environment.sample(choice, u);
        let (scattered, pdf) = vertex.eval(toward);
        let (radiance, density) = environment.radiance(toward);
        let weight = power_heuristic(density, pdf) / density;
        let light = scattered * radiance * weight;
        (light != Vec3::ZERO && light.is_finite()).then(|| LampRay {
            ray: vertex.leave(toward),
            light,
            is_seen: true,
            has_shadow: true,
        })
    }
}

/// The number of the light in one of [`CONSIDERED`] equal parts of a list.
fn stratum(part: usize, count: usize, u: f32) -> usize {
    let at = (part as f32 + u) / CONSIDERED as f32 * count as f32;
    match part < CONSIDERED {
        true => (at as usize).min(count - 1),
        false => usize::MAX,
    }
}
