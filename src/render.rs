//! Tiles, threads, passes: drives camera and shader until the film is exposed.
//!
//! A pixel's samples are added in the order of their numbers by one thread, and a sample is a
//! function of seed, pixel and number, so a picture has the same bits at any number of threads.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::camera::Camera;
use crate::film::{Exposed, Film, Resolution};
use crate::sampling::Sampler;
use crate::scene::Ray;
use crate::shade::Shader;

/// Pixels on a side of a tile: enough to share out, few enough to stay in the cache.
const TILE: u32 = 16;

/// A part of the picture: pixels `x0..x1`, `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl Tile {
    /// All tiles of a picture, row by row.
    pub fn all(resolution: Resolution) -> Vec<Self> {
        let Resolution { width, height } = resolution;
        let rows = (0..height).step_by(TILE as usize);
        rows.flat_map(|y0| {
            (0..width).step_by(TILE as usize).map(move |x0| Self {
                x0,
                y0,
                x1: (x0 + TILE).min(width),
                y1: (y0 + TILE).min(height),
            })
        })
        .collect()
    }

    fn pixels(self) -> impl Iterator<Item = (u32, u32)> {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| (x, y)))
    }
}

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
    pub fn join(&mut self, part: &Self) {
        self.film.join(&part.film);
        self.counts.add(&part.counts);
        self.seconds += part.seconds;
        self.samples += part.samples;
    }
}

/// Rays of a render.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Rays that left the film.
    pub film_rays: u64,
    /// Of those, the ones that the lens let through.
    pub passed: u64,
}

impl Counts {
    fn add(&mut self, other: &Self) {
        self.film_rays += other.film_rays;
        self.passed += other.passed;
    }

    /// Share of lens rays that got through.
    pub fn passed_share(&self) -> f64 {
        self.passed as f64 / self.film_rays.max(1) as f64
    }
}

/// A scene, a camera, and what to do with them.
pub struct Render<'a> {
    pub shader: &'a Shader<'a>,
    pub camera: &'a Camera,
    pub sampler: Sampler,
    pub resolution: Resolution,
    /// A multiplier on the exposure.
    pub exposure: f64,
    pub stop: Stop,
}

impl Render<'_> {
    /// Exposes the film, telling `progress` after every tile. Uses rayon's current pool.
    pub fn run(&self, progress: &(dyn Fn(Progress) + Sync)) -> Exposure {
        let start = Instant::now();
        let tiles = Tile::all(self.resolution);
        let mut film = Film::new(self.resolution);
        let mut counts = Counts::default();
        let mut done = 0;
        let mut error = None;
        while done < self.stop.samples {
            let pass_start = Instant::now();
            let end = self.pass_end(done);
            let total = tiles.len() as u64 * self.passes_left(done);
            let finished = Mutex::new(0);
            let parts: Vec<(Vec<Exposed>, Counts)> = tiles
                .par_iter()
                .map(|&tile| {
                    let part = self.expose(tile, &film, done..end);
                    let mut finished = finished.lock().unwrap_or_else(|e| e.into_inner());
                    *finished += 1;
                    progress(Progress {
                        tiles_done: *finished,
                        tiles: total,
                        samples: done,
                        error,
                    });
                    part
                })
                .collect();
            for (tile, (pixels, part)) in tiles.iter().zip(parts) {
                counts.add(&part);
                for ((x, y), exposed) in tile.pixels().zip(pixels) {
                    film.pixels[(y * self.resolution.width + x) as usize] = exposed;
                }
            }
            done = end;
            error = film.relative_rmse();
            if self.stops(start, pass_start.elapsed(), error) {
                break;
            }
        }
        Exposure {
            film,
            counts,
            seconds: start.elapsed().as_secs_f64(),
            samples: done,
        }
    }

    /// With nothing but a number of samples to stop at, all are one pass; else passes double.
    fn pass_end(&self, done: u32) -> u32 {
        if self.stop.error.is_none() && self.stop.time.is_none() {
            return self.stop.samples;
        }
        let step = if done == 0 { 4 } else { done.min(64) };
        (done + step).min(self.stop.samples)
    }

    fn passes_left(&self, done: u32) -> u64 {
        u64::from(
            (self.stop.samples - done)
                .div_ceil(self.pass_end(done).max(1) - done)
                .max(1),
        )
    }

    fn stops(&self, start: Instant, last_pass: Duration, error: Option<f64>) -> bool {
        let good = self
            .stop
            .error
            .zip(error)
            .is_some_and(|(limit, e)| e <= limit);
        let late = self
            .stop
            .time
            .is_some_and(|limit| start.elapsed() + last_pass > limit);
        good || late
    }

    /// Adds samples to the pixels of one tile.
    fn expose(
        &self,
        tile: Tile,
        film: &Film,
        samples: std::ops::Range<u32>,
    ) -> (Vec<Exposed>, Counts) {
        let mut counts = Counts::default();
        let pixels = tile
            .pixels()
            .map(|(x, y)| {
                let number = y * self.resolution.width + x;
                let mut exposed = film.pixels[number as usize];
                for index in samples.clone() {
                    exposed.add(self.sample((x, y), u64::from(number), index, &mut counts));
                }
                exposed
            })
            .collect();
        (pixels, counts)
    }

    /// The exposure that one ray brings; a lost ray brings none and counts all the same.
    fn sample(
        &self,
        (x, y): (u32, u32),
        number: u64,
        index: u32,
        counts: &mut Counts,
    ) -> glam::DVec3 {
        let at = self.sampler.sample(number, index);
        let u = (f64::from(x) + at.film[0]) / f64::from(self.resolution.width);
        let v = (f64::from(y) + at.film[1]) / f64::from(self.resolution.height);
        counts.film_rays += 1;
        let Some(ray) = self.camera.at(u, v).ray(at.pupil) else {
            return glam::DVec3::ZERO;
        };
        counts.passed += 1;
        let ray_in = Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3());
        let radiance = self.shader.radiance(&ray_in, &mut || 0.0);
        radiance.as_dvec3() * (ray.weight * self.exposure)
    }
}
