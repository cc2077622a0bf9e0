//! Renders a picture in passes over its tiles until a stop condition holds.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ivcam_optics::film::{ErrorEstimate, Exposed, Film, Region, Resolution, SquaredError};
use ivcam_optics::sampling::{FilterTable, PixelSampler, Sampler, mix};
use rayon::prelude::*;

use super::batch::Batch;
use super::exposure::{Counts, Exposure, Progress, Stop, Stopped};
use super::segment::Segment;
use super::shares::SampleShares;
use super::stopwatch::{Spent, Stopwatch};
use super::sums::{Keeper, PicturePlace, Sums};
use super::tile::{Tile, strips};
use super::units::{border_after, border_before};
use crate::camera::{Camera, LampFinder};
use crate::shade::Shader;
use crate::team::Team;

/// The least factor between the numbers of samples at which the error is estimated, so that the
/// estimates take at most a fifth of the time of a render with a target.
const LEAST_GROWTH: f64 = 1.2;

/// The largest number of samples per pixel of a pass without a limit on error or time, unless a
/// unit has more. A tile then takes a tenth of a second, after which a render can be interrupted.
const LONGEST_PASS: u32 = 1024;

/// The largest number of pixels of the pilot pass that are exposed at once, which take 59 MB. With
/// fewer, threads would wait for each other more often.
const PILOT_PIXELS: usize = 1 << 20;

/// The least number of samples per pixel that there must be time for if there is to be a pilot
/// pass: its 2, and as many of the picture. Chosen, not measured.
const PILOT_WORTH: f64 = 4.0;

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

/// What a render has to do.
#[derive(Default)]
pub struct Task<'k> {
    /// The numbers of the samples of each pixel; `None` is all up to the largest number.
    pub samples: Option<Range<u32>>,
    /// The sums of an earlier run, from which the render continues.
    pub sums: Option<Sums>,
    /// Keep the sums, and stop the render.
    pub keepers: &'k [&'k dyn Keeper],
}

/// Returns whether a keeper stops the render.
pub fn is_stopped(keepers: &[&dyn Keeper]) -> bool {
    keepers.iter().any(|keeper| keeper.is_stopped())
}

/// What surrounds the passes of a render.
struct PassRun<'r> {
    /// The number of the first sample that is not made.
    last: u32,
    /// The time of earlier runs.
    before: Spent,
    /// The work of earlier runs, as in [`Progress`].
    work_before: u64,
    watch: &'r Stopwatch,
    keepers: &'r [&'r dyn Keeper],
    progress: &'r (dyn Fn(Progress) + Sync),
}

/// A scene and a camera with the settings of a render.
pub struct Render<'a> {
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
    /// Finds small lamps through the lens on purpose, for model `i`; `None` leaves them to chance.
    pub lamps: Option<&'a LampFinder<'a>>,
}

impl Render<'_> {
    /// Exposes the whole film as [`Render::run_inside`] does.
    pub fn run(&self, progress: &(dyn Fn(Progress) + Sync)) -> Exposure {
        self.run_inside(Region::whole(self.resolution), Task::default(), progress)
    }

    /// Exposes a region of the film as far as a task says, calling `progress` after every tile.
    /// Uses rayon's current pool. Pixels get the same bits as in a render of the whole picture, and
    /// as in one that nothing interrupts; only a limit on error or time may end the render after
    /// another number of samples.
    pub fn run_inside(
        &self,
        region: Region,
        task: Task<'_>,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let samples = task.samples.unwrap_or(0..self.stop.samples);
        let watch = Stopwatch::start();
        let sums = match task.sums {
            Some(sums) => {
                self.send_shares(&sums.shares);
                sums
            }
            None => {
                let mut counts = Counts::default();
                let shares = Arc::new(self.pilot_pass(&mut counts, task.keepers));
                let mut sums = Sums::new(self.resolution, region, samples.start, shares);
                sums.add_cost(&counts, watch.spent());
                sums
            }
        };
        // The pilot pass is part of the time that the render may take.
        let left = |time: Duration| time.saturating_sub(watch.elapsed());
        let rest = Self {
            stop: Stop {
                time: self.stop.time.map(left),
                ..self.stop
            },
            ..*self
        };
        rest.run_from(sums, samples.end, task.keepers, progress)
    }

    /// Adds samples to the sums of a film up to a number or a stop condition.
    pub(super) fn run_from(
        &self,
        mut sums: Sums,
        last: u32,
        keepers: &[&dyn Keeper],
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let watch = Stopwatch::start();
        let PicturePlace { first, .. } = sums.place;
        let run = PassRun {
            last,
            before: sums.spent,
            work_before: sums.work_done(),
            watch: &watch,
            keepers,
            progress,
        };
        let mut measured = Measured::default();
        let stopped = self.run_passes(&mut sums, &run, &mut measured).err();
        sums.spent = sums.spent.plus(watch.spent());
        if sums.place.is_even() {
            for keeper in keepers {
                sums.show(&mut |snapshot| keeper.keep(snapshot));
            }
        }
        let watch = Stopwatch::start();
        let PicturePlace { region, done, .. } = sums.place;
        let is_part = first > 0 || last < self.stop.samples;
        let mut film = sums.film();
        if stopped.is_none() && !is_part && measured.samples < done {
            let last = self.measured(&film, region, done, &mut sums.counts);
            measured = last.unwrap_or(measured);
        }
        // An estimate of fewer samples is that of another picture.
        let is_even = stopped.is_none_or(|stopped| stopped.part == 0.0);
        let is_of_film = is_even && measured.samples == done;
        film.squared_error = measured.squared_error.filter(|_| is_of_film);
        Exposure {
            film,
            counts: sums.counts,
            spent: sums.spent.plus(watch.spent()),
            samples: done - first,
            stopped,
        }
    }

    /// Exposes passes until a stop condition holds.
    ///
    /// # Errors
    /// Returns where the render is if a keeper stops it.
    fn run_passes(
        &self,
        sums: &mut Sums,
        run: &PassRun<'_>,
        measured: &mut Measured,
    ) -> Result<(), Stopped> {
        let mut per_sample = Duration::ZERO;
        // A state that was kept between two passes is that of a render that had ended.
        let mut had_ended = sums.place.done == sums.place.until;
        sums.place.until = sums.place.until.min(run.last).max(sums.place.end);
        loop {
            let PicturePlace { first, done, .. } = sums.place;
            if done == sums.place.until && done > first {
                let is_due = had_ended || done >= sums.place.next_estimate;
                let mut is_cut_short = false;
                if self.stop.error.is_some() && is_due {
                    match self.measured_sums(sums) {
                        Some(estimate) => *measured = estimate,
                        None => is_cut_short = true,
                    }
                }
                let next = per_sample * self.pass_end(done).saturating_sub(done);
                if done >= run.last || self.stops(run.watch.elapsed() + next, measured.error) {
                    return Ok(());
                }
                if is_cut_short {
                    return Err(Stopped::between_passes(done - first));
                }
            }
            had_ended = false;
            if done == sums.place.until {
                sums.place.until = self.pass_end(done).min(run.last);
            }
            sums.begin();
            let start = Instant::now();
            self.expose_sums(sums, run, measured)?;
            per_sample = start.elapsed() / (sums.place.end - done).max(1);
            sums.end();
        }
    }

    /// Exposes the samples that the sums have begun.
    ///
    /// # Errors
    /// Returns where the render is if a keeper stops it.
    fn expose_sums(
        &self,
        sums: &mut Sums,
        run: &PassRun<'_>,
        measured: &Measured,
    ) -> Result<(), Stopped> {
        let last = self.expected_end(measured, sums.place.end, run.last);
        let PicturePlace {
            region,
            first,
            done,
            end,
            ..
        } = sums.place;
        let mut pixels = std::mem::take(&mut sums.last);
        let segment = Segment::new(region, done..end, &mut pixels, &sums.finished);
        let tiles = Tile::count(region);
        let samples = u64::from(end - done);
        let snapshot = || sums.snapshot(&segment, run.before.plus(run.watch.spent()));
        let proceed = |finished: u64| {
            let work_done = u64::from(done - first) * tiles + finished * samples;
            let work = u64::from(last.unwrap_or(run.last) - first) * tiles;
            let in_time = self.work_in_time(run, work_done);
            (run.progress)(Progress {
                work_done,
                work_before: run.work_before,
                work: in_time.map_or(work, |in_time| work.min(in_time)),
                work_is_known: last.is_some() || in_time.is_some(),
                elapsed: run.watch.elapsed(),
                samples: done - first,
                error: measured.error.map(|e| e.relative_rmse),
            });
            for keeper in run.keepers.iter().filter(|keeper| keeper.is_due()) {
                keeper.keep(&snapshot());
            }
            !is_stopped(run.keepers)
        };
        let may_begin = !is_stopped(run.keepers);
        let is_whole = may_begin && self.fill(&segment, &sums.shares, &proceed);
        let finished = segment.finished();
        let is_whole = is_whole || finished == tiles;
        // A render that is stopped in its pilot pass has neither samples nor shares.
        let is_blank = done == first && finished == 0;
        if !is_whole && !is_blank {
            run.keepers.iter().for_each(|k| k.keep(&snapshot()));
        }
        let counts = segment.counts();
        drop(segment);
        sums.last = pixels;
        sums.counts.add(&counts);
        match is_whole {
            true => Ok(()),
            false => Err(Stopped {
                samples: done - first,
                more: end - first,
                part: finished as f64 / tiles as f64,
            }),
        }
    }

    /// Returns the number of samples per pixel at which the render is expected to end, of at least
    /// `begun` and at most `last`. With a target the error is taken to fall with the square root of
    /// the samples; `None` before it was estimated.
    fn expected_end(&self, measured: &Measured, begun: u32, last: u32) -> Option<u32> {
        let Some(target) = self.stop.error else {
            return Some(last);
        };
        let growth = measured.error?.high / target;
        let needed = f64::from(measured.samples) * growth * growth;
        let needed = (needed as u32).min(last);
        let mut end = begun;
        while end < needed {
            end = self.pass_end(end);
        }
        Some(end.min(last))
    }

    /// Returns the work that can be done in the time of the render at the speed until now.
    fn work_in_time(&self, run: &PassRun<'_>, work_done: u64) -> Option<u64> {
        let elapsed = run.watch.elapsed().as_secs_f64().max(1e-9);
        let share = (self.stop.time?.as_secs_f64() / elapsed).max(1.0);
        let made = work_done - run.work_before;
        Some(run.work_before + (made as f64 * share) as u64)
    }

    /// Estimates the error of sums at the end of a pass. The result is `None` if the work on the
    /// scene was stopped meanwhile. The sums are then as they were, so that a later run makes the
    /// estimate and ends where one that nothing interrupts does.
    fn measured_sums(&self, sums: &mut Sums) -> Option<Measured> {
        let PicturePlace { region, done, .. } = sums.place;
        let mut counts = Counts::default();
        let measured = sums.with_film(|film| self.measured(film, region, done, &mut counts))?;
        sums.counts.add(&counts);
        sums.place.next_estimate = measured.next;
        Some(measured)
    }

    /// Estimates the error of the film of a region after a number of samples per pixel. The result
    /// is `None` if the work on the scene was stopped meanwhile.
    fn measured(
        &self,
        film: &Film,
        region: Region,
        samples: u32,
        counts: &mut Counts,
    ) -> Option<Measured> {
        let (squared_error, more) = self.measure(film, region, true);
        counts.add(&more);
        if self.shader.scene().is_stopped() {
            return None;
        }
        let error = squared_error.and_then(|e| e.relative(film.pixels.len(), film.mean()).ok());
        // The error falls with the power 3/4 of the samples at best (over edges in the plane).
        let target = self.stop.error.unwrap_or(0.0);
        let growth = error.map_or(2.0, |e| libm::pow(e.high / target, 4.0 / 3.0));
        let next = f64::from(samples) * growth.clamp(LEAST_GROWTH, 4.0);
        Some(Measured {
            squared_error,
            error,
            samples,
            next: next as u32,
        })
    }

    /// Adds samples to every pixel of a film, which is a region of the picture. After every tile,
    /// `proceed` receives the number of finished tiles; if it returns false, the pass is abandoned
    /// and the result is `None`. Some tiles of the film then have the samples and others do not.
    pub fn pass(
        &self,
        region: Region,
        film: &mut Film,
        samples: Range<u32>,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> Option<Counts> {
        film.squared_error = None;
        let segment = Segment::new(region, samples, &mut film.pixels, &[]);
        let is_whole = self.fill(&segment, &SampleShares::EVEN, proceed);
        is_whole.then(|| segment.counts())
    }

    /// Estimates the noise of each pixel for adaptive sampling from an eighth of the samples, or of
    /// the time if that is less, at least 2 and at most 16. Its rays are counted; its light is
    /// discarded (docs/decisions/0009-adaptive-sampling.md). Without time for [`PILOT_WORTH`]
    /// samples the shares are even. No search for the limit of 16 is
    /// recorded: it bounds the cost, and shares are powers of two that need no exact noise. The
    /// pass covers the whole picture, so that the shares in a region are those of the whole
    /// picture.
    pub(super) fn pilot_pass(&self, counts: &mut Counts, keepers: &[&dyn Keeper]) -> SampleShares {
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
        let most = (self.stop.samples / 8).clamp(2, 16);
        // With a limit on time, 2 samples of the first strip tell how many more there is time for.
        let mut samples = if self.stop.time.is_some() { 2 } else { most };
        let mut variances = Vec::with_capacity(self.resolution.pixels());
        let mut expose = |strip: Region, film: &mut Film, samples: Range<u32>| {
            let rays = pilot.pass(strip, film, samples, &|_| !is_stopped(keepers));
            rays.map(|rays| counts.add(&rays))
        };
        for strip in strips(Region::whole(self.resolution), PILOT_PIXELS) {
            let mut film = Film::new(strip.resolution());
            let start = Instant::now();
            let mut exposed = expose(strip, &mut film, 0..samples);
            if let Some(limit) = self.stop.time
                && variances.is_empty()
                && exposed.is_some()
            {
                let part = film.pixels.len() as f64 / self.resolution.pixels() as f64;
                let of_sample = start.elapsed().as_secs_f64() / (f64::from(samples) * part);
                let affordable = limit.as_secs_f64() / of_sample;
                if affordable < PILOT_WORTH {
                    return SampleShares::EVEN;
                }
                let affordable = (affordable / 8.0) as u32;
                let more = samples..affordable.clamp(samples, most);
                samples = more.end;
                if !more.is_empty() {
                    exposed = expose(strip, &mut film, more);
                }
            }
            if exposed.is_none() {
                return SampleShares::EVEN; // No sample of the picture will follow.
            }
            variances.extend(film.pixels.iter().map(SampleShares::variance));
        }
        let shares = SampleShares::of(&variances, self.resolution, self.stop.samples);
        self.send_shares(&shares);
        shares
    }

    /// Exposes the open tiles of a segment, with each pixel's share of the samples. Returns false
    /// if `proceed` did, which receives the number of finished tiles.
    fn fill(
        &self,
        segment: &Segment<'_>,
        shares: &SampleShares,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> bool {
        if let Some(team) = self.team {
            return self.fill_by_team(team, segment, shares, proceed);
        }
        let some = |batch: &mut Batch<'_>, tiles: &[Tile]| {
            let mut sums: Vec<Exposed> = tiles.iter().flat_map(|t| segment.pixels(*t)).collect();
            let counts = batch.expose(tiles, &mut sums, &segment.samples, shares);
            if self.shader.scene().is_stopped() {
                return false; // Rays may have been abandoned.
            }
            proceed(segment.finish(tiles, &sums, &counts))
        };
        let at_once = self.tiles_at_once(&segment.samples);
        let rows = segment.open_tiles().into_par_iter();
        rows.all(|tiles| {
            let parts = tiles.par_chunks(at_once);
            let goes_on = parts.map_init(|| Batch::new(self), some);
            goes_on.all(|goes_on| goes_on)
        })
    }

    /// Returns the number of tiles that a thread exposes at once: as many as fill a batch if pixels
    /// get few samples.
    pub(super) fn tiles_at_once(&self, samples: &Range<u32>) -> usize {
        let of_tile = Tile::PIXELS * samples.len().max(1);
        (self.camera.batch() / of_tile).max(1)
    }

    /// Returns the number of samples after the next pass. With a limit on error or time, it doubles
    /// with every pass, and grows by at most a unit: from 4, or with a limit on time from 1, so
    /// that the first pass reaches the whole picture soon. Without a limit, it doubles from
    /// 64, so that a render that is interrupted has some samples of the whole picture.
    fn pass_end(&self, done: u32) -> u32 {
        let unit = border_after(done) - border_before(done);
        let [least, most] = match self.stop {
            Stop { time: Some(_), .. } => [1, unit],
            Stop { error: Some(_), .. } => [4, unit],
            _ => [unit, LONGEST_PASS.max(unit)],
        };
        let step = done.clamp(least, most);
        let step = step.next_multiple_of(self.sampler.period());
        (done + step).min(self.stop.samples)
    }

    /// Returns whether the render stops before the next pass, which is expected to end at a time
    /// after the start. A target is met only if the upper end of the error's interval meets it.
    fn stops(&self, end: Duration, error: Option<ErrorEstimate>) -> bool {
        let target = self.stop.error.zip(error);
        let good = target.is_some_and(|(limit, e)| e.high <= limit);
        let late = self.stop.time.is_some_and(|limit| end > limit);
        good || late
    }

    /// Returns the samples of one pixel.
    pub(super) fn pixel(&self, sampler: Sampler, (x, y): (u32, u32)) -> PixelSampler {
        let number = u64::from(y * self.resolution.width + x);
        sampler.pixel(number, [x, y])
    }

    /// Returns the exposure of one sample of a pixel, traced by itself with the bits that it has in
    /// a tile. A lost ray has exposure 0 and is a sample like any other.
    pub fn sample(
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
