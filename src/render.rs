//! Tiles, threads, passes: drives camera and shader until the film is exposed.
//!
//! A pixel's samples are added in the order of their numbers by one thread, and a sample is a
//! function of seed, pixel and number, so a picture has the same bits at any number of threads.
//! A tile's rays go through the lens a bundle at a time; that is no other arithmetic than one by
//! one, so [`Render::sample`] is what a test can hold a tile against.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::camera::{Asked, Camera, CameraRay};
use crate::film::{Exposed, Film, Resolution, Twin};
use crate::lens::Bundle;
use crate::sampling::{LensSample, Sampler, mix};
use crate::scene::Ray;
use crate::shade::{Shader, Work};

/// Pixels on a side of a tile: enough to share out, few enough to stay in the cache.
const TILE: u32 = 8;

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
    /// Rays followed through the scene: from the camera, mirrored, and refracted.
    pub scene_rays: u64,
    /// Rays towards lights.
    pub shadow_rays: u64,
    /// Of the rays from the film, those that are not in the picture but tell its error.
    pub error_rays: u64,
}

impl Counts {
    pub fn add(&mut self, other: &Self) {
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
            let tell = |tiles_done: u64| {
                progress(Progress {
                    tiles_done,
                    tiles: total,
                    samples: done,
                    error,
                });
                true
            };
            if let Some(pass) = self.pass(&tiles, &mut film, done..end, &tell) {
                counts.add(&pass);
            }
            done = end;
            error = film.error().map(|e| e.relative_rmse);
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

    /// Adds samples to every pixel. `goes_on` hears after every tile how many are done, and may
    /// end the pass: the film is then as it was, and there are no counts.
    pub fn pass(
        &self,
        tiles: &[Tile],
        film: &mut Film,
        samples: std::ops::Range<u32>,
        goes_on: &(dyn Fn(u64) -> bool + Sync),
    ) -> Option<Counts> {
        let finished = Mutex::new(0);
        let one = |&tile: &Tile| {
            let part = self.expose(tile, film, samples.clone());
            let mut finished = finished.lock().unwrap_or_else(|e| e.into_inner());
            *finished += 1;
            goes_on(*finished).then_some(part)
        };
        let parts: Option<Vec<Part>> = tiles.par_iter().map(one).collect();
        let mut counts = Counts::default();
        let mut twins = Vec::new();
        for (tile, part) in tiles.iter().zip(parts?) {
            counts.add(&part.counts);
            for ((x, y), exposed) in tile.pixels().zip(part.pixels) {
                film.pixels[(y * self.resolution.width + x) as usize] = exposed;
            }
            twins.extend(part.twins);
        }
        film.set_twins(twins);
        Some(counts)
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

    /// Adds samples to the pixels of one tile, and to the twins of those that have one.
    fn expose(&self, tile: Tile, film: &Film, samples: std::ops::Range<u32>) -> Part {
        let mut batch = Batch::new(self);
        let mut part = Part::default();
        let mut sums: Vec<Exposed> = Vec::new();
        let mut twins = Vec::new();
        for (x, y) in tile.pixels() {
            let number = y * self.resolution.width + x;
            sums.push(film.pixels[number as usize]);
            batch.add((x, y), self.sampler, samples.clone(), &mut sums);
            if film.has_twin(number) {
                twins.push((number, sums.len()));
                sums.push(film.twin(number));
                let before = batch.counts.film_rays;
                batch.add((x, y), self.twin_sampler(), samples.clone(), &mut sums);
                part.counts.error_rays += batch.counts.film_rays - before;
            }
        }
        batch.flush(&mut sums);
        part.counts.film_rays = batch.counts.film_rays - part.counts.error_rays;
        part.counts.passed = batch.counts.passed;
        part.counts.scene_rays = batch.work.counts.scene;
        part.counts.shadow_rays = batch.work.counts.shadow;
        let mut skip = twins.iter().map(|(_, at)| *at).peekable();
        part.pixels = sums
            .iter()
            .enumerate()
            .filter(|(i, _)| skip.next_if_eq(i).is_none())
            .map(|(_, sum)| *sum)
            .collect();
        let twin = |(pixel, at): (u32, usize)| Twin {
            pixel,
            exposed: sums[at],
        };
        part.twins = twins.into_iter().map(twin).collect();
        part
    }

    fn twin_sampler(&self) -> Sampler {
        Sampler {
            seed: mix(!self.sampler.seed),
            ..self.sampler
        }
    }

    fn ask(&self, (x, y): (u32, u32), sampler: Sampler, index: u32) -> Asked {
        let number = u64::from(y * self.resolution.width + x);
        let at: LensSample = sampler.sample(number, index);
        let wavelength = match self.camera.rays_each() {
            1 => 0.0,
            _ => sampler.wavelength(number, index),
        };
        Asked {
            x: (f64::from(x) + at.film[0]) / f64::from(self.resolution.width),
            y: (f64::from(y) + at.film[1]) / f64::from(self.resolution.height),
            pupil: at.pupil,
            wavelength,
        }
    }

    fn exposure_of(
        &self,
        asked: &Asked,
        rays: &[Option<CameraRay>],
        work: &mut Work,
    ) -> glam::DVec3 {
        let radiance = |ray: &CameraRay| self.shader.radiance(&scene_ray(ray), work).as_dvec3();
        self.camera.exposure(asked, rays, radiance) * self.exposure
    }

    /// The exposure that one sample of a pixel brings, by itself: what a tile must give too. A
    /// lost ray brings none and counts all the same.
    pub fn sample(&self, pixel: (u32, u32), index: u32, work: &mut Work) -> glam::DVec3 {
        let asked = self.ask(pixel, self.sampler, index);
        let rays = self.camera.at(asked.x, asked.y).rays(&asked);
        self.exposure_of(&asked, &rays, work)
    }
}

/// What a tile gives back.
#[derive(Default)]
struct Part {
    pixels: Vec<Exposed>,
    twins: Vec<Twin>,
    counts: Counts,
}

/// Samples of a tile on their way, a batch at a time.
struct Batch<'a> {
    render: &'a Render<'a>,
    /// What is asked for, and the sum that it adds to.
    asked: Vec<Asked>,
    slots: Vec<usize>,
    /// As many as fit.
    size: usize,
    /// Rays of a sample.
    each: usize,
    bundle: Bundle,
    rays: Vec<Option<CameraRay>>,
    work: Work,
    counts: Counts,
}

impl<'a> Batch<'a> {
    fn new(render: &'a Render<'a>) -> Self {
        let (size, each) = (render.camera.batch(), render.camera.rays_each());
        Self {
            render,
            asked: Vec::with_capacity(size),
            slots: Vec::with_capacity(size),
            size,
            each,
            bundle: Bundle::default(),
            rays: vec![None; size * each],
            work: Work::default(),
            counts: Counts::default(),
        }
    }

    /// Asks for samples of a pixel, which add to the last of the sums.
    fn add(
        &mut self,
        at: (u32, u32),
        sampler: Sampler,
        samples: std::ops::Range<u32>,
        sums: &mut [Exposed],
    ) {
        self.counts.film_rays += u64::from(samples.end - samples.start) * self.each as u64;
        for index in samples {
            self.asked.push(self.render.ask(at, sampler, index));
            self.slots.push(sums.len() - 1);
            if self.asked.len() == self.size {
                self.flush(sums);
            }
        }
    }

    /// Traces what was asked for, in order.
    fn flush(&mut self, sums: &mut [Exposed]) {
        let camera = self.render.camera;
        camera.rays(&self.asked, &mut self.bundle, &mut self.rays);
        let samples = self.asked.iter().zip(self.rays.chunks(self.each));
        for (slot, (asked, rays)) in self.slots.iter().zip(samples) {
            self.counts.passed += rays.iter().flatten().count() as u64;
            sums[*slot].add(self.render.exposure_of(asked, rays, &mut self.work));
        }
        self.asked.clear();
        self.slots.clear();
    }
}

fn scene_ray(ray: &CameraRay) -> Ray {
    Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Era, LensChoice, Optics, Plan, Session};

    /// Boxes, balls and a mirror, by a lens.
    fn session(era: Era, lens: &str) -> Session {
        let folder = std::env::temp_dir().join(format!("ivcam-render-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for the scene");
        let scene = folder.join(format!("{}-{lens}.iv", era.name()));
        let text = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 focalDistance 4 }\n\
             PointLight { location 2 3 4 }\n\
             Material { specularColor .5 .5 .5 shininess .9 diffuseColor .8 .2 .1 }\n\
             Sphere { }\nTranslation { translation 1 .4 .5 } Cube { width .5 }\n\
             Translation { translation -2 -1 0 } Cone { }\n";
        std::fs::write(&scene, text).expect("the scene can be written");
        let mut plan = Plan::of_era(era, scene);
        plan.optics = Optics::Lens(LensChoice::named(lens));
        plan.resolution = Resolution {
            width: 44,
            height: 27,
        };
        plan.sampler.samples = 5;
        plan.stop = Stop::after(5);
        Session::open(plan).expect("the scene is whole")
    }

    fn with_render<T>(
        session: &Session,
        threads: usize,
        work: impl FnOnce(&Render<'_>) -> T + Send,
    ) -> T
    where
        T: Send,
    {
        let shader = Shader::new(
            &session.scene,
            session.plan.shading,
            crate::shade::ShadeOptions::default(),
        );
        let render = Render {
            shader: &shader,
            camera: &session.camera,
            sampler: session.plan.sampler,
            resolution: session.plan.resolution,
            exposure: session.plan.exposure,
            stop: session.plan.stop,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads start").install(|| work(&render))
    }

    #[test]
    fn tiles_give_the_bits_of_one_ray_at_a_time_at_any_number_of_threads() {
        for (era, lens) in [
            (Era::Vintage, "wide-angle"),
            (Era::Modern, "wide-angle"),
            (Era::Modern, "tessar"),
        ] {
            let session = session(era, lens);
            let each = session.camera.rays_each() as u64;
            assert_eq!(each, if lens == "tessar" { 4 } else { 1 });
            let plain: Vec<Exposed> = with_render(&session, 1, |render| {
                let mut work = Work::default();
                let pixel = |i: u32| {
                    let mut sum = Exposed::default();
                    for index in 0..5 {
                        sum.add(render.sample((i % 44, i / 44), index, &mut work));
                    }
                    sum
                };
                (0..44 * 27).map(pixel).collect()
            });
            for threads in [1, 3] {
                let made = with_render(&session, threads, |render| render.run(&|_| ()));
                assert!(made.film.mean() > 0.05, "a black picture tests nothing");
                assert_eq!(made.film.pixels, plain, "{threads} threads, {}", era.name());
                assert_eq!(made.counts.film_rays, each * 5 * 44 * 27);
                assert!(made.counts.shadow_rays > 0 && made.counts.error_rays > 0);
            }
        }
    }

    /// 200 pictures of 4 samples a pixel, each saying how wrong it is, against one of 2,048.
    #[test]
    fn the_true_error_lies_in_the_stated_interval_nine_to_ten_times_in_ten() {
        let mut session = session(Era::Modern, "wide-angle");
        session.plan.resolution = Resolution {
            width: 48,
            height: 32,
        };
        let make = |seed: u64, samples: u32| {
            with_render(&session, 2, |render| {
                Render {
                    sampler: Sampler {
                        samples,
                        seed,
                        ..render.sampler
                    },
                    stop: Stop::after(samples),
                    ..*render
                }
                .run(&|_| ())
                .film
            })
        };
        let truth: Vec<[f64; 3]> = make(12345, 2048)
            .pixels
            .iter()
            .map(|p| p.mean.to_array())
            .collect();
        let (mut inside, mut sum) = (0, 0.0);
        for seed in 0..200 {
            let film = make(seed, 4);
            let error = film.error().expect("the picture has an error");
            let relative = crate::report::Deviation::of(&film, &truth).rel_mse.sqrt();
            inside += u32::from(error.low <= relative && relative <= error.high);
            sum += error.relative_rmse / relative / 200.0;
        }
        assert!(
            (180..=198).contains(&inside),
            "{inside} of 200, ratio {sum}"
        );
        assert!((sum - 1.0).abs() < 0.05, "estimated over true is {sum}");
    }
}
