//! Renders a picture whose film does not fit into memory, in strips of whole rows of tiles.
//!
//! A strip gets all its samples and is then handed over. Its pixels have the bits that they have in
//! a render of the whole picture. Its error is measured as that of a whole picture is; the strips
//! have no pixel in common, so their squared errors and the variances of those add up.

use super::exposure::{Counts, Progress};
use super::pairs::LightWatch;
use super::passes::Render;
use super::shares::SampleShares;
use super::tile::{Tile, strips};
use crate::film::{ErrorEstimate, ErrorUnknown, Film, Region, SquaredError};

/// A render in strips, from the top.
pub(crate) struct Strips<'a> {
    render: &'a Render<'a>,
    shares: SampleShares,
    left: Box<dyn Iterator<Item = Region>>,
    lights: LightWatch,
    /// The tiles of the finished strips, and of the picture.
    tiles: (u64, u64),
    sums: StripSums,
}

/// What is known of the strips that are finished.
#[derive(Clone, Debug, Default)]
pub(crate) struct StripSums {
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
    pub(crate) fn unexposed() -> Self {
        Self {
            squared_error: Some(SquaredError::none()),
            ..Self::default()
        }
    }

    /// Returns the estimated error of the finished strips.
    ///
    /// # Errors
    /// Returns the reason if the error is unknown.
    pub(crate) fn error(&self) -> Result<ErrorEstimate, ErrorUnknown> {
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
        self.levels += 3.0 * film.mean() * film.pixels.len() as f64;
    }
}

impl<'a> Strips<'a> {
    /// Starts a render of a region of the picture in strips of at most a number of pixels. The
    /// pilot pass of adaptive sampling is part of the start. There must be no limit on error or
    /// time, because strips are finished one after another.
    pub(crate) fn new(render: &'a Render<'a>, region: Region, most_pixels: usize) -> Self {
        let mut sums = StripSums::default();
        Self {
            render,
            shares: render.pilot_pass(&mut sums.counts),
            left: Box::new(strips(region, most_pixels)),
            lights: LightWatch::new(render, 1),
            tiles: (0, Tile::count(region)),
            sums,
        }
    }

    /// Renders the next strip; `None` after the last one. Uses rayon's current pool.
    pub(crate) fn next(&mut self, progress: &(dyn Fn(Progress) + Sync)) -> Option<Film> {
        let strip = self.left.next()?;
        let (done, tiles) = self.tiles;
        let report = |inside: Progress| {
            progress(Progress {
                tiles_done: done + inside.tiles_done,
                tiles,
                ..inside
            });
        };
        let exposure = self.render.run_shared(strip, &self.shares, &report);
        self.tiles.0 += Tile::count(strip);
        self.sums.counts.add(&exposure.counts);
        self.lights.look(&exposure.film, strip);
        self.sums.add(&exposure.film);
        Some(exposure.film)
    }

    /// Returns the sums of the finished strips.
    pub(crate) fn sums(&self) -> StripSums {
        let mut sums = self.sums.clone();
        if let Some(error) = &mut sums.squared_error {
            // A light may be in one strip and have its place in the next.
            error.missed = self.lights.missed();
        }
        sums
    }
}
