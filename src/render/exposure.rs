//! When a render stops, how far it is, and what it made.

use std::time::Duration;

use crate::film::Film;

/// When to stop. Whole passes are made, so that a picture is even.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Samples a pixel at most.
    pub samples: u32,
    /// Stop when the estimated relative RMSE is at most this.
    pub error: Option<f64>,
    /// Stop before a pass that would end later than this.
    pub time: Option<Duration>,
}

impl Stop {
    pub fn after(samples: u32) -> Self {
        Self {
            samples,
            error: None,
            time: None,
        }
    }
}

/// How far a render has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    pub tiles_done: u64,
    /// Of all the passes known to come.
    pub tiles: u64,
    /// Samples a pixel in the passes that are whole.
    pub samples: u32,
    /// Estimated relative RMSE after the last whole pass.
    pub error: Option<f64>,
}

/// What a render made.
#[derive(Debug)]
pub struct Exposure {
    pub film: Film,
    pub counts: Counts,
    pub seconds: f64,
    /// Samples a pixel.
    pub samples: u32,
}

impl Exposure {
    /// Adds a part made with other samples, or at another moment.
    pub(crate) fn join(&mut self, part: &Self) {
        let all = f64::from(self.samples + part.samples).max(1.0);
        self.film.join(&part.film, f64::from(part.samples) / all);
        self.counts.add(&part.counts);
        self.seconds += part.seconds;
        self.samples += part.samples;
    }
}

/// Rays of a render.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Rays that left the film. One that is drawn anew for another is not counted.
    pub film_rays: u64,
    /// Of those, the ones that the lens let through.
    pub passed: u64,
    /// Rays followed through the scene: from the camera, mirrored, and refracted.
    pub scene_rays: u64,
    /// Rays towards lights.
    pub shadow_rays: u64,
    /// Of the rays from the film, those that are not in the picture but tell its error.
    pub error_rays: u64,
}

impl Counts {
    pub(crate) fn add(&mut self, other: &Self) {
        self.film_rays += other.film_rays;
        self.passed += other.passed;
        self.scene_rays += other.scene_rays;
        self.shadow_rays += other.shadow_rays;
        self.error_rays += other.error_rays;
    }

    /// Share of lens rays that got through.
    pub fn passed_share(&self) -> f64 {
        self.passed as f64 / (self.film_rays + self.error_rays).max(1) as f64
    }
}
