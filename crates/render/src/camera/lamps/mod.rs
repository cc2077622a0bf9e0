//! Finds small lamps through a lens on purpose.
//!
//! A lamp that is small and out of focus makes a disc on the film, and each film point in it sees
//! the lamp through a small part of the pupil, which plain samples hit seldom. Here a sample also
//! chooses a lamp that its film point may see, and a point on it, and finds the aim whose ray meets
//! that point (Newton's iteration). So the lamp's light has two estimates, which are weighted by
//! the power heuristic (Veach 1997).
//!
//! The density of such aims is the density of the point on the lamp times the area of the lamp over
//! the area of aims that cover it. A plain sample that has hit a lamp needs that density too, and
//! gets it by the same search: if that ends at another ray, or does not converge, the aim can only
//! be found plainly. So the two estimates agree whatever the search does.
//!
//! Only what the camera sees directly is found on purpose, not what mirrors or transparent shapes
//! show.

mod cell;
mod meeting;

use std::sync::OnceLock;

use glam::{DVec2, Vec3};
use ivcam_base::math::lanes::{LANES, Lanes, bits};
use ivcam_optics::lens::{Aims, Bundle, Lens, PupilTarget};
use ivcam_optics::sampling::{CameraSamples, PathPoints};
use ivcam_optics::spectrum::{HERO, MAIN};

use super::aim::film_point;
use super::film_samples::FilmSamples;
use super::kinds::Camera;
use super::lens_camera::LensCamera;
use super::rays::{CameraRays, ColorFactor, ExitRays};
use super::spectral::split;
use crate::bvh::{Hit, PacketHits, Ray};
use crate::scene::{Emitters, LampRange, LitFace, RenderScene};
use cell::LampCell;
use meeting::Wanted;

/// The cells along each side of the film.
const SIDE: usize = 64;
/// The pairs of random numbers that choose a lamp and a point on it. No path is so long that it
/// uses them.
const CHOICE: u32 = u32::MAX;
const PLACE: u32 = u32::MAX - 1;
/// The largest distance in front of the lens between two rays that are the same, as a share of the
/// pupil's radius.
const SAME_RAY: f64 = 0.01;

/// Finds the small lamps of a scene through the lens of a camera.
#[derive(Debug)]
pub struct LampFinder<'a> {
    scene: &'a RenderScene,
    camera: &'a LensCamera,
    /// The lamps of each cell of the film, which are found for the first sample there.
    cells: Vec<OnceLock<LampCell>>,
}

/// A point on a lamp, and the film point that sees it.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    /// The number of the lane or sample that it belongs to.
    owner: u32,
    /// The number of the wavelength among those of all sets; 0 if there is only one.
    line: u32,
    film: DVec2,
    /// The aim at which the search begins, and the pupil's radius.
    start: DVec2,
    radius: f64,
    /// The point in the scene, and the outward normal there.
    position: Vec3,
    normal: Vec3,
    /// The primitive with the point.
    hit: Hit,
    /// The density over the lamp's area with which the point is drawn.
    density: f64,
}

/// The aim whose ray meets a lamp.
#[derive(Clone, Copy, Debug)]
struct LampAim {
    aim: DVec2,
    /// The origin of the ray in the scene.
    origin: Vec3,
    /// The density of such aims if lamps are found on purpose, and that of plain samples, both per
    /// square millimeter.
    on_purpose: f64,
    plain: f64,
}

/// Rays toward points on lamps, with what each must hit.
#[derive(Debug, Default)]
pub(crate) struct LampRays {
    pub rays: CameraRays,
    /// By the number of the ray: the primitive, and whether the ray leaves it at the point.
    expected: Vec<(Hit, bool)>,
    sightings: Vec<Sighting>,
}

impl LampRays {
    /// Whether a hit of a ray is on the lamp that the ray was made for.
    pub(crate) fn is_expected(
        &self,
        number: usize,
        scene: &RenderScene,
        ray: &Ray,
        hit: &Hit,
    ) -> bool {
        let (lamp, leaves) = &self.expected[number];
        let is_same = (lamp.primitive, lamp.place) == (hit.primitive, hit.place);
        is_same && (scene.geometric_normal(ray, hit).dot(ray.direction) > 0.0) == *leaves
    }
}

impl<'a> LampFinder<'a> {
    /// The finder of a scene's lamps; `None` if the camera has no lens.
    pub fn new(scene: &'a RenderScene, camera: &'a Camera) -> Option<Self> {
        let Camera::Lens(camera) = camera else {
            return None;
        };
        Some(Self {
            scene,
            camera,
            cells: (0..SIDE * SIDE).map(|_| OnceLock::new()).collect(),
        })
    }

    /// Whether there are luminous shapes.
    pub(crate) fn is_useful(&self) -> bool {
        self.scene.has_emitters()
    }

    /// Whether lamps at a point of the picture, from 0 to 1, are found on purpose.
    pub(crate) fn finds_at(&self, place: [f64; 2]) -> bool {
        self.is_useful() && !self.cell(place).is_empty()
    }

    /// The cell of a point of the picture, from 0 to 1.
    fn cell(&self, [x, y]: [f64; 2]) -> &LampCell {
        let at = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
        let (column, row) = (at(x), at(y));
        self.cells[row * SIDE + column].get_or_init(|| {
            let middle = |k: usize| (k as f64 + 0.5) / SIDE as f64;
            let format = self.camera.format;
            let film = film_point(format, middle(column), middle(row));
            let half = 0.5 / SIDE as f64 * DVec2::new(format.width, format.height);
            let lens = (&self.camera.lens, self.target());
            LampCell::around(film, half, self.camera, lens, self.emitters())
        })
    }

    fn emitters(&self) -> &Emitters {
        self.scene.emitters()
    }

    /// The place from which points on lamps are seen.
    fn eye(&self) -> Vec3 {
        self.camera.eye.as_vec3()
    }

    /// A face before the lens that some lamps shine on, by which one of them is chosen: so the
    /// sides are left out that the lens does not see.
    fn toward(&self, range: LampRange) -> LitFace {
        let (center, _) = self.emitters().tree().node(range).sphere();
        LitFace {
            position: self.eye(),
            normal: (center - self.eye()).normalize_or(Vec3::NEG_Z),
            highlight: None,
        }
    }

    fn target(&self) -> &PupilTarget {
        match &self.camera.spectral {
            Some(lenses) => &lenses.target,
            None => &self.camera.target,
        }
    }

    /// The lens at a wavelength.
    fn lens(&self, line: u32) -> &Lens {
        match &self.camera.spectral {
            Some(lenses) => &lenses.lenses[line as usize / HERO][line as usize % HERO],
            None => &self.camera.lens,
        }
    }

    /// The wavelengths of a sample.
    fn lines(&self, samples: &CameraSamples, sample: usize) -> std::ops::Range<u32> {
        match &self.camera.spectral {
            Some(_) => {
                let set = split(samples.wavelength[sample]).0 * HERO;
                set as u32..(set + HERO) as u32
            }
            None => 0..1,
        }
    }

    /// Computes the share of the light of a lamp that each ray of samples gets where it hits one.
    /// `shares` has as many packets as `rays` afterwards; that of all other rays is 1.
    pub(crate) fn weigh(
        &self,
        samples: &CameraSamples,
        rays: &CameraRays,
        hits: &[PacketHits],
        shares: &mut Vec<Lanes<f32>>,
    ) {
        shares.clear();
        shares.resize(rays.packets().len(), [1.0; LANES]);
        let mut sightings = Vec::new();
        for (number, (packet, hits)) in rays.packets().iter().zip(hits).enumerate() {
            for lane in bits(packet.rays.mask & hits.mask) {
                let owner = (number * LANES + lane) as u32;
                let sample = packet.samples[lane] as usize;
                let Some(hit) = hits.hit(lane) else { continue };
                let ray = packet.rays.ray(lane);
                if let Some(leaf) = self.emitters().leaf(&hit)
                    && let Some(seen) = self.sighting(samples, sample, (&ray, hit, leaf))
                {
                    let line = self.line_of(samples, sample, rays, owner);
                    sightings.push(Sighting {
                        owner,
                        line,
                        ..seen
                    });
                }
            }
        }
        self.solve(&mut sightings, |seen, aim| {
            let (number, lane) = (seen.owner as usize / LANES, seen.owner as usize % LANES);
            let packet = &rays.packets()[number];
            let off = packet.rays.ray(lane).origin.distance(aim.origin);
            if f64::from(off) < SAME_RAY * 1e-3 * seen.radius {
                shares[number][lane] = aim.plain_share() as f32;
            }
        });
    }

    /// The wavelength of a ray.
    fn line_of(
        &self,
        samples: &CameraSamples,
        sample: usize,
        rays: &CameraRays,
        number: u32,
    ) -> u32 {
        let first = self.lines(samples, sample).start;
        let (packet, lane) = rays.lane(number);
        if self.camera.spectral.is_none() || packet.weights[lane] != 0.0 {
            return first
                + if self.camera.spectral.is_some() {
                    MAIN as u32
                } else {
                    0
                };
        }
        let is_own = |color: &&ColorFactor| color.number == number;
        // Mostly every ray has a color.
        let own = rays.colors.get(number as usize).filter(is_own);
        let own = own.or_else(|| rays.colors.iter().find(is_own));
        own.map_or(first, |color| color.line)
    }

    /// What a ray of a sample sees of a lamp; `None` if it is not listed for the film point.
    fn sighting(
        &self,
        samples: &CameraSamples,
        sample: usize,
        (ray, hit, leaf): (&Ray, Hit, u32),
    ) -> Option<Sighting> {
        let place = [samples.film[0][sample], samples.film[1][sample]];
        let (cell, film) = (
            self.cell(place),
            film_point(self.camera.format, place[0], place[1]),
        );
        let chosen = cell.choice_of(film, leaf)?;
        let position = ray.at(hit.t);
        let emitters = self.emitters();
        let of_leaf = emitters.probability(chosen.range, leaf, &self.toward(chosen.range));
        let density = emitters.density_on(self.scene, self.eye(), position, &hit);
        let point = self.camera.lens_point(position.as_dvec3());
        Some(Sighting {
            owner: 0,
            line: 0,
            film,
            start: cell.start(film, &chosen, point),
            radius: cell.radius,
            position,
            normal: self.scene.geometric_normal(ray, &hit),
            hit,
            density: chosen.probability * f64::from(of_leaf) * f64::from(density),
        })
    }

    /// Makes a ray of each wavelength of each sample toward a point on a lamp that its film point
    /// may see. `paths` has the random numbers of the samples. The weights of the rays are those of
    /// the estimate on purpose.
    pub(crate) fn shoot(
        &self,
        samples: &CameraSamples,
        paths: &[PathPoints],
        bundle: &mut Bundle,
        to: &mut LampRays,
    ) {
        to.rays.clear();
        to.expected.clear();
        let mut sightings = std::mem::take(&mut to.sightings);
        sightings.clear();
        for (sample, points) in paths.iter().enumerate() {
            let Some(seen) = self.draw(samples, sample, points) else {
                continue;
            };
            let lines = self.lines(samples, sample);
            let owner = sample as u32;
            sightings.extend(lines.map(|line| Sighting {
                owner,
                line,
                ..seen
            }));
        }
        let mut aimed: Vec<(Sighting, LampAim)> = Vec::new();
        self.solve(&mut sightings, |seen, aim| aimed.push((*seen, aim)));
        for some in aimed.chunk_by(|a, b| a.0.line == b.0.line) {
            for some in some.chunks(LANES) {
                self.trace(some, bundle, to);
            }
        }
        to.sightings = sightings;
    }

    /// Draws a point on a lamp that the film point of a sample may see.
    fn draw(
        &self,
        samples: &CameraSamples,
        sample: usize,
        points: &PathPoints,
    ) -> Option<Sighting> {
        let place = [samples.film[0][sample], samples.film[1][sample]];
        let cell = self.cell(place);
        if cell.is_empty() {
            return None;
        }
        let film = film_point(self.camera.format, place[0], place[1]);
        let [choice, _] = points.pair(CHOICE);
        let (chosen, rest) = cell.choose(film, f64::from(choice))?;
        let emitters = self.emitters();
        let (leaf, of_leaf, _) = emitters.choose(chosen.range, rest, &self.toward(chosen.range))?;
        let on = emitters.point_on(self.scene, self.eye(), leaf, points.pair(PLACE))?;
        let ray = Ray::new(self.eye(), on.position - self.eye());
        let point = self.camera.lens_point(on.position.as_dvec3());
        Some(Sighting {
            owner: 0,
            line: 0,
            film,
            start: cell.start(film, &chosen, point),
            radius: cell.radius,
            position: on.position,
            normal: self.scene.geometric_normal(&ray, &on.hit),
            hit: on.hit,
            density: chosen.probability * f64::from(of_leaf) * f64::from(on.density),
        })
    }

    /// Finds the aims whose rays meet points on lamps, and passes each that plain samples might
    /// have, too. Points are put in the order of their wavelengths.
    fn solve(&self, sightings: &mut [Sighting], mut found: impl FnMut(&Sighting, LampAim)) {
        sightings.sort_by_key(|seen| seen.line);
        for some in sightings.chunk_by(|a, b| a.line == b.line) {
            let lens = self.lens(some[0].line);
            for some in some.chunks(LANES) {
                let wanted: Vec<Wanted> = some.iter().map(|seen| self.wanted(seen)).collect();
                let met = self.camera.meet(lens, &wanted);
                for (seen, met) in some.iter().zip(met) {
                    let aim = met.and_then(|met| self.lamp_aim(seen, &met));
                    if let Some(aim) = aim {
                        found(seen, aim);
                    }
                }
            }
        }
    }

    fn wanted(&self, seen: &Sighting) -> Wanted {
        Wanted {
            film: seen.film,
            start: seen.start,
            radius: seen.radius,
            target: self.camera.lens_point(seen.position.as_dvec3()),
        }
    }

    /// The densities of an aim whose ray meets a lamp; `None` if no plain sample has it.
    fn lamp_aim(&self, seen: &Sighting, met: &meeting::Meeting) -> Option<LampAim> {
        let window = self.target().window(seen.film);
        if !window.contains(met.aim) {
            return None;
        }
        let direction = self.camera.world_from_lens * met.ray.direction;
        let facing = direction.dot(seen.normal.as_dvec3()).abs();
        // Square meters of the lamp for each square millimeter of aims.
        let stretch = met.stretch * 1e-6 / facing;
        let aim = LampAim {
            aim: met.aim,
            origin: self.camera.world_point(met.ray.origin).as_vec3(),
            on_purpose: seen.density * stretch,
            plain: window.density(met.aim),
        };
        (aim.on_purpose > 0.0 && aim.on_purpose.is_finite() && aim.plain > 0.0).then_some(aim)
    }

    /// Traces the rays of some aims at one wavelength.
    fn trace(&self, some: &[(Sighting, LampAim)], bundle: &mut Bundle, to: &mut LampRays) {
        let mut lanes = FilmSamples::default();
        let mut aims = Aims::default();
        for lane in 0..LANES {
            let (seen, aim) = &some[lane.min(some.len() - 1)];
            [lanes.film[0][lane], lanes.film[1][lane]] = seen.film.to_array();
            [aims.x[lane], aims.y[lane]] = aim.aim.to_array();
            aims.area[lane] = (1.0 - aim.plain_share()) / aim.on_purpose;
        }
        lanes.count = some.len();
        let line = some[0].0.line;
        let lens = self.lens(line);
        let mut transmittances = self.camera.transmittances(lens);
        let transmittances = transmittances.as_mut();
        let trace = |out: &mut ExitRays| {
            let camera = self.camera;
            camera.trace(lens, &lanes, &aims, bundle, transmittances, out);
            out.rays.mask
        };
        let through = if self.camera.spectral.is_none() {
            let through = trace(to.rays.next_packet());
            to.rays.append_filled(|lane| some[lane].0.owner);
            through
        } else {
            let mut out = ExitRays::default();
            let through = trace(&mut out);
            for lane in bits(through) {
                let (sample, factor) = (some[lane].0.owner, out.weights[lane]);
                to.rays.push_colored(sample, out.ray(lane), line, factor);
            }
            through
        };
        for lane in bits(through) {
            let seen = &some[lane].0;
            let (packet, at) = to.rays.lane(to.expected.len() as u32);
            let leaves = seen.normal.dot(packet.rays.ray(at).direction) > 0.0;
            to.expected.push((seen.hit, leaves));
        }
    }
}

impl LampAim {
    /// The share of the light that plain samples bring, by the power heuristic.
    fn plain_share(&self) -> f64 {
        let ratio = self.on_purpose / self.plain;
        1.0 / (1.0 + ratio * ratio)
    }
}
