//! Renders a picture in passes over its tiles until a stop condition holds.

use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::batch::Batch;
use super::exposure::{Counts, Exposure, Progress, Stop};
use super::shares::SampleShares;
use super::stopwatch::Stopwatch;
use super::tile::{Band, Tile, TilePixels, strips};
use crate::camera::Camera;
use crate::film::{ErrorEstimate, Exposed, Film, Region, Resolution, SquaredError};
use crate::sampling::{FilterTable, PixelSampler, Sampler, mix};
use crate::shade::Shader;
use crate::team::Team;

/// The least factor between the numbers of samples at which the error is estimated, so that the
/// estimates take at most a fifth of the time of a render with a target.
const LEAST_GROWTH: f64 = 1.2;

/// The largest number of pixels of the pilot pass that are exposed at once, which take 59 MB. With
/// fewer, threads would wait for each other more often.
const PILOT_PIXELS: usize = 1 << 20;

/// The last estimate of a render's error.
#[derive(Default)]
struct Measured {
    squared_error: Option<SquaredError>,
    /// The relative error; `None` if it is unknown.
    error: Option<ErrorEstimate>,
    /// The number of samples per pixel at the estimate.
    samples: u32,
    /// The number of samples per pixel from which the next estimate is worthwhile.
    next: u32,
}

/// A scene and a camera with the settings of a render.
pub(crate) struct Render<'a> {
    /// The shader of the compiled scene.
    pub shader: &'a Shader<'a>,
    /// The camera, in the space of the compiled scene.
    pub camera: &'a Camera,
    /// The generator of sample points.
    pub sampler: Sampler,
    /// The size of the picture in pixels.
    pub resolution: Resolution,
    /// A multiplier on the exposure.
    pub exposure: f64,
    /// The conditions that end the render.
    pub stop: Stop,
    /// The filter that weighs the light around a pixel's center.
    pub filter: &'a FilterTable,
    /// Distributes the samples by the noise that a pilot pass finds. The pilot pass is not part of
    /// the picture.
    pub adaptive: bool,
    /// The processes that share the work; `None` if this one does it alone.
    pub team: Option<&'a Team>,
}

impl Render<'_> {
    /// Exposes the whole film as [`Render::run_inside`] does.
    #[cfg(test)]
    pub(crate) fn run(&self, progress: &(dyn Fn(Progress) + Sync)) -> Exposure {
        self.run_inside(Region::whole(self.resolution), progress)
    }

    /// Exposes a region of the film, calling `progress` after every tile. Uses rayon's current
    /// pool. Pixels get the same bits as in a render of the whole picture; only a limit on error or
    /// time may end the render after another number of samples.
    pub(crate) fn run_inside(
        &self,
        region: Region,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let mut counts = Counts::default();
        let watch = Stopwatch::start();
        let shares = self.pilot_pass(&mut counts);
        let mut exposure = self.run_shared(region, &shares, progress);
        exposure.counts.add(&counts);
        let spent = watch.spent();
        exposure.seconds = spent.seconds;
        exposure.processor_seconds = spent.processor_seconds;
        exposure
    }

    /// Exposes a region of the film with each pixel's share of the samples.
    pub(super) fn run_shared(
        &self,
        region: Region,
        shares: &SampleShares,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let watch = Stopwatch::start();
        let start = Instant::now();
        let tiles = Tile::count(region);
        let mut film = Film::new(region.resolution());
        let mut counts = Counts::default();
        let mut done = 0;
        let mut measured = Measured::default();
        while done < self.stop.samples {
            let pass_start = Instant::now();
            let end = self.pass_end(done);
            let total = tiles * self.passes_left(done);
            let report = |tiles_done: u64| {
                progress(Progress {
                    tiles_done,
                    tiles: total,
                    samples: done,
                    error: measured.error.map(|e| e.relative_rmse),
                });
                true
            };
            if let Some(pass) = self.shared_pass(region, &mut film, done..end, shares, &report) {
                counts.add(&pass);
            }
            let last = pass_start.elapsed() / (end - done).max(1);
            done = end;
            if self.stop.error.is_some() && done >= measured.next {
                measured = self.measured(&film, region, done, &mut counts);
            }
            if self.stops(start, last * (self.pass_end(done) - done), measured.error) {
                break;
            }
        }
        if measured.samples < done {
            measured = self.measured(&film, region, done, &mut counts);
        }
        film.squared_error = measured.squared_error;
        let spent = watch.spent();
        Exposure {
            film,
            counts,
            seconds: spent.seconds,
            processor_seconds: spent.processor_seconds,
            samples: done,
        }
    }

    /// Estimates the error of the film of a region after a number of samples per pixel.
    fn measured(&self, film: &Film, region: Region, samples: u32, counts: &mut Counts) -> Measured {
        let (squared_error, more) = self.measure(film, region, true);
        counts.add(&more);
        let error = squared_error.and_then(|e| e.relative(film.pixels.len(), film.mean()).ok());
        // The error falls with the power 3/4 of the samples at best (over edges in the plane).
        let target = self.stop.error.unwrap_or(0.0);
        let growth = error.map_or(2.0, |e| libm::pow(e.high / target, 4.0 / 3.0));
        let next = f64::from(samples) * growth.clamp(LEAST_GROWTH, 4.0);
        Measured {
            squared_error,
            error,
            samples,
            next: next as u32,
        }
    }

    /// Adds samples to every pixel of a film, which is a region of the picture. After every tile,
    /// `proceed` receives the number of finished tiles; if it returns false, the pass is abandoned
    /// and the result is `None`. Some tiles of the film then have the samples and others do not.
    pub(crate) fn pass(
        &self,
        region: Region,
        film: &mut Film,
        samples: Range<u32>,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> Option<Counts> {
        self.shared_pass(region, film, samples, &SampleShares::EVEN, proceed)
    }

    /// Estimates the noise of each pixel for adaptive sampling from an eighth of the samples, at
    /// least 2 and at most 16 (chosen by trial). Its rays are counted; its light is discarded. It
    /// covers the whole picture, so that the shares in a region are those of the whole picture.
    pub(super) fn pilot_pass(&self, counts: &mut Counts) -> SampleShares {
        if !self.adaptive {
            return SampleShares::EVEN;
        }
        let pilot = Render {
            sampler: Sampler {
                seed: mix(self.sampler.seed ^ 0x6c6f_6f6b),
                ..self.sampler
            },
            ..*self
        };
        let samples = 0..(self.stop.samples / 8).clamp(2, 16);
        let mut variances = Vec::with_capacity(self.resolution.pixels());
        for strip in strips(Region::whole(self.resolution), PILOT_PIXELS) {
            let mut film = Film::new(strip.resolution());
            if let Some(rays) = pilot.pass(strip, &mut film, samples.clone(), &|_| true) {
                counts.add(&rays);
            }
            variances.extend(film.pixels.iter().map(SampleShares::variance));
        }
        let shares = SampleShares::of(&variances, self.resolution, self.stop.samples);
        self.send_shares(&shares);
        shares
    }

    /// Does the work of [`Render::pass`], with each pixel's share of the samples.
    fn shared_pass(
        &self,
        region: Region,
        film: &mut Film,
        samples: Range<u32>,
        shares: &SampleShares,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> Option<Counts> {
        let finished = Mutex::new(0);
        let one = |mut pixels: TilePixels<'_>| {
            let mut sums = pixels.copied();
            let counts = self.expose(pixels.tile, &mut sums, &samples, shares);
            pixels.set(&sums);
            let mut finished = finished.lock().unwrap_or_else(|e| e.into_inner());
            *finished += 1;
            proceed(*finished).then_some(counts)
        };
        let sum = |a: Counts, b: Counts| Some(a.plus(&b));
        let band = |band: Band<'_>| {
            let tiles = band.tiles().into_par_iter().map(one);
            tiles.try_reduce(Counts::default, sum)
        };
        film.squared_error = None;
        if let Some(team) = self.team {
            return self.pass_of_team(team, (region, film), samples, shares, proceed);
        }
        let bands = Band::all(region, &mut film.pixels).into_par_iter();
        bands.map(band).try_reduce(Counts::default, sum)
    }

    /// Returns the number of samples after the next pass. Without a limit on error or time, all
    /// samples are one pass. Otherwise the number doubles with every pass, from 4, by at most 64.
    fn pass_end(&self, done: u32) -> u32 {
        if self.stop.error.is_none() && self.stop.time.is_none() {
            return self.stop.samples;
        }
        let step = if done == 0 { 4 } else { done.min(64) };
        let step = step.next_multiple_of(self.sampler.period());
        (done + step).min(self.stop.samples)
    }

    /// Estimates the number of passes to the last sample, this one included.
    fn passes_left(&self, done: u32) -> u64 {
        u64::from(
            (self.stop.samples - done)
                .div_ceil(self.pass_end(done).max(1) - done)
                .max(1),
        )
    }

    /// Returns whether the render stops before the next pass, which is expected to take `next`. A
    /// target is met only if the upper end of the error's interval meets it.
    fn stops(&self, start: Instant, next: Duration, error: Option<ErrorEstimate>) -> bool {
        let target = self.stop.error.zip(error);
        let good = target.is_some_and(|(limit, e)| e.high <= limit);
        let late = self
            .stop
            .time
            .is_some_and(|limit| start.elapsed() + next > limit);
        good || late
    }

    /// Adds samples to the pixels of one tile, which are in `sums` row by row. It needs nothing but
    /// the tile's own pixels, so tiles can be exposed in any order and anywhere.
    pub(super) fn expose(
        &self,
        tile: Tile,
        sums: &mut [Exposed],
        samples: &Range<u32>,
        shares: &SampleShares,
    ) -> Counts {
        let mut batch = Batch::new(self);
        for (slot, (x, y)) in tile.pixels().enumerate() {
            let number = y * self.resolution.width + x;
            let samples = shares.samples(number, samples);
            batch.add((x, y), self.sampler, samples, &mut sums[..=slot]);
        }
        batch.flush(sums);
        Counts {
            film_rays: batch.counts.film_rays,
            passed: batch.counts.passed,
            scene_rays: batch.work.counts.scene,
            shadow_rays: batch.work.counts.shadow,
            error_rays: 0,
        }
    }

    /// Returns the samples of one pixel.
    pub(super) fn pixel(&self, sampler: Sampler, (x, y): (u32, u32)) -> PixelSampler {
        let number = u64::from(y * self.resolution.width + x);
        sampler.pixel(number, [x, y])
    }

    /// Returns the exposure of one sample of a pixel, traced by itself with the bits that it has in
    /// a tile. A lost ray has exposure 0 and is a sample like any other.
    #[cfg(any(test, feature = "panels"))]
    pub(crate) fn sample(
        &self,
        pixel: (u32, u32),
        index: u32,
        work: &mut crate::shade::Work,
    ) -> glam::DVec3 {
        let mut batch = Batch::new(self);
        let mut sums = [Exposed::default()];
        std::mem::swap(&mut batch.work, work);
        batch.add(pixel, self.sampler, index..index + 1, &mut sums);
        batch.flush(&mut sums);
        std::mem::swap(&mut batch.work, work);
        sums[0].mean
    }
}
