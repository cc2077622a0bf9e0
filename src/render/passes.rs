//! Renders a picture in passes over its tiles until a stop condition holds.

use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::batch::{Batch, TileExposure};
use super::exposure::{Counts, Exposure, Progress, Stop};
use super::shares::SampleShares;
use super::stopwatch::Stopwatch;
use super::tile::Tile;
use crate::camera::Camera;
use crate::film::{ErrorEstimate, Exposed, Film, Region, Resolution, SquaredError};
use crate::sampling::{FilterTable, PixelSampler, Sampler, mix};
use crate::shade::Shader;

/// The least factor between the numbers of samples at which the error is estimated, so that the
/// estimates take at most a fifth of the time of a render with a target.
const LEAST_GROWTH: f64 = 1.2;

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
        let watch = Stopwatch::start();
        let start = Instant::now();
        let tiles = Tile::inside(region, self.resolution);
        let mut film = Film::new(self.resolution);
        let mut counts = Counts::default();
        let mut done = 0;
        let mut measured = Measured::default();
        let shares = self.pilot_pass(&mut counts);
        while done < self.stop.samples {
            let pass_start = Instant::now();
            let end = self.pass_end(done);
            let total = tiles.len() as u64 * self.passes_left(done);
            let report = |tiles_done: u64| {
                progress(Progress {
                    tiles_done,
                    tiles: total,
                    samples: done,
                    error: measured.error.map(|e| e.relative_rmse),
                });
                true
            };
            if let Some(pass) = self.shared_pass(&tiles, &mut film, done..end, &shares, &report) {
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
        if region != Region::whole(self.resolution) {
            film = film.cut(region);
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

    /// Estimates the error of a region of a film after a number of samples per pixel.
    fn measured(&self, film: &Film, region: Region, samples: u32, counts: &mut Counts) -> Measured {
        let part = (region != Region::whole(self.resolution)).then(|| film.cut(region));
        let part = part.as_ref().unwrap_or(film);
        let (squared_error, more) = self.measure(part, region);
        counts.add(&more);
        let error = squared_error.and_then(|e| e.relative(part.pixels.len(), part.mean()).ok());
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

    /// Adds samples to every pixel. After every tile, `proceed` receives the number of finished
    /// tiles; if it returns false, the pass is abandoned, the film is unchanged, and the result is
    /// `None`.
    pub(crate) fn pass(
        &self,
        tiles: &[Tile],
        film: &mut Film,
        samples: Range<u32>,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> Option<Counts> {
        self.shared_pass(tiles, film, samples, &SampleShares(None), proceed)
    }

    /// Estimates the noise of each pixel for adaptive sampling from an eighth of the samples, at
    /// least 2 and at most 16 (chosen by trial). Its rays are counted; its light is discarded. It
    /// covers the whole picture, so that the shares in a region are those of the whole picture.
    fn pilot_pass(&self, counts: &mut Counts) -> SampleShares {
        if !self.adaptive {
            return SampleShares(None);
        }
        let pilot = Render {
            sampler: Sampler {
                seed: mix(self.sampler.seed ^ 0x6c6f_6f6b),
                ..self.sampler
            },
            ..*self
        };
        let mut film = Film::new(self.resolution);
        let samples = 0..(self.stop.samples / 8).clamp(2, 16);
        if let Some(rays) = pilot.pass(&Tile::all(self.resolution), &mut film, samples, &|_| true) {
            counts.add(&rays);
        }
        SampleShares::of(&film, self.stop.samples)
    }

    /// Does the work of [`Render::pass`], with each pixel's share of the samples.
    fn shared_pass(
        &self,
        tiles: &[Tile],
        film: &mut Film,
        samples: Range<u32>,
        shares: &SampleShares,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> Option<Counts> {
        let finished = Mutex::new(0);
        let one = |&tile: &Tile| {
            let part = self.expose(tile, film, &samples, shares);
            let mut finished = finished.lock().unwrap_or_else(|e| e.into_inner());
            *finished += 1;
            proceed(*finished).then_some(part)
        };
        let parts: Option<Vec<TileExposure>> = tiles.par_iter().map(one).collect();
        let mut counts = Counts::default();
        for (tile, part) in tiles.iter().zip(parts?) {
            counts.add(&part.counts);
            for ((x, y), exposed) in tile.pixels().zip(part.pixels) {
                film.pixels[(y * self.resolution.width + x) as usize] = exposed;
            }
        }
        film.squared_error = None;
        Some(counts)
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

    /// Adds samples to the pixels of one tile.
    fn expose(
        &self,
        tile: Tile,
        film: &Film,
        samples: &Range<u32>,
        shares: &SampleShares,
    ) -> TileExposure {
        let mut batch = Batch::new(self);
        let mut sums: Vec<Exposed> = Vec::new();
        for (x, y) in tile.pixels() {
            let number = y * self.resolution.width + x;
            sums.push(film.pixels[number as usize]);
            let samples = shares.samples(number, samples);
            batch.add((x, y), self.sampler, samples, &mut sums);
        }
        batch.flush(&mut sums);
        TileExposure {
            pixels: sums,
            counts: Counts {
                film_rays: batch.counts.film_rays,
                passed: batch.counts.passed,
                scene_rays: batch.work.counts.scene,
                shadow_rays: batch.work.counts.shadow,
                error_rays: 0,
            },
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
