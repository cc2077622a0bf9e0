//! Traces the samples of a tile from the film through the lens into the scene, a packet at a time.

use std::ops::Range;

use glam::DVec3;
use ivcam_base::math::lanes::{LANES, Lanes, SimdKernel, Vec3Lanes, bits, dispatch, set_lane};
use ivcam_optics::film::{Exposed, Resolution};
use ivcam_optics::lens::Bundle;
use ivcam_optics::sampling::{CameraSamples, PathPoints, Sampler};

use super::exposure::Counts;
use super::passes::Render;
use super::sample_window::SampleWindow;
use super::shares::SampleShares;
use super::tile::Tile;
use super::units::{is_border, pieces};
use crate::bvh::{Hit, PacketHits, Ray};
use crate::camera::{CameraRays, ExitRays, LampFinder, LampRays, SpectralCorrections};
use crate::shade::{Shader, Work};

/// Converts positions within pixels to positions on the film along one axis, from 0 to 1. There is
/// no film beyond its edges: a filter that extends beyond an edge is mirrored there.
struct BatchPlace<'a> {
    /// Positions relative to the pixels, replaced by positions on the film.
    places: &'a mut [f64],
    /// The column or row of each sample's pixel.
    pixels: &'a [f64],
    /// The size of a pixel, in film widths or heights.
    size: f64,
}

impl SimdKernel for BatchPlace<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        for (place, pixel) in self.places.iter_mut().zip(self.pixels) {
            let inside = ((pixel + *place) * self.size).abs();
            let inside = if inside > 1.0 { 2.0 - inside } else { inside };
            *place = inside.clamp(0.0, 1.0);
        }
    }
}

/// Collects samples of a tile and traces them when the batch is full.
pub(super) struct Batch<'a> {
    render: &'a Render<'a>,
    samples: CameraSamples,
    /// The column and the row of each sample's pixel.
    pixels: [Vec<f64>; 2],
    /// The weight of each sample's light.
    weights: Vec<f64>,
    /// The index of the sum that each sample adds to.
    slots: Vec<usize>,
    /// The samples that are dense in a part of their pixel.
    windows: Vec<(Range<usize>, SampleWindow)>,
    /// The random numbers of each sample's path, if the shader follows paths.
    paths: Vec<PathPoints>,
    /// The number of samples in a full batch.
    size: usize,
    /// Whether samples have wavelengths.
    is_spectral: bool,
    bundle: Bundle,
    /// The rays that passed through the lens.
    rays: CameraRays,
    /// The radiances along `rays`, packet by packet.
    radiances: Vec<Vec3Lanes>,
    /// Rays of other wavelengths whose light may differ from the first ray's.
    corrections: SpectralCorrections,
    /// The rays of `corrections` that are shaded.
    accepted: CameraRays,
    /// The radiances along `accepted`.
    light: Vec<Vec3Lanes>,
    /// The hits of `rays` and of `corrections`.
    hits: [Vec<PacketHits>; 2],
    /// The finder of lamps, if there are any.
    finder: Option<&'a LampFinder<'a>>,
    /// The shares of the emission that rays meet.
    glow: Vec<Lanes<f32>>,
    /// The rays toward lamps.
    lamps: LampRays,
    exposures: Vec<DVec3>,
    pub work: Work,
    /// The rays from the film that were added to the batch and that passed.
    pub counts: Counts,
}

impl<'a> Batch<'a> {
    pub(super) fn new(render: &'a Render<'a>) -> Self {
        Self {
            render,
            samples: CameraSamples::default(),
            pixels: Default::default(),
            weights: Vec::new(),
            slots: Vec::new(),
            windows: Vec::new(),
            paths: Vec::new(),
            size: render.camera.batch(),
            is_spectral: render.camera.is_spectral(),
            bundle: Bundle::default(),
            rays: CameraRays::default(),
            radiances: Vec::new(),
            corrections: SpectralCorrections::default(),
            accepted: CameraRays::default(),
            light: Vec::new(),
            hits: Default::default(),
            finder: render
                .lamps
                .filter(|lamps| render.shader.follows_paths() && lamps.is_useful()),
            glow: Vec::new(),
            lamps: LampRays::default(),
            exposures: Vec::new(),
            work: Work::default(),
            counts: Counts::default(),
        }
    }

    /// Adds samples to the pixels of some tiles, which are in `sums` tile by tile and row by row.
    /// It needs nothing but the tiles' own pixels, so tiles can be exposed in any order and
    /// anywhere. The batch must be empty, and is empty afterwards; its memory serves the next
    /// tiles.
    pub(super) fn expose(
        &mut self,
        tiles: &[Tile],
        sums: &mut [Exposed],
        samples: &Range<u32>,
        shares: &SampleShares,
    ) -> Counts {
        self.counts = Counts::default();
        self.work.counts = Default::default();
        let (sampler, width) = (self.render.sampler, self.render.resolution.width);
        let mut unit = Vec::new();
        for piece in pieces(samples) {
            let is_unit = piece.start > 0 && is_border(piece.start);
            unit.clear();
            unit.resize(if is_unit { sums.len() } else { 0 }, Exposed::default());
            let target = if is_unit { &mut unit[..] } else { &mut *sums };
            let pixels = tiles.iter().flat_map(|tile| tile.pixels());
            for (slot, (x, y)) in pixels.enumerate() {
                let samples = shares.samples(y * width + x, &piece);
                self.add((x, y), sampler, samples, &mut target[..=slot]);
            }
            self.flush(target);
            sums.iter_mut()
                .zip(&unit)
                .for_each(|(sum, unit)| sum.join(unit));
        }
        Counts {
            scene_rays: self.work.counts.scene,
            shadow_rays: self.work.counts.shadow,
            ..self.counts
        }
    }

    /// Adds samples of a pixel to the batch; their light goes to the last of the sums.
    pub(super) fn add(
        &mut self,
        at: (u32, u32),
        sampler: Sampler,
        samples: Range<u32>,
        sums: &mut [Exposed],
    ) {
        self.add_in(at, None, sampler, samples, sums);
    }

    /// Adds samples of a pixel that are dense in a window, if there is one.
    pub(super) fn add_in(
        &mut self,
        at: (u32, u32),
        window: Option<SampleWindow>,
        sampler: Sampler,
        samples: Range<u32>,
        sums: &mut [Exposed],
    ) {
        let pixel = self.render.pixel(sampler, at);
        self.counts.film_rays += u64::from(samples.end - samples.start);
        let mut samples = samples;
        while !samples.is_empty() {
            let filled = self.slots.len();
            let count = samples.len().min(self.size - filled);
            let now = samples.start..samples.start + count as u32;
            samples.start = now.end;
            if self.is_spectral {
                self.samples.wavelength.resize(filled + count, 0.0);
                pixel.wavelengths(now.start, &mut self.samples.wavelength[filled..]);
            }
            if self.render.shader.follows_paths() {
                self.paths
                    .extend(now.clone().map(|index| pixel.path(index)));
            }
            self.samples.request(&pixel, now);
            self.pixels[0].resize(filled + count, f64::from(at.0));
            self.pixels[1].resize(filled + count, f64::from(at.1));
            self.slots.resize(filled + count, sums.len() - 1);
            if let Some(window) = window {
                self.windows.push((filled..filled + count, window));
            }
            if filled + count == self.size {
                self.flush(sums);
            }
        }
    }

    /// Calls `visit` with the ray of each sample of a pixel that passes through the lens, with what
    /// it meets first and the weight of its light. The batch must be empty, and is empty
    /// afterwards. Rays of more than one wavelength must not be used.
    pub(super) fn survey(
        &mut self,
        at: (u32, u32),
        sampler: Sampler,
        samples: Range<u32>,
        visit: &mut dyn FnMut(&Ray, Option<Hit>, f64),
    ) {
        let pixel = self.render.pixel(sampler, at);
        for first in samples.clone().step_by(self.size) {
            let now = first..samples.end.min(first + self.size as u32);
            let count = now.len();
            self.samples.request(&pixel, now);
            self.pixels[0].resize(count, f64::from(at.0));
            self.pixels[1].resize(count, f64::from(at.1));
            self.slots.resize(count, 0);
            self.shoot();
            let shader = self.render.shader;
            for packet in self.rays.packets() {
                let mut hits = PacketHits::default();
                shader.hits(&packet.rays, &mut hits, &mut self.work);
                for lane in bits(packet.rays.mask) {
                    let weight = packet.weights[lane] * self.weights[packet.samples[lane] as usize];
                    visit(&packet.rays.ray(lane), hits.hit(lane), weight);
                }
            }
            self.clear();
        }
    }

    /// Traces the samples of the batch, adds their light to the sums in order, and empties it.
    pub(super) fn flush(&mut self, sums: &mut [Exposed]) {
        if self.render.shader.scene().is_stopped() {
            return self.clear(); // Nobody uses the sums.
        }
        self.shoot();
        let camera = self.render.camera;
        self.shade();
        self.counts.passed += self.rays.passed as u64;
        self.exposures.clear();
        self.exposures.resize(self.slots.len(), DVec3::ZERO);
        if !self.corrections.rays.is_empty() {
            self.correct();
        }
        camera.expose(&self.rays, &self.radiances, &mut self.exposures);
        if let Some(finder) = self.finder {
            self.find_lamps(finder);
        }
        let mut samples = self.exposures.iter().zip(&self.weights);
        for run in self.slots.chunk_by(|a, b| a == b) {
            // A local sum stays in registers; adding in the list costs a store and a load each.
            let mut sum = sums[run[0]];
            for (exposure, weight) in samples.by_ref().take(run.len()) {
                sum.add(*exposure * *weight);
            }
            sums[run[0]] = sum;
        }
        self.clear();
    }

    /// Sends the samples of the batch through the lens.
    fn shoot(&mut self) {
        self.samples.draw();
        self.place();
        let (rays, corrections) = (&mut self.rays, &mut self.corrections);
        let camera = self.render.camera;
        camera.shoot(&self.samples, &mut self.bundle, rays, corrections);
    }

    /// Empties the batch.
    fn clear(&mut self) {
        self.samples.clear();
        self.pixels.iter_mut().for_each(Vec::clear);
        self.slots.clear();
        self.windows.clear();
        self.paths.clear();
    }

    /// Distributes the samples by the pixel filter and converts them to positions on the film.
    fn place(&mut self) {
        let render = self.render;
        let Resolution { width, height } = render.resolution;
        let size = [1.0 / f64::from(width), 1.0 / f64::from(height)];
        self.weights.clear();
        self.weights.resize(self.slots.len(), render.exposure);
        let [x, y] = &mut self.samples.film;
        for (samples, window) in &self.windows {
            for sample in samples.clone() {
                self.weights[sample] *= window.narrow([&mut x[sample], &mut y[sample]]);
            }
        }
        for (axis, size) in size.into_iter().enumerate() {
            let places = &mut self.samples.film[axis];
            render.filter.spread(places, &mut self.weights);
            dispatch(BatchPlace {
                places,
                pixels: &self.pixels[axis],
                size,
            });
        }
    }

    /// Computes the radiances along all rays that passed through the lens, a packet at a time.
    fn shade(&mut self) {
        let shader = self.render.shader;
        let packets = self.rays.packets();
        self.radiances.resize(packets.len(), [[0.0; LANES]; 3]);
        let [hits, _] = &mut self.hits;
        if let Some(finder) = self.finder {
            return self.shade_with_lamps(finder);
        }
        // Only corrections need the hits of all packets.
        let keeps_hits = !self.corrections.rays.is_empty();
        hits.resize(
            if keeps_hits { packets.len() } else { 1 },
            PacketHits::default(),
        );
        for (number, packet) in packets.iter().enumerate() {
            let hits = &mut hits[if keeps_hits { number } else { 0 }];
            let radiances = &mut self.radiances[number];
            shade_packet(
                shader,
                packet,
                &self.paths,
                (hits, radiances),
                &mut self.work,
            );
        }
    }

    /// Computes the radiances along all rays that passed through the lens, with the shares of the
    /// emission that they get where lamps are also found on purpose.
    #[inline(never)]
    fn shade_with_lamps(&mut self, finder: &LampFinder<'_>) {
        let [hits, _] = &mut self.hits;
        hits.resize(self.rays.packets().len(), PacketHits::default());
        shade_weighed(
            (self.render.shader, finder),
            (&self.samples, &self.paths),
            &self.rays,
            (hits, &mut self.glow),
            &mut self.radiances,
            &mut self.work,
        );
    }

    /// Adds the light of lamps that are found on purpose.
    #[inline(never)]
    fn find_lamps(&mut self, finder: &LampFinder<'_>) {
        let Self {
            samples,
            paths,
            bundle,
            lamps,
            light,
            work,
            ..
        } = self;
        let shader = self.render.shader;
        finder.shoot(samples, paths, bundle, lamps);
        let packets = lamps.rays.packets();
        light.clear();
        light.resize(packets.len(), [[0.0; LANES]; 3]);
        let mut hits = PacketHits::default();
        for (number, packet) in packets.iter().enumerate() {
            shader.hits(&packet.rays, &mut hits, work);
            for lane in bits(packet.rays.mask & hits.mask) {
                let ray = packet.rays.ray(lane);
                let hit = hits.hit(lane);
                let is_lamp =
                    |hit: &Hit| lamps.is_expected(number * LANES + lane, shader.scene(), &ray, hit);
                if let Some(hit) = hit.filter(is_lamp) {
                    set_lane(&mut light[number], lane, shader.seen_emission(&ray, &hit));
                }
            }
        }
        let camera = self.render.camera;
        camera.expose(&lamps.rays, light, &mut self.exposures);
    }

    /// Intersects rays of other wavelengths, and shades those whose hit differs from the first
    /// ray's.
    fn correct(&mut self) {
        let shader = self.render.shader;
        let corrections = &self.corrections;
        let [hits, others] = &mut self.hits;
        let packets = corrections.rays.packets();
        others.resize(packets.len(), PacketHits::default());
        for (packet, hits) in packets.iter().zip(&mut *others) {
            shader.hits(&packet.rays, hits, &mut self.work);
        }
        let is_unlike = |rays: &CameraRays, [number, main]: [u32; 2]| {
            let hit = |rays: &CameraRays, hits: &[PacketHits], number: u32| {
                let (packet, lane) = rays.lane(number);
                (
                    packet.rays.ray(lane),
                    hits[number as usize / LANES].hit(lane),
                )
            };
            let other = hit(&corrections.rays, others, number);
            shader.scene().is_unlike([hit(rays, hits, main), other])
        };
        let accepted = &mut self.accepted;
        corrections.accept(is_unlike, &mut self.rays, accepted);
        let packets = accepted.packets();
        self.light.resize(packets.len(), [[0.0; LANES]; 3]);
        if let Some(finder) = self.finder {
            others.resize(packets.len(), PacketHits::default());
            shade_weighed(
                (self.render.shader, finder),
                (&self.samples, &self.paths),
                &self.accepted,
                (others, &mut self.glow),
                &mut self.light,
                &mut self.work,
            );
            let camera = self.render.camera;
            return camera.expose(&self.accepted, &self.light, &mut self.exposures);
        }
        for (packet, light) in packets.iter().zip(&mut self.light) {
            let hits = &mut others[0];
            shade_packet(shader, packet, &self.paths, (hits, light), &mut self.work);
        }
        let camera = self.render.camera;
        camera.expose(accepted, &self.light, &mut self.exposures);
    }
}

/// Computes the hits of the rays of a packet and the radiances along them.
fn shade_packet(
    shader: &Shader<'_>,
    packet: &ExitRays,
    paths: &[PathPoints],
    (hits, radiances): (&mut PacketHits, &mut Vec3Lanes),
    work: &mut Work,
) {
    match shader.follows_paths() {
        true => {
            let points = packet.samples.map(|sample| path_of(paths, sample));
            shader.radiances(&packet.rays, Some(&points), hits, radiances, work);
        }
        false => shader.radiances(&packet.rays, None, hits, radiances, work),
    }
}

/// Computes the hits of rays and the radiances along them, with the shares of the emission that
/// they get where lamps are also found on purpose.
#[inline(never)]
fn shade_weighed(
    (shader, finder): (&Shader<'_>, &LampFinder<'_>),
    (samples, paths): (&CameraSamples, &[PathPoints]),
    rays: &CameraRays,
    (hits, glow): (&mut [PacketHits], &mut Vec<Lanes<f32>>),
    radiances: &mut [Vec3Lanes],
    work: &mut Work,
) {
    for (packet, hits) in rays.packets().iter().zip(&mut *hits) {
        shader.hits(&packet.rays, hits, work);
    }
    finder.weigh(samples, rays, hits, glow);
    for (number, packet) in rays.packets().iter().enumerate() {
        let points = packet.samples.map(|sample| path_of(paths, sample));
        shader.path_radiances(
            (&packet.rays, &hits[number]),
            Some(&points),
            &glow[number],
            &mut radiances[number],
            work,
        );
    }
}

/// The random numbers of a sample's path; those of no sample for a lane without a ray.
fn path_of(paths: &[PathPoints], sample: u32) -> PathPoints {
    paths.get(sample as usize).copied().unwrap_or_default()
}
