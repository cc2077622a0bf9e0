//! Follows paths from the camera, those of a packet side by side.

use glam::Vec3;
use ivcam_base::math::lanes::LANES;
use ivcam_optics::sampling::PathPoints;

use super::lamps::{LampRay, power_heuristic};
use super::material::{PathSurface, ScatteringMaterial};
use super::options::PathSettings;
use super::vertex::{Vertex, refract};
use crate::bvh::{Hit, Ray, RayPacket};
use crate::scene::{LitFace, MetPoint, Point, RenderScene, Surface, sound_color};
use crate::shade::counts::RayCounts;
use crate::shade::lighting::{clearness, eye};

/// The pairs of random numbers of a turn.
const PAIRS: u32 = 8;
/// The number of turns after which a path may end at random.
const CERTAIN_TURNS: u32 = 1;
/// The share of a path's light up to which it may end, times this, is the probability that it goes
/// on. A factor of 2 takes 0.7 times as long to the same error as 1 after three turns in the living
/// room, and .95 times in an object's studio (docs/decisions/0032-light-paths.md).
const ROULETTE: f32 = 2.0;
/// The largest probability to go on after that. It bounds the length of paths between surfaces that
/// absorb nothing.
const MOST_SURVIVORS: f32 = 0.99;
/// The largest number of surfaces that a path meets.
const MOST_STEPS: u32 = 100_000;
/// The largest number of lights of the file that are sampled where a path turns first. Later turns
/// sample one.
const FIRST_LIGHTS: usize = 4;
/// The largest number of luminous shapes of which a number of 24 bits chooses one, with 14 bits
/// left for the place on it.
const FEW_EMITTERS: usize = 1 << 10;
/// The number of rays toward lamps from which a packet is faster than single rays.
const PACKET_FROM: usize = 8;

/// What lights a scene as a whole.
#[derive(Clone, Copy, Debug)]
pub(in crate::shade) struct PathLights {
    /// The radiance of the even sky that stands for the file's ambient light.
    sky: Vec3,
    /// Whether the background lights the scene.
    background: bool,
    /// Whether there are lights of the file, or what stands for one.
    file: bool,
    /// Whether there are luminous shapes.
    emitters: bool,
    /// Whether there are so many that the choice of one needs more bits than a number has.
    many_emitters: bool,
    /// Whether light from what is seen is stopped as light from the file's lights is.
    plain: bool,
}

impl PathLights {
    pub(in crate::shade) fn of(scene: &RenderScene, settings: &PathSettings<'_>) -> Self {
        let environment = settings.own.environment.as_ref();
        let sky = match environment {
            None if !settings.own.background_lights => scene.ambient_radiance(),
            _ => Vec3::ZERO,
        };
        let emitters = scene.has_emitters();
        let file = scene.has_lights() || settings.headlight.is_some() || settings.own.sun.is_some();
        let is_lit = emitters || file || sky != Vec3::ZERO || environment.is_some();
        Self {
            sky,
            file,
            background: settings.own.background_lights || !is_lit,
            emitters,
            many_emitters: scene.emitters().len() > FEW_EMITTERS,
            plain: scene.sees_what_casts_shadows(),
        }
    }
}

/// A ray from the camera with its hit and the random numbers of its sample.
pub(in crate::shade) struct CameraPath {
    pub lane: usize,
    pub ray: Ray,
    pub hit: Option<Hit>,
    pub points: PathPoints,
    /// The share of the emission of the surface that the ray meets.
    pub glow: f32,
}

/// A path that is followed.
#[derive(Debug)]
struct PathState {
    lane: usize,
    ray: Ray,
    hit: Option<Hit>,
    /// The corners of the triangle that was hit, if it is not of a prototype.
    corners: Option<[Vec3; 3]>,
    points: PathPoints,
    /// The fraction of the light at the ray's end that reaches the camera.
    share: Vec3,
    /// The light found so far: seen directly or scattered once, and the rest.
    light: [Vec3; 2],
    /// The surfaces met so far.
    steps: u32,
    /// The surfaces that scattered the path.
    turns: u32,
    /// The density with which the ray was drawn; infinite for one from the camera or a mirror.
    pdf: f32,
    /// The face where the path has turned last.
    face: LitFace,
    /// Whether only mirrors and glass have turned the path, which then shows what the camera sees.
    is_straight: bool,
    /// The share of the emission of the first surface.
    glow: f32,
}

impl PathState {
    fn new(path: CameraPath) -> Self {
        Self {
            lane: path.lane,
            ray: path.ray,
            hit: path.hit,
            corners: None,
            points: path.points,
            share: Vec3::ONE,
            light: [Vec3::ZERO; 2],
            steps: 0,
            turns: 0,
            pdf: f32::INFINITY,
            face: LitFace::default(),
            is_straight: true,
            glow: path.glow,
        }
    }

    /// Returns a pair of random numbers for the surface that was met last.
    fn pair(&self, number: u32) -> [f32; 2] {
        self.points.pair((self.steps - 1) * PAIRS + number)
    }

    /// Adds light that surfaces have scattered a number of times.
    fn add(&mut self, light: Vec3, scattered: u32) {
        let value = self.share * light;
        if value.is_finite() {
            self.light[usize::from(scattered > 1)] += value;
        }
    }
}

/// The buffers of a thread.
#[derive(Debug, Default)]
pub(in crate::shade) struct PathWork {
    walks: Vec<PathState>,
    /// The numbers of the paths that go on.
    live: Vec<usize>,
    /// Rays toward lamps, each with the number of its path and of the surfaces that scatter its
    /// light.
    lamps: Vec<(usize, u32, LampRay)>,
}

/// Computes radiances by following paths.
pub(in crate::shade) struct PathTracer<'a> {
    pub scene: &'a RenderScene,
    pub settings: PathSettings<'a>,
    pub lights: PathLights,
    /// By the number of the surface.
    pub surfaces: &'a [PathSurface],
}

impl PathTracer<'_> {
    /// Follows paths to their ends and passes the radiance of each with its lane.
    pub(in crate::shade) fn follow(
        &self,
        paths: impl Iterator<Item = CameraPath>,
        work: &mut PathWork,
        counts: &mut RayCounts,
        mut found: impl FnMut(usize, Vec3),
    ) {
        let PathWork { walks, live, lamps } = work;
        walks.clear();
        walks.extend(paths.map(PathState::new));
        live.clear();
        live.extend(0..walks.len());
        while !live.is_empty() {
            lamps.clear();
            // The processor waits for all corners at once, and not for each in turn.
            for &i in live.iter() {
                let walk = &mut walks[i];
                walk.corners = walk.hit.and_then(|hit| self.scene.own_corners(&hit));
            }
            live.retain(|&i| self.step(i, &mut walks[i], lamps));
            self.light_up(walks, lamps, counts);
            counts.scene += live.len() as u64;
            for &i in live.iter() {
                let walk = &mut walks[i];
                walk.hit = match walk.turns {
                    0 => self.scene.hit(&walk.ray),
                    _ => self.scene.hit_seen(&walk.ray),
                };
            }
        }
        for walk in walks.iter() {
            let [direct, indirect] = walk.light;
            let most = indirect.max_element();
            let limited = match self.settings.own.clamp {
                Some(limit) if most > limit => indirect * (limit / most),
                _ => indirect,
            };
            found(walk.lane, direct + limited);
        }
    }

    /// Adds the light of lamps to their paths, where nothing is in the way.
    fn light_up(
        &self,
        walks: &mut [PathState],
        lamps: &mut [(usize, u32, LampRay)],
        counts: &mut RayCounts,
    ) {
        let is_simple = |lamp: &LampRay| !lamp.is_seen || self.lights.plain;
        for some in lamps.chunks(LANES) {
            let mut through = [1.0; LANES];
            let mut rays = RayPacket::default();
            for (slot, (_, _, lamp)) in some.iter().enumerate() {
                if !lamp.has_shadow {
                    continue;
                }
                counts.shadow += 1;
                if !is_simple(lamp) {
                    through[slot] = self.scene.clear_share(&lamp.ray);
                } else if some.len() < PACKET_FROM {
                    through[slot] = self.scene.transmittance(&lamp.ray, lamp.ray.t_max);
                } else {
                    rays.set(slot, &lamp.ray);
                }
            }
            if rays.mask != 0 {
                let mut clear = [1.0; LANES];
                self.scene.transmittances(&rays, &mut clear);
                for slot in ivcam_base::math::lanes::bits(rays.mask) {
                    through[slot] = clear[slot];
                }
            }
            for (slot, (walk, scattered, lamp)) in some.iter().enumerate() {
                let walk = &mut walks[*walk];
                let value = lamp.light * through[slot];
                if value.is_finite() {
                    walk.light[usize::from(*scattered > 1)] += value;
                }
            }
        }
    }

    /// Takes a path from the end of its ray to its next ray. Returns whether it goes on.
    fn step(
        &self,
        number: usize,
        walk: &mut PathState,
        lamps: &mut Vec<(usize, u32, LampRay)>,
    ) -> bool {
        let Some(hit) = walk.hit else {
            self.leave_scene(walk);
            return false;
        };
        walk.steps += 1;
        let owner = self.scene.owner(hit.primitive) as usize;
        if let Some((plain, material)) = &self.surfaces[owner].plain
            && let Some(corners) = &walk.corners
            && let Some(met) = self.scene.plain_point((&walk.ray, &hit), corners, plain)
        {
            let surface = &self.scene.surfaces()[owner];
            return self.scatter((number, walk), (&met, surface), material, lamps);
        }
        let point = self.scene.point(&walk.ray, &hit);
        if point.transparency > 0.0 {
            let [lobe, passing] = walk.pair(0);
            if passing < point.transparency {
                return self.pass(walk, &hit, &point, lobe);
            }
        }
        if walk.is_straight {
            let clear = match walk.turns {
                0 => self.clearness(&point, &walk.ray),
                _ => clearness(&point, walk.ray.origin, self.settings.backward),
            };
            if clear < 1.0 {
                walk.add(
                    (1.0 - clear) * point.surface.environment.fog_color,
                    walk.turns,
                );
                walk.share *= clear;
            }
        }
        let material = ScatteringMaterial::of(&point, &self.settings);
        let place = (&point.met(), point.surface);
        self.scatter((number, walk), place, &material, lamps)
    }

    /// Takes a path from a surface that it meets to its next ray. Returns whether it goes on.
    fn scatter(
        &self,
        (number, walk): (usize, &mut PathState),
        (met, surface): (&MetPoint, &Surface),
        material: &ScatteringMaterial,
        lamps: &mut Vec<(usize, u32, LampRay)>,
    ) -> bool {
        self.add_emission(walk, met, material.emission);
        let Some(reflectance) = material.reflectance.filter(|_| self.may_turn(walk)) else {
            return false;
        };
        let direction = walk.ray.direction.normalize_or(Vec3::NEG_Z);
        let vertex = Vertex::new(*met, direction, reflectance, material.is_mirror);
        self.gather_light((number, &*walk), surface, &vertex, lamps);
        let lobe = if vertex.is_matte() {
            0.0
        } else {
            walk.pair(0)[0]
        };
        let Some((toward, drawn)) = vertex.sample(lobe, walk.pair(1)) else {
            return false;
        };
        walk.face = vertex.lit_face();
        self.turn(walk, vertex.leave(toward), drawn.weight, drawn.pdf)
    }

    /// Adds the rays toward the lamps that are sampled where a path turns.
    fn gather_light(
        &self,
        (number, walk): (usize, &PathState),
        surface: &Surface,
        vertex: &Vertex,
        lamps: &mut Vec<(usize, u32, LampRay)>,
    ) {
        let (share, scattered) = (walk.share, walk.turns + 1);
        let mut add = |mut lamp: LampRay| {
            lamp.light *= share;
            lamps.push((number, scattered, lamp));
        };
        if self.lights.file {
            let most = if walk.turns == 0 { FIRST_LIGHTS } else { 1 };
            let place = (surface, vertex);
            self.file_lights(place, most, walk.pair(2), walk.pair(3), &mut add);
        }
        if self.lights.emitters {
            let finer = match self.lights.many_emitters {
                true => walk.pair(6)[0],
                false => 0.5,
            };
            let lamp = self.luminous_shape(vertex, walk.pair(4), finer);
            lamp.into_iter().for_each(&mut add);
        }
        if self.settings.own.environment.is_some() {
            let ([_, choice], [_, below]) = (walk.pair(6), walk.pair(7));
            let lamp = self.environment_light(vertex, [choice, below], walk.pair(5));
            lamp.into_iter().for_each(&mut add);
        }
    }

    /// Adds the emission of a surface to a path that meets it.
    fn add_emission(&self, walk: &mut PathState, met: &MetPoint, emission: Vec3) {
        let Some(hit) = walk.hit.filter(|_| emission != Vec3::ZERO) else {
            return;
        };
        let mut weight = if walk.steps == 1 { walk.glow } else { 1.0 };
        if walk.pdf < f32::INFINITY && self.lights.emitters {
            let from = walk.ray.origin;
            let emitters = self.scene.emitters();
            let density = emitters.density(self.scene, &walk.face, met.position, &hit);
            let square = (met.position - from).length_squared();
            let cosine = met.geometric.dot(walk.ray.direction.normalize_or_zero());
            weight = power_heuristic(walk.pdf, density * square / cosine.abs());
        }
        walk.add(emission * weight, walk.turns);
    }

    /// The fraction of a point's light that the fog between it and the camera of a ray lets
    /// through.
    fn clearness(&self, point: &Point<'_>, ray: &Ray) -> f32 {
        let PathSettings {
            backward, start, ..
        } = self.settings;
        clearness(point, eye(ray.origin, backward, start), backward)
    }

    /// The light that a camera ray gets from the emission of the surface that it meets.
    pub(in crate::shade) fn seen_emission(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let point = self.scene.point(ray, hit);
        let emission = ScatteringMaterial::emission_of(&point, &self.settings);
        let clear = self.clearness(&point, ray);
        sound_color(emission * (clear * (1.0 - point.transparency)))
    }

    /// Adds the light from outside of the scene to a path that leaves it.
    fn leave_scene(&self, walk: &mut PathState) {
        let background = self.scene.background();
        let direction = walk.ray.direction;
        let own = self.settings.own;
        let environment = own.environment.as_ref().filter(|e| !e.is_black());
        let light = if walk.is_straight {
            match environment {
                Some(light) if !background.is_stated() => light.radiance(direction).0,
                _ => background.color(direction),
            }
        } else {
            let mut light = self.lights.sky;
            if self.lights.background {
                light += sound_color(background.color(direction));
            }
            if let Some(environment) = environment {
                let (radiance, density) = environment.radiance(direction);
                light += radiance * power_heuristic(walk.pdf, density);
            }
            light
        };
        walk.add(light, walk.turns);
    }

    /// Takes a path through a transparent surface, straight on or bent by its index of refraction.
    fn pass(&self, walk: &mut PathState, hit: &Hit, point: &Point<'_>, choice: f32) -> bool {
        let index = point.surface.refraction;
        if index == 1.0 || !(index > 0.0) {
            walk.ray = self.scene.continue_behind(&walk.ray, hit);
            return walk.steps < MOST_STEPS;
        }
        let d = walk.ray.direction.normalize_or(Vec3::NEG_Z);
        let own = point.normal.normalize_or(point.geometric);
        let normal = if own.dot(d) > 0.0 { -own } else { own };
        let ratio = if point.front { 1.0 / index } else { index };
        let mirrored = || d - 2.0 * d.dot(normal) * normal;
        let direction = match refract(d, normal, ratio) {
            Some((share, ahead)) if choice >= share => ahead,
            _ => mirrored(),
        };
        let ray = point.met().leave(direction);
        self.may_turn(walk) && self.turn(walk, ray, Vec3::ONE, f32::INFINITY)
    }

    /// Whether another surface may scatter a path.
    fn may_turn(&self, walk: &PathState) -> bool {
        let most = self.settings.own.max_depth;
        most.is_none_or(|most| walk.turns < most)
    }

    /// Sends a path on along a ray. Returns false if it ends here.
    fn turn(&self, walk: &mut PathState, ray: Ray, weight: Vec3, pdf: f32) -> bool {
        walk.ray = ray;
        walk.share *= weight;
        walk.turns += 1;
        walk.is_straight &= pdf == f32::INFINITY;
        walk.pdf = pdf;
        if walk.turns > CERTAIN_TURNS {
            let goes_on = (ROULETTE * walk.share.max_element()).min(MOST_SURVIVORS);
            if !(walk.pair(7)[0] < goes_on) {
                return false;
            }
            walk.share /= goes_on;
        }
        walk.share.is_finite() && walk.share != Vec3::ZERO && walk.steps < MOST_STEPS
    }
}
