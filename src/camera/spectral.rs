//! Colors by their wavelengths.
//!
//! A sample sees a hero set of wavelengths (`spectrum`), whose rays start from one film point to
//! one lens point. They leave the lens on nearly the same path, and nearly always bring the same
//! light. So one of them stands for all: its radiance is used at every wavelength that gets through.
//! The error is corrected at random. A ray of another wavelength is intersected with a probability
//! that grows with its distance from the first. If it hits another surface it is shaded, else it is
//! shaded with probability [`ALIKE`], and the difference of the two radiances is weighted by the
//! inverse of the probabilities. The mean is that of following all rays (a multilevel estimate:
//! Heinrich, "Multilevel Monte Carlo Methods", 2001), and most samples take one ray through the
//! scene.

use glam::DMat3;

use super::film_samples::FilmSamples;
use super::lens_camera::LensCamera;
use super::rays::{CameraRays, ExitRays};
use super::spectral_lenses::SpectralLenses;
use crate::lens::{Aims, Bundle, PupilTransmission};
use crate::math::lanes::LANES;
use crate::sampling::Samples;
use crate::spectrum::{HERO, Line, SETS};

/// The order in which a set's rays are preferred to stand for all: those in the middle first.
const FIRST: [usize; HERO] = [2, 1, 3, 0];
/// A ray this far from the first, in radians, is intersected with the probability of its color's
/// size. This constant and the next two were measured to give the least time to an error.
const FAR: f64 = 6.4e-4;
/// The share of [`FAR`] that is added to every distance, so that every ray may be intersected.
const LEAST: f64 = 0.125;
/// The probability that a ray is shaded that hits the same surface as the first.
const ALIKE: f64 = 0.2;

/// Rays of wavelengths that may bring other light than the first ray of their sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpectralCorrections {
    pub rays: CameraRays,
    /// The number of each one's first ray in the batch that is shaded.
    pub firsts: Vec<u32>,
    /// Random numbers that are independent of the choice of the rays.
    dice: Vec<f64>,
    /// Rays behind the lens, which the samples of one set share.
    traced: Vec<Traced>,
}

/// The rays of some samples behind the lens, at the wavelengths of one set.
#[derive(Clone, Debug)]
struct Traced {
    set: usize,
    rays: [ExitRays; HERO],
}

impl SpectralCorrections {
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.firsts.clear();
        self.dice.clear();
        self.traced.clear();
    }

    /// Moves the rays that are to be shaded into `accepted` and takes their share from their first
    /// rays in `rays`. `is_unlike` says whether a correction hits another surface than its first.
    pub(crate) fn accept(
        &self,
        is_unlike: impl Fn(usize) -> bool,
        rays: &mut CameraRays,
        accepted: &mut CameraRays,
    ) {
        accepted.clear();
        for (number, (first, dice)) in self.firsts.iter().zip(&self.dice).enumerate() {
            let probability = if is_unlike(number) { 1.0 } else { ALIKE };
            if *dice >= probability {
                continue;
            }
            let color = self.rays.colors[number] * probability.recip();
            rays.colors[*first as usize] -= color;
            let (packet, lane) = (&self.rays.packets()[number / LANES], number % LANES);
            accepted.push_colored(packet.samples[lane], packet.ray(lane), color);
        }
    }
}

impl LensCamera {
    /// Makes the rays of samples at their wavelengths. Samples of one set share its lenses, so they
    /// are traced together, wherever they are; they continue into the scene in their own order.
    pub(super) fn shoot_by_wavelength(
        &self,
        lenses: &SpectralLenses,
        samples: &Samples,
        bundle: &mut Bundle,
        rays: &mut CameraRays,
        corrections: &mut SpectralCorrections,
    ) {
        let mut of_set: [Vec<usize>; SETS] = Default::default();
        for (i, wavelength) in samples.wavelength.iter().enumerate() {
            of_set[split(*wavelength).0].push(i);
        }
        let mut places = vec![(0, 0); samples.len()];
        let mut traced = std::mem::take(&mut corrections.traced);
        let (mut lanes, mut aims) = (FilmSamples::default(), Aims::default());
        let unknown = PupilTransmission::default();
        for (set, members) in of_set.iter().enumerate() {
            for members in members.chunks(LANES) {
                lanes.take(self.format, samples, members);
                lenses
                    .target
                    .aims(&lanes.film, &lanes.pupil, &unknown, &mut aims);
                let exit_rays = lenses.lenses[set].each_ref().map(|lens| {
                    let mut out = ExitRays::default();
                    self.trace(lens, &lanes, &aims, bundle, &mut out);
                    rays.passed += out.rays.mask.count_ones() as usize;
                    out
                });
                for (lane, sample) in members.iter().enumerate() {
                    places[*sample] = (traced.len(), lane);
                }
                traced.push(Traced {
                    set,
                    rays: exit_rays,
                });
            }
        }
        for (sample, (number, lane)) in places.into_iter().enumerate() {
            let of_set = &traced[number];
            let choice = Choice {
                lines: &lenses.sets[of_set.set],
                sizes: &lenses.sizes[of_set.set],
                rays: &of_set.rays,
                lane,
                sample: sample as u32,
            };
            choice.make(split(samples.wavelength[sample]).1, rays, corrections);
        }
        corrections.traced = traced;
    }
}

/// The hero set of a number in [0, 1), and how far into the set the number is.
fn split(wavelength: f64) -> (usize, f64) {
    let place = wavelength * SETS as f64;
    let set = (place as usize).min(SETS - 1);
    (set, place - set as f64)
}

/// The choice of the rays of one sample that are followed.
struct Choice<'a> {
    lines: &'a [Line; HERO],
    sizes: &'a [f64; HERO],
    rays: &'a [ExitRays; HERO],
    lane: usize,
    sample: u32,
}

impl Choice<'_> {
    /// Appends the ray that stands for all to `rays`, if any gets through, and the rays that are
    /// intersected besides to `corrections`.
    fn make(&self, dice: f64, rays: &mut CameraRays, corrections: &mut SpectralCorrections) {
        let through = |i: usize| self.rays[i].rays.mask >> self.lane & 1 == 1;
        let Some(chosen) = FIRST.into_iter().find(|i| through(*i)) else {
            return;
        };
        let first = rays.len() as u32;
        let mut sum = self.color(chosen);
        // Systematic sampling: the probabilities stand in a row, and a ray is chosen where an
        // integer, shifted by the dice, falls into its part.
        let (mut row, mut next) = (0.0, dice);
        for i in (0..HERO).filter(|i| *i != chosen && through(*i)) {
            let color = self.color(i);
            sum += color;
            let probability = self.probability(i, chosen);
            row += probability;
            if row > next {
                // The place inside of the part is again uniform.
                corrections.dice.push(1.0 - (row - next) / probability);
                corrections.firsts.push(first);
                let ray = self.rays[i].ray(self.lane);
                let color = color * probability.recip();
                corrections.rays.push_colored(self.sample, ray, color);
                next += 1.0;
            }
        }
        let ray = self.rays[chosen].ray(self.lane);
        rays.push_colored(self.sample, ray, sum);
    }

    /// The film's response to a radiance along a ray.
    fn color(&self, i: usize) -> DMat3 {
        self.lines[i].color * self.rays[i].weights[self.lane]
    }

    /// The probability with which a ray is intersected: the root of the mean square of its
    /// correction. It is as likely as an edge between the two rays, and so grows as the root of
    /// their distance.
    fn probability(&self, i: usize, first: usize) -> f64 {
        let [a, b] = [i, first].map(|i| &self.rays[i]);
        let apart = |axis: usize| {
            let [a, b] = [a, b].map(|out| out.rays.direction[axis][self.lane]);
            let apart = a - b;
            f64::from(apart * apart)
        };
        let distance = (apart(0) + apart(1) + apart(2)).sqrt();
        let share = a.weights[self.lane] / b.weights[self.lane];
        (self.sizes[i] * share * (distance / FAR + LEAST).sqrt()).clamp(1e-3, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Spectrum;

    /// Rays that leave a lens this far apart, in radians; some are lost, and their light differs.
    #[test]
    fn over_all_dice_every_ray_counts_by_its_own_color() {
        let lines = &Spectrum::default().hero_sets()[3];
        for (apart, through) in [
            (1e-5, 15u32),
            (1e-3, 15),
            (1e-3, 0b1001),
            (1.0, 7),
            (0.1, 2),
        ] {
            let rays = std::array::from_fn(|i| {
                let mut out = ExitRays::default();
                out.weights[5] = 0.5 + 0.1 * i as f64;
                out.rays.direction[1][5] = apart * i as f32;
                out.rays.mask = (through >> i & 1) << 5;
                out
            });
            let choice = Choice {
                lines,
                sizes: &[0.2, 0.7, 0.5, 0.4],
                rays: &rays,
                lane: 5,
                sample: 0,
            };
            const STEPS: u32 = 20_000;
            let mut sums = [DMat3::ZERO; HERO];
            let (mut most, mut left) = (0, [0i32; 4]);
            for step in 0..STEPS {
                let (mut shaded, mut corrections) =
                    (CameraRays::default(), SpectralCorrections::default());
                let dice = (f64::from(step) + 0.5) / f64::from(STEPS);
                choice.make(dice, &mut shaded, &mut corrections);
                most = most.max(corrections.rays.len());
                for dice in &corrections.dice {
                    assert!((0.0..=1.0).contains(dice));
                    left[(4.0 * dice) as usize & 3] += 1;
                }
                let mut more = CameraRays::default();
                corrections.accept(|_| true, &mut shaded, &mut more);
                for rays in [&shaded, &more] {
                    for (number, color) in rays.colors.iter().enumerate() {
                        let ray = rays.packets()[0].rays.ray(number);
                        let line = (ray.direction.y / apart).round() as usize;
                        sums[line] += *color * f64::from(STEPS).recip();
                    }
                }
            }
            // What is left of the dice is even again.
            assert!(left.iter().all(|n| (n - left[0]).abs() < 20), "{left:?}");
            assert!(most < through.count_ones() as usize);
            for (i, sum) in sums.iter().enumerate() {
                let own = choice.color(i) * f64::from(through >> i & 1);
                let off = (*sum - own).to_cols_array();
                let off = off.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                assert!(off < 1e-2, "{apart} {through:b}: ray {i} is off by {off}");
            }
        }
    }
}
