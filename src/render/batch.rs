//! Samples of a tile on their way from the film to the scene and back, a packet at a time.

use std::ops::Range;

use glam::DVec3;

use super::exposure::Counts;
use super::passes::Render;
use crate::bvh::Hit;
use crate::camera::{CameraRays, SpectralCorrections};
use crate::film::{Exposed, Resolution, Twin};
use crate::lens::Bundle;
use crate::math::lanes::{LANES, SimdKernel, Vec3Lanes, dispatch};
use crate::sampling::{Sampler, Samples};
use crate::shade::Work;

/// Takes places in pixels to the picture along one axis. There is no film beyond its edges: a
/// filter that reaches over looks back from there.
struct Place<'a> {
    places: &'a mut [f64],
    pixels: &'a [f64],
    /// Of a pixel.
    size: f64,
}

impl SimdKernel for Place<'_> {
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

/// What a tile gives back.
#[derive(Default)]
pub(super) struct Part {
    pub pixels: Vec<Exposed>,
    pub twins: Vec<Twin>,
    pub counts: Counts,
}

/// Samples of a tile on their way, a batch at a time.
pub(super) struct Batch<'a> {
    render: &'a Render<'a>,
    samples: Samples,
    /// Of each sample: its pixel, what its light counts, and the sum that it adds to.
    pixels: [Vec<f64>; 2],
    weights: Vec<f64>,
    slots: Vec<usize>,
    /// As many as fit.
    size: usize,
    /// Rays of a sample.
    each: usize,
    bundle: Bundle,
    /// The rays that got through, and the radiances along them.
    rays: CameraRays,
    radiances: Vec<Vec3Lanes>,
    /// Rays of other wavelengths that may bring other light, and those of them that are shaded.
    corrections: SpectralCorrections,
    accepted: CameraRays,
    /// The hits of `rays` and of `corrections`.
    hits: [Vec<Option<Hit>>; 2],
    exposures: Vec<DVec3>,
    pub work: Work,
    pub counts: Counts,
}

impl<'a> Batch<'a> {
    pub(super) fn new(render: &'a Render<'a>) -> Self {
        Self {
            render,
            samples: Samples::default(),
            pixels: Default::default(),
            weights: Vec::new(),
            slots: Vec::new(),
            size: render.camera.batch(),
            each: render.camera.rays_each(),
            bundle: Bundle::default(),
            rays: CameraRays::default(),
            radiances: Vec::new(),
            corrections: SpectralCorrections::default(),
            accepted: CameraRays::default(),
            hits: Default::default(),
            exposures: Vec::new(),
            work: Work::default(),
            counts: Counts::default(),
        }
    }

    /// Asks for samples of a pixel, which add to the last of the sums.
    pub(super) fn add(
        &mut self,
        at: (u32, u32),
        sampler: Sampler,
        samples: Range<u32>,
        sums: &mut [Exposed],
    ) {
        let pixel = self.render.pixel(sampler, at);
        self.counts.film_rays += u64::from(samples.end - samples.start) * self.each as u64;
        let mut samples = samples;
        while !samples.is_empty() {
            let filled = self.slots.len();
            let count = samples.len().min(self.size - filled);
            let now = samples.start..samples.start + count as u32;
            samples.start = now.end;
            if self.each > 1 {
                let wavelengths = now.clone().map(|index| pixel.wavelength(index));
                self.samples.wavelength.extend(wavelengths);
            }
            self.samples.ask(&pixel, now);
            self.pixels[0].resize(filled + count, f64::from(at.0));
            self.pixels[1].resize(filled + count, f64::from(at.1));
            self.slots.resize(filled + count, sums.len() - 1);
            if filled + count == self.size {
                self.flush(sums);
            }
        }
    }

    /// Traces what was asked for, in order.
    pub(super) fn flush(&mut self, sums: &mut [Exposed]) {
        self.samples.draw();
        self.place();
        let camera = self.render.camera;
        let (rays, corrections) = (&mut self.rays, &mut self.corrections);
        camera.shoot(&self.samples, &mut self.bundle, rays, corrections);
        self.shade();
        self.counts.passed += self.rays.passed as u64;
        self.exposures.clear();
        self.exposures.resize(self.slots.len(), DVec3::ZERO);
        if !self.corrections.rays.is_empty() {
            self.correct();
        }
        camera.expose(&self.rays, &self.radiances, &mut self.exposures);
        let mut samples = self.exposures.iter().zip(&self.weights);
        for of_one in self.slots.chunk_by(|a, b| a == b) {
            // A sum of its own: in the list each would wait for the one before.
            let mut sum = sums[of_one[0]];
            for (exposure, weight) in samples.by_ref().take(of_one.len()) {
                sum.add(*exposure * *weight);
            }
            sums[of_one[0]] = sum;
        }
        self.samples.clear();
        self.pixels.iter_mut().for_each(Vec::clear);
        self.slots.clear();
    }

    /// Takes the samples from their pixels to the picture, by the filter.
    fn place(&mut self) {
        let render = self.render;
        let Resolution { width, height } = render.resolution;
        let size = [1.0 / f64::from(width), 1.0 / f64::from(height)];
        self.weights.clear();
        self.weights.resize(self.slots.len(), render.exposure);
        for (axis, size) in size.into_iter().enumerate() {
            let places = &mut self.samples.film[axis];
            render.filter.spread(places, &mut self.weights);
            dispatch(Place {
                places,
                pixels: &self.pixels[axis],
                size,
            });
        }
    }

    /// Computes the radiances along all rays that got through, a packet at a time.
    fn shade(&mut self) {
        let [hits, _] = &mut self.hits;
        hits.clear();
        let keeps_hits = !self.corrections.rays.is_empty();
        let packets = self.rays.packets();
        self.radiances.resize(packets.len(), [[0.0; LANES]; 3]);
        for (packet, radiances) in packets.iter().zip(&mut self.radiances) {
            let shader = self.render.shader;
            shader.radiances(&packet.rays, radiances, &mut self.work);
            if keeps_hits {
                shader.last_hits(&packet.rays, &self.work, hits);
            }
        }
    }

    /// Intersects rays of other wavelengths, and shades some of them.
    fn correct(&mut self) {
        let shader = self.render.shader;
        let [hits, others] = &mut self.hits;
        others.clear();
        for packet in self.corrections.rays.packets() {
            shader.intersect(&packet.rays, &mut self.work, others);
        }
        let ray = |rays: &CameraRays, i: usize| rays.packets()[i / LANES].rays.ray(i % LANES);
        let unlike: Vec<bool> = (0..self.corrections.rays.len())
            .map(|number| {
                let first = self.corrections.firsts[number] as usize;
                let one = ray(&self.rays, first);
                let other = ray(&self.corrections.rays, number);
                let pair = [(&one, hits[first]), (&other, others[number])];
                shader.scene().is_unlike(pair)
            })
            .collect();
        let accepted = &mut self.accepted;
        self.corrections
            .accept(|i| unlike[i], &mut self.rays, accepted);
        let mut light = Vec::new();
        for packet in accepted.packets() {
            let mut radiances = Vec3Lanes::default();
            shader.radiances(&packet.rays, &mut radiances, &mut self.work);
            light.push(radiances);
        }
        let camera = self.render.camera;
        camera.expose(accepted, &light, &mut self.exposures);
    }
}
