//! The stop conditions, the progress and the result of a render.

use std::time::Duration;

use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Exposed, Film, Resolution, SquaredError};
use serde::{Deserialize, Serialize};

use super::stopwatch::Spent;

/// The conditions that end a render. The first one met ends it, after a whole pass, so that every
/// pixel has received its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The largest number of samples per pixel.
    pub samples: u32,
    /// The render stops when the upper end of the 95% interval of its relative RMSE is at most
    /// this.
    pub error: Option<f64>,
    /// The render stops before a pass that would end later than this after the start.
    pub time: Option<Duration>,
}

impl Stop {
    /// Returns the condition that stops after a number of samples per pixel.
    pub fn after(samples: u32) -> Self {
        Self {
            samples,
            error: None,
            time: None,
        }
    }
}

/// The progress of a running render.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// The finished work, in samples of a tile's pixels.
    pub work_done: u64,
    /// The part of it that earlier runs did.
    pub work_before: u64,
    /// The whole work that is expected, by the samples, the time, and the last estimate of the
    /// error.
    pub work: u64,
    /// Whether the end is known. With a target error it is unknown before the first estimate, and
    /// the work is that of the largest number of samples.
    pub work_is_known: bool,
    /// The time that this run has exposed samples.
    pub elapsed: Duration,
    /// Samples that all pixels have.
    pub samples: u32,
    /// The last estimate of the relative RMSE.
    pub error: Option<f64>,
}

impl Progress {
    /// Returns the finished part of the expected work, if that is known.
    pub fn part(&self) -> Option<f64> {
        let part = self.work_done as f64 / self.work.max(1) as f64;
        self.work_is_known.then_some(part)
    }

    /// Returns the expected seconds to the end, by the speed of this run; `None` if the end is
    /// unknown or this run has done nothing.
    pub fn seconds_left(&self) -> Option<f64> {
        let made = self.work_done.saturating_sub(self.work_before);
        let left = self.work.saturating_sub(self.work_done);
        let is_known = self.work_is_known && made > 0;
        is_known.then(|| self.elapsed.as_secs_f64() * left as f64 / made as f64)
    }
}

/// The result of a render.
#[derive(Debug)]
pub struct Exposure {
    /// The exposed film.
    pub film: Film,
    /// The rays that were traced.
    pub counts: Counts,
    /// The time that the render took.
    pub spent: Spent,
    /// Samples per pixel.
    pub samples: u32,
    /// Where the render was stopped, if it was before its end.
    pub stopped: Option<Stopped>,
}

/// Where a render was stopped before its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopped {
    /// The number of samples that all pixels have.
    pub samples: u32,
    /// The number of samples that some pixels have.
    pub more: u32,
    /// The part of the tiles that have `more`.
    pub part: f64,
}

impl Stopped {
    /// Where a render with a number of samples per pixel was stopped while its ghosts were made.
    pub fn before_ghosts(samples: u32) -> Self {
        Self {
            samples,
            more: samples,
            part: 1.0,
        }
    }

    /// Where a render with a number of samples per pixel was stopped while its error was estimated.
    pub fn between_passes(samples: u32) -> Self {
        Self {
            samples,
            more: samples,
            part: 0.0,
        }
    }

    /// Describes where the render was stopped, of a number of samples.
    pub fn describe(&self, all: u32) -> String {
        let Self {
            samples,
            more,
            part,
        } = self;
        let part = 100.0 * part;
        match samples {
            samples if samples == more && self.part == 0.0 => {
                format!("it has {samples} of {all} samples per pixel")
            }
            samples if samples == more => {
                format!("it has {samples} samples per pixel, and no ghosts")
            }
            0 => format!("{part:.0}% of the picture has {more} of {all} samples per pixel"),
            _ => format!(
                "{samples} of {all} samples per pixel, and {more} in {part:.0}% of the picture"
            ),
        }
    }
}

/// What is reported of a render, besides its film.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The rays that were traced.
    pub counts: Counts,
    /// The seconds that the render took, and those of processors if the system says.
    pub spent: Spent,
    /// Samples per pixel.
    pub samples: u32,
    /// The estimated error of the picture.
    pub error: Result<ErrorEstimate, ErrorUnknown>,
}

impl Exposure {
    /// Returns what is reported of the render.
    pub fn summary(&self) -> Summary {
        Summary {
            counts: self.counts,
            spent: self.spent,
            samples: self.samples,
            error: self.film.error(),
        }
    }

    /// Returns the exposure of a film to which no ray can bring light: all its samples are black.
    pub fn without_light(resolution: Resolution, samples: u32) -> Self {
        let black = vec![Exposed::black(samples); resolution.pixels()];
        let mut film = Film::of_pixels(resolution, black);
        film.squared_error = Some(SquaredError::none());
        Self {
            film,
            counts: Counts::default(),
            spent: Spent::default(),
            samples,
            stopped: None,
        }
    }

    /// Returns whether the render was stopped before any pixel had a sample.
    pub fn is_blank(&self) -> bool {
        self.stopped
            .is_some_and(|stopped| stopped.samples == 0 && stopped.part == 0.0)
    }

    /// Adds an exposure of the same film at another moment, which gets a share of the sum.
    pub fn join(&mut self, part: &Self, share: f64) {
        self.film.join(&part.film, share);
        self.counts.add(&part.counts);
        self.spent = self.spent.plus(part.spent);
        self.samples += part.samples;
    }
}

/// Numbers of rays that a render traced.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Counts {
    /// Rays that left the film for the picture, one for each sample. A resampled ray is counted
    /// once, and further wavelengths are not counted.
    pub film_rays: u64,
    /// Those of them that passed through the lens.
    pub passed: u64,
    /// Rays traced through the scene for the picture: from the camera, reflected, and refracted.
    pub scene_rays: u64,
    /// Rays toward lights for the picture.
    pub shadow_rays: u64,
    /// Rays that left the film for the error estimate and are not part of the picture.
    pub error_rays: u64,
}

impl Counts {
    /// Adds the counts of another part.
    pub fn add(&mut self, other: &Self) {
        self.film_rays += other.film_rays;
        self.passed += other.passed;
        self.scene_rays += other.scene_rays;
        self.shadow_rays += other.shadow_rays;
        self.error_rays += other.error_rays;
    }

    /// Returns the sum of these counts and those of another part.
    pub(super) fn plus(mut self, other: &Self) -> Self {
        self.add(other);
        self
    }

    /// Returns the counts in the order of the fields.
    pub(super) fn to_array(self) -> [u64; 5] {
        let Self {
            film_rays,
            passed,
            scene_rays,
            shadow_rays,
            error_rays,
        } = self;
        [film_rays, passed, scene_rays, shadow_rays, error_rays]
    }

    /// Returns the counts that [`Counts::to_array`] has returned.
    pub(super) fn from_array(counts: [u64; 5]) -> Self {
        let [film_rays, passed, scene_rays, shadow_rays, error_rays] = counts;
        Self {
            film_rays,
            passed,
            scene_rays,
            shadow_rays,
            error_rays,
        }
    }

    /// Returns the share of the film's rays that passed through the lens.
    pub fn passed_share(&self) -> f64 {
        self.passed as f64 / self.film_rays.max(1) as f64
    }
}
