//! Exposes pairs of pixels that are not part of the picture, from which its error is estimated.
//!
//! `film::error` says which pixels are drawn, and why the estimate holds. The exposures of a pair
//! have half of the pixel's samples each, so that its error is about that of the picture, or more
//! for light paths.

use ivcam_optics::film::{
    DrawProbabilities, ErrorUnknown, Exposed, Film, MissedLight, Pair, Region, Resolution,
    SquaredError,
};
use ivcam_optics::sampling::{Sampler, mix, unit};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::batch::Batch;
use super::exposure::Counts;
use super::lamp_images::{LampImages, LampPixel};
use super::passes::Render;
use super::sample_window::SampleWindow;
use crate::scene::SmallLight;

/// The pairs have this part of the picture's samples. They take about 3% of the time.
const SHARE: f64 = 1.0 / 32.0;
/// The least number of pairs.
const LEAST: usize = 16;
/// The largest number of samples of an exposure by light paths that is longer than half of the
/// picture's samples.
const LONG: f64 = 64.0;
/// The number of rays in the scene that the longer exposures of a look may take, without those
/// toward lights: about a second. Paths between white walls have a hundred rays and more.
const RAYS: f64 = (1 << 22) as f64;
/// The number of paths by which the length of paths is estimated.
const PROBES: usize = 128;
/// The number of pairs that a thread exposes at once.
pub(super) const AT_ONCE: usize = 32;
/// The area in pixels from which a light is not searched for.
const SMALL: f64 = 1.0;
/// The number of pairs of a pixel with the image of a small light.
const LAMP_PAIRS: usize = 8;
/// The number of samples of their exposures that there is time for in any picture, and the least
/// number.
const QUICK: f64 = 512.0;
const FEWEST: f64 = 16.0;
/// The number of expected hits below which a light may have been missed: the probability is then
/// at least 1%.
const SURE: f64 = 4.6;

/// How many pairs an estimate has.
#[derive(Clone, Copy)]
struct PairAmount {
    /// The number of the first pair.
    first: u32,
    /// The number of pairs in a small picture with at least as many pixels. It bounds the width of
    /// the confidence interval.
    fewest: f64,
    /// The number of samples that the pairs of a small picture may have. Adaptive sampling may put
    /// more than half of a picture's samples on a few pixels.
    most_samples: f64,
    /// The largest number of samples of an exposure of a pixel with a small light, over that which
    /// makes it as precise as the picture. Samples are stratified, so a long exposure is worth more
    /// than several short ones.
    longest: f64,
    /// The number of samples up to which exposures by light paths are longer than half of the
    /// picture's samples. Of two exposures of one sample, both rarely meet light that few paths
    /// carry, and only then show that the picture misses it.
    of_paths: f64,
}

/// The first look at a film whose samples go on.
const GLANCE: PairAmount = PairAmount {
    first: 0,
    fewest: 512.0,
    most_samples: 0.0,
    longest: 1.0,
    of_paths: 0.0,
};
/// The first look at a final film, of at most about a quarter of a second beside its usual share.
const FIRST_LOOK: PairAmount = PairAmount {
    most_samples: 262_144.0,
    longest: 4.0,
    of_paths: 65_536.0,
    ..GLANCE
};
/// The look at a final film whose error few pixels carry, if the first look left it unknown. Its
/// pairs are other ones, because those of the first look are chosen by their outcome.
const SECOND_LOOK: PairAmount = PairAmount {
    first: 1 << 24,
    fewest: 4.0 * FIRST_LOOK.fewest,
    most_samples: 4.0 * FIRST_LOOK.most_samples,
    longest: 16.0,
    of_paths: 4.0 * FIRST_LOOK.of_paths,
};

impl PairAmount {
    /// Limits the samples of longer exposures to what [`RAYS`] are enough for.
    fn within(self, rays_of_a_sample: f64) -> Self {
        let samples = RAYS * self.of_paths / FIRST_LOOK.of_paths / rays_of_a_sample.max(1.0);
        Self {
            of_paths: self.of_paths.min(samples),
            most_samples: self.most_samples.min(4.0 * samples),
            ..self
        }
    }
}

/// A pixel that is drawn for a pair.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct PairDraw {
    /// The number of the draw, counted from 0.
    number: u32,
    /// The index of the pixel in the film.
    pixel: u32,
    /// The column and row of the pixel in the picture.
    at: (u32, u32),
    /// The number of samples of each exposure.
    samples: u32,
    /// Where samples are dense because a small light is there.
    window: Option<SampleWindow>,
    /// `None` if the pixel is exposed in any case.
    probability: Option<f64>,
}

impl Render<'_> {
    /// Estimates the error of a film, which is a region of the picture, by exposing pairs. Returns
    /// the rays of the pairs too. If the picture is not final, the estimate takes its usual share
    /// of the time, even if the error is then unknown. The pairs are functions of the film and the
    /// seed, and their sums are made in one order: the estimate has the same bits at any number of
    /// threads.
    pub fn measure(
        &self,
        film: &Film,
        region: Region,
        is_final: bool,
    ) -> (Option<SquaredError>, Counts) {
        let rays = match is_final && self.shader.follows_paths() {
            true => self.rays_of_a_path(film, region),
            false => 1.0,
        };
        let first = match is_final {
            true => FIRST_LOOK.within(rays),
            false => GLANCE,
        };
        let fewest = film.pixels.iter().map(|p| p.count).min();
        let mut lights = LightWatch::new(self, fewest.unwrap_or_default());
        lights.look(film, region);
        let lamps = lights.images.pixels((film, region), self.filter);
        let (mut error, mut counts) = self.look((film, region), &lamps, first);
        if is_final && error.is_some_and(|e| few_pixels_hide(&e, film)) {
            let (second, more) = self.look((film, region), &lamps, SECOND_LOOK.within(rays));
            error = second;
            counts.add(&more);
        }
        if let Some(error) = &mut error {
            error.missed = lights.missed();
            error.cut_rays = self.shader.scene().cut_rays();
        }
        // The other rays are those of the picture, however often its error was measured.
        let counts = Counts {
            error_rays: counts.error_rays,
            ..Counts::default()
        };
        (error, counts)
    }

    /// Returns the mean number of rays in the scene of one path through the film.
    fn rays_of_a_path(&self, film: &Film, region: Region) -> f64 {
        let pixels = film.pixels.len();
        let probes = (0..PROBES / 2).map(|i| PairDraw {
            pixel: (i * pixels / (PROBES / 2)) as u32,
            samples: 1,
            ..PairDraw::default()
        });
        let look = PairAmount {
            first: 1 << 25,
            ..GLANCE
        };
        let (_, counts) = self.expose_draws(&numbered(probes.collect(), region, look));
        counts.scene_rays as f64 / PROBES as f64
    }

    /// Estimates the squared error of a film by the pairs of one look.
    fn look(
        &self,
        (film, region): (&Film, Region),
        lamps: &[LampPixel],
        look: PairAmount,
    ) -> (Option<SquaredError>, Counts) {
        let (pairs, counts) = self.pairs(&self.draws((film, region), lamps, look));
        (SquaredError::of(&pairs, &film.pixels), counts)
    }

    /// Exposes the pairs of draws by the team, if there is one.
    fn pairs(&self, draws: &[PairDraw]) -> (Vec<Pair>, Counts) {
        match self.team {
            Some(team) => self.pairs_of_team(team, draws),
            None => self.expose_draws(draws),
        }
    }

    /// Exposes the pairs of draws on the threads of rayon's current pool.
    pub(super) fn expose_draws(&self, draws: &[PairDraw]) -> (Vec<Pair>, Counts) {
        let mut pairs = vec![Pair::default(); draws.len()];
        let parts = draws.par_chunks(AT_ONCE);
        let counts = parts
            .zip(pairs.par_chunks_mut(AT_ONCE))
            .map(|(draws, pairs)| self.expose_pairs(draws, pairs))
            .reduce(Counts::default, |a, b| a.plus(&b));
        (pairs, counts)
    }

    /// Chooses the pixels of the pairs, in the order of the pixels: those with the images of small
    /// lights, each [`LAMP_PAIRS`] times, and others at even steps along their summed
    /// probabilities.
    fn draws(
        &self,
        (film, region): (&Film, Region),
        lamps: &[LampPixel],
        look: PairAmount,
    ) -> Vec<PairDraw> {
        let exempt: Vec<u32> = lamps.iter().map(|lamp| lamp.pixel).collect();
        let probabilities = DrawProbabilities::new(&film.pixels, film.resolution, &exempt);
        let all: f64 = film.pixels.iter().map(|p| f64::from(p.count)).sum();
        let each = probabilities.samples;
        let pixels = film.pixels.len();
        let most = look.most_samples.max(SHARE * all);
        let mut draws = lamp_draws(lamps, most, look.longest);
        if !(each > 0.0) {
            return numbered(draws, region, look);
        }
        let usual = (SHARE * pixels as f64).max(look.fewest) * (all / pixels as f64) / each;
        let wanted = usual.max((look.most_samples / each).min(look.fewest)) as usize;
        let wanted = wanted.clamp(LEAST, pixels.max(look.fewest as usize));
        let least = match self.shader.follows_paths() {
            true => (look.of_paths / (2 * wanted) as f64).min(LONG) as u32,
            false => 0,
        };
        let step = 1.0 / wanted as f64;
        let key = self.sampler.seed ^ 0x7061_6972 ^ u64::from(look.first);
        let mut next = step * unit(mix(key));
        let mut sum = 0.0;
        for (pixel, probability) in probabilities.iter().enumerate() {
            sum += probability;
            while next < sum {
                next += step;
                draws.push(PairDraw {
                    pixel: pixel as u32,
                    samples: film.pixels[pixel].count.div_ceil(2).max(least),
                    probability: Some(probability),
                    ..PairDraw::default()
                });
            }
        }
        numbered(draws, region, look)
    }

    /// Exposes the pair of each of some draws.
    fn expose_pairs(&self, draws: &[PairDraw], pairs: &mut [Pair]) -> Counts {
        let mut batch = Batch::new(self);
        let mut sums: Vec<Exposed> = Vec::with_capacity(2 * draws.len());
        for draw in draws {
            let samples = draw.samples;
            for half in 0..2 {
                let sampler = Sampler {
                    samples,
                    seed: mix(!self.sampler.seed ^ mix(2 * u64::from(draw.number) + half)),
                    ..self.sampler
                };
                sums.push(Exposed::default());
                batch.add_in(draw.at, draw.window, sampler, 0..samples, &mut sums);
            }
        }
        batch.flush(&mut sums);
        let sums: &[[Exposed; 2]] = sums.as_chunks().0;
        for ((pair, draw), sums) in pairs.iter_mut().zip(draws).zip(sums) {
            *pair = Pair {
                pixel: draw.pixel,
                probability: draw.probability,
                levels: sums.map(|sum| sum.mean),
            };
        }
        Counts {
            error_rays: batch.counts.film_rays,
            passed: batch.counts.passed,
            scene_rays: batch.work.counts.scene,
            shadow_rays: batch.work.counts.shadow,
            film_rays: 0,
        }
    }
}

/// The pairs of the pixels with small lights, which together have at most about a number of
/// samples.
fn lamp_draws(lamps: &[LampPixel], most_samples: f64, longest: f64) -> Vec<PairDraw> {
    let most = most_samples / (2 * LAMP_PAIRS) as f64;
    let each: f64 = lamps.iter().map(|lamp| lamp.samples).sum();
    let longer = (most / each).min(longest);
    let fewest = QUICK.min(most / lamps.len() as f64).max(FEWEST);
    let pairs = lamps.iter().map(|lamp| PairDraw {
        pixel: lamp.pixel,
        samples: (longer * lamp.samples).max(fewest) as u32,
        window: Some(lamp.window),
        ..PairDraw::default()
    });
    pairs.flat_map(|pair| [pair; LAMP_PAIRS]).collect()
}

/// Puts draws into the order of their pixels, and states the numbers and the places of the pixels.
fn numbered(mut draws: Vec<PairDraw>, region: Region, look: PairAmount) -> Vec<PairDraw> {
    draws.sort_by_key(|draw| draw.pixel);
    for (number, draw) in draws.iter_mut().enumerate() {
        draw.number = look.first + number as u32;
        let (column, row) = (draw.pixel % region.width, draw.pixel / region.width);
        draw.at = (region.left + column, region.top + row);
    }
    draws
}

/// Returns whether an error is unknown because few pixels carry it, which more pairs can tell.
fn few_pixels_hide(error: &SquaredError, film: &Film) -> bool {
    let stated = error.relative(film.pixels.len(), film.mean());
    use ErrorUnknown::{FewPairs, FewPixels, UncertainMean};
    let hidden = |why| {
        matches!(
            why,
            FewPairs { .. } | FewPixels { .. } | UncertainMean { .. }
        )
    };
    stated.is_err_and(hidden)
}

/// The small lights of a scene that no sample of the examined films has hit.
pub(super) struct LightWatch {
    lights: Vec<SmallLight>,
    /// The images of lights which exposures of pairs look for on purpose.
    images: LampImages,
    exposure: f64,
    /// The least number of samples of a pixel.
    fewest: u32,
}

impl LightWatch {
    /// Finds the lights that all samples of a picture may miss, if its pixels have at least a
    /// number of samples each.
    pub(super) fn new(render: &Render<'_>, fewest: u32) -> Self {
        let size = [render.resolution.width, render.resolution.height].map(f64::from);
        let scene = render.shader.scene();
        let most = SURE / f64::from(fewest);
        let mut lights = scene.small_lights(size, most.max(SMALL));
        if let Some(finder) = render.lamps.filter(|_| render.shader.follows_paths()) {
            lights.retain(|light| {
                !finder.finds_at([light.place[0] / size[0], light.place[1] / size[1]])
            });
        }
        let images = LampImages::take_from(&mut lights, render);
        lights.retain(|light| light.pixels < most);
        Self {
            lights,
            images,
            exposure: render.exposure,
            fewest: u32::MAX,
        }
    }

    /// Drops the lights that samples of a film, which is a region of the picture, have hit.
    pub(super) fn look(&mut self, film: &Film, region: Region) {
        let fewest = film.pixels.iter().map(|p| p.count).min();
        self.fewest = self.fewest.min(fewest.unwrap_or(u32::MAX));
        let exposure = self.exposure;
        self.lights.retain(|light| {
            let level = (exposure * light.radiance).max_element();
            !is_hit(film, region, light.place, level)
        });
    }

    /// Returns the light with the most effect on the picture.
    pub(super) fn missed(&self) -> Option<MissedLight> {
        let small = |light: &&SmallLight| light.pixels < SURE / f64::from(self.fewest);
        let missed = self.lights.iter().filter(small).map(|light| {
            let radiance = self.exposure * light.radiance;
            MissedLight {
                pixels: light.pixels,
                level: radiance.max_element(),
                squared_error: (light.pixels * radiance).length_squared(),
            }
        });
        missed.max_by(|a, b| a.squared_error.total_cmp(&b.squared_error))
    }
}

/// Returns whether a sample near a place of the picture has a quarter of a level or more. Lenses
/// darken their corners and may show the light a little off its place.
fn is_hit(film: &Film, region: Region, place: [f64; 2], level: f64) -> bool {
    let Resolution { width, height } = film.resolution;
    let reach = 3.0 + 0.02 * f64::from(width.max(height));
    let range = |place: f64, from: u32, size: u32| {
        let at = place - f64::from(from);
        (at - reach).max(0.0) as u32..((at + reach).max(0.0) as u32).min(size)
    };
    let bright = |pixel: &Exposed| {
        let count = f64::from(pixel.count);
        let hit = 0.25 * level;
        let scatter = pixel.variance_of_mean().max_element() * count * (count - 1.0);
        pixel.mean.max_element() * count >= hit && (pixel.count < 2 || scatter >= 0.5 * hit * hit)
    };
    let columns = range(place[0], region.left, width);
    range(place[1], region.top, height).any(|y| {
        let mut pixels = columns
            .clone()
            .map(|x| &film.pixels[(y * width + x) as usize]);
        pixels.any(bright)
    })
}
