//! Pictures whose film does not fit into memory: they are rendered and written strip by strip.

use std::borrow::Cow;

use ivcam_base::diag::Result;
use ivcam_optics::film::{Film, Resolution};
use ivcam_optics::picture::{Heading, Picture, ROWS, RowSource};
use ivcam_render::render::report::stated_error;
use ivcam_render::render::{Progress, Stopwatch, StripSums, Strips, Summary};

use super::memory::strip_pixels;
use super::session::Session;

/// The largest number of pixels that are kept to look for a black or a clipped picture.
const KEPT: usize = 1 << 16;

/// A render in strips, as the source of a picture's rows.
struct StripRows<'a> {
    /// `None` if no ray can bring light.
    strips: Option<Strips<'a>>,
    progress: &'a (dyn Fn(Progress) + Sync),
    size: Resolution,
    /// The rows that were returned.
    rows: u32,
    /// One of `step` pixels is kept.
    step: usize,
    kept: Vec<[f32; 3]>,
}

/// The result of a render in strips.
pub(crate) struct StripRender {
    pub summary: Summary,
    /// A part of the picture's pixels, evenly spread.
    pub sample: Picture,
}

impl Session {
    /// Returns whether the film does not fit into the plan's memory and is rendered in strips.
    pub(crate) fn is_in_strips(&self) -> bool {
        strip_pixels(&self.plan).is_some()
    }

    /// Renders the picture in strips. `write` writes the rows while they are made. Uses rayon's
    /// current pool.
    ///
    /// # Errors
    /// Returns the error of `write`.
    pub(crate) fn expose_in_strips(
        &self,
        command: &str,
        progress: &(dyn Fn(Progress) + Sync),
        write: impl FnOnce(&Heading, &mut dyn RowSource) -> Result<()>,
    ) -> Result<StripRender> {
        let watch = Stopwatch::start();
        let (region, plan) = (self.region(), &self.plan);
        let size = region.resolution();
        let late = "ivcam:error";
        let mut provenance = self.provenance(command, plan.stop.samples, "");
        provenance.shift_remove(late);
        let heading = Heading {
            resolution: size,
            response: plan.response.clone(),
            provenance,
            late: Some(late),
        };
        let most = strip_pixels(plan).unwrap_or(usize::MAX);
        self.with_render(plan.pixel_sampler(), plan.stop, |render| {
            let mut rows = StripRows {
                strips: (!self.shows_nothing()).then(|| Strips::new(render, region, most)),
                progress,
                size,
                rows: 0,
                step: size.pixels().div_ceil(KEPT),
                kept: Vec::new(),
            };
            write(&heading, &mut rows)?;
            let sums = rows.sums();
            Ok(StripRender {
                summary: Summary {
                    counts: sums.counts,
                    spent: watch.spent(),
                    samples: plan.stop.samples,
                    error: sums.error(),
                },
                sample: Picture {
                    width: rows.kept.len() as u32,
                    height: 1,
                    pixels: rows.kept,
                    response: plan.response.clone(),
                    provenance: Default::default(),
                },
            })
        })
    }
}

impl StripRows<'_> {
    /// Returns the sums of the finished strips.
    fn sums(&self) -> StripSums {
        match &self.strips {
            Some(strips) => strips.sums(),
            None => StripSums::unexposed(),
        }
    }

    /// Returns the next film, or `None` after the last row.
    fn next_film(&mut self) -> Option<Film> {
        match &mut self.strips {
            Some(strips) => strips.next(self.progress),
            None if self.rows < self.size.height => Some(Film::new(Resolution {
                height: ROWS.min(self.size.height - self.rows),
                ..self.size
            })),
            None => None,
        }
    }
}

impl RowSource for StripRows<'_> {
    fn next_rows(&mut self) -> std::io::Result<Option<Cow<'_, [[f32; 3]]>>> {
        let Some(film) = self.next_film() else {
            return Ok(None);
        };
        let before = self.rows as usize * self.size.width as usize;
        self.rows += film.resolution.height;
        let pixels = film.into_levels();
        let first = before.next_multiple_of(self.step) - before;
        self.kept
            .extend(pixels.iter().skip(first).step_by(self.step));
        Ok(Some(Cow::Owned(pixels)))
    }

    fn late(&self) -> String {
        stated_error(self.sums().error())
    }
}
