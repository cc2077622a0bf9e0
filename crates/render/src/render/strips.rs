//! Renders a picture whose film does not fit into memory, in strips of whole rows of tiles.
//!
//! A strip gets all its samples and is then handed over. Its pixels have the bits that they have in
//! a render of the whole picture. Its error is measured as that of a whole picture is; the strips
//! have no pixel in common, so their squared errors and the variances of those add up.

use std::sync::Arc;
use std::time::Instant;

use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Film, Region, SquaredError};

use super::exposure::{Counts, Progress};
use super::pairs::LightWatch;
use super::passes::Render;
use super::shares::SampleShares;
use super::sums::Sums;
use super::tile::{Tile, strips};

/// A render in strips, from the top.
pub struct Strips<'a> {
    render: &'a Render<'a>,
    shares: Arc<SampleShares>,
    left: Box<dyn Iterator<Item = Region>>,
    lights: LightWatch,
    /// The work of the finished strips, and of the picture, as in [`Progress`].
    work: (u64, u64),
    /// When the first strip was begun.
    start: Instant,
    sums: StripSums,
}

/// What is known of the strips that are finished.
#[derive(Clone, Debug, Default)]
pub struct StripSums {
    /// The rays that were traced.
    pub counts: Counts,
    /// The number of pixels.
    pixels: usize,
    /// The sum of all channels of all pixels.
    levels: f64,
    /// The estimated error of each strip's pixels, added up; `None` if one is unknown.
    squared_error: Option<SquaredError>,
}

impl StripSums {
    /// Returns the sums of a picture to which no ray can bring light.
    pub fn unexposed() -> Self {
        Self {
            squared_error: Some(SquaredError::none()),
            ..Self::default()
        }
    }

    /// Returns the estimated error of the finished strips.
    ///
    /// # Errors
    /// Returns the reason if the error is unknown.
    pub fn error(&self) -> Result<ErrorEstimate, ErrorUnknown> {
        let error = self.squared_error.ok_or(ErrorUnknown::NotMeasured)?;
        error.relative(self.pixels, self.levels / (3.0 * self.pixels as f64))
    }

    fn add(&mut self, film: &Film) {
        self.squared_error = match (self.pixels, self.squared_error, film.squared_error) {
            (0, _, error) => error,
            (_, Some(sum), Some(error)) => Some(sum.with_part(&error)),
            _ => None,
        };
        self.pixels += film.pixels.len();
        self.levels += film.sum();
    }
}

impl<'a> Strips<'a> {
    /// Starts a render of a region of the picture in strips of at most a number of pixels. The
    /// pilot pass of adaptive sampling is part of the start. There must be no limit on error or
    /// time, because strips are finished one after another.
    pub fn new(render: &'a Render<'a>, region: Region, most_pixels: usize) -> Self {
        let mut sums = StripSums::default();
        Self {
            render,
            shares: Arc::new(render.pilot_pass(&mut sums.counts, &[])),
            left: Box::new(strips(region, most_pixels)),
            lights: LightWatch::new(render, 1),
            work: (0, work(render, region)),
            start: Instant::now(),
            sums,
        }
    }

    /// Renders the next strip; `None` after the last one. Uses rayon's current pool.
    pub fn next(&mut self, progress: &(dyn Fn(Progress) + Sync)) -> Option<Film> {
        let strip = self.left.next()?;
        let (start, (done, whole)) = (self.start, self.work);
        let report = |inside: Progress| {
            progress(Progress {
                work_done: done + inside.work_done,
                work_before: 0,
                work: whole,
                elapsed: start.elapsed(),
                ..inside
            });
        };
        let render = self.render;
        let sums = Sums::new(render.resolution, strip, 0, self.shares.clone());
        let exposure = render.run_from(sums, render.stop.samples, &[], &report);
        self.work.0 += work(render, strip);
        self.sums.counts.add(&exposure.counts);
        self.lights.look(&exposure.film, strip);
        self.sums.add(&exposure.film);
        Some(exposure.film)
    }

    /// Returns the sums of the finished strips.
    pub fn sums(&self) -> StripSums {
        let mut sums = self.sums.clone();
        if let Some(error) = &mut sums.squared_error {
            // A light may be in one strip and have its place in the next.
            error.missed = self.lights.missed();
        }
        sums
    }
}

/// Returns the work of a region, as in [`Progress`].
fn work(render: &Render<'_>, region: Region) -> u64 {
    Tile::count(region) * u64::from(render.stop.samples)
}
