//! Rays of several wavelengths through a lens with dispersion.
//!
//! A sample has a hero set of wavelengths (`spectrum`), whose rays go from one film point to one
//! lens point. They leave the lens on nearly the same path, and nearly always have the same
//! radiance. So one of them represents all: its radiance is used at every wavelength that gets
//! through. The error is corrected at random. A ray of another wavelength is intersected with a
//! probability that grows with its distance from the first. If it hits another surface it is
//! shaded; otherwise it is shaded with the probability [`SAME_SURFACE_PROBABILITY`]. The difference
//! of the two radiances is divided by the probabilities. The mean is that of tracing all rays (a
//! multilevel estimate: Heinrich, "Multilevel Monte Carlo Methods", 2001), and most samples take
//! one ray through the scene.

use glam::DMat3;

use super::film_samples::FilmSamples;
use super::lens_camera::LensCamera;
use super::rays::{CameraRays, ExitRays};
use super::spectral_lenses::SpectralLenses;
use crate::lens::{Aims, Bundle, PupilTransmission};
use crate::math::lanes::LANES;
use crate::sampling::Samples;
use crate::spectrum::{HERO, Line, SETS};

/// The order in which the wavelengths of a set are preferred to represent all: the middle ones
/// first.
const PREFERENCE: [usize; HERO] = [2, 1, 3, 0];
/// The distance from the first ray, in radians, at which a ray is intersected with the probability
/// of its color's size. This constant and the next two were measured to give the least time for a
/// given error.
const FAR: f64 = 6.4e-4;
/// The share of [`FAR`] that is added to every distance, so that every ray may be intersected.
const MIN_DISTANCE: f64 = 0.125;
/// The probability of shading a ray that hits the same surface as the first.
const SAME_SURFACE_PROBABILITY: f64 = 0.2;

/// Rays of further wavelengths, whose radiance may differ from that of the first ray of their
/// sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpectralCorrections {
    /// The rays.
    pub rays: CameraRays,
    /// For each ray, the number of the first ray of its sample in the batch that is shaded.
    pub firsts: Vec<u32>,
    /// Random numbers that are independent of the choice of the rays.
    uniform: Vec<f64>,
    /// The rays in front of the lens. Samples of one set share an entry.
    traced: Vec<Traced>,
}

/// The rays of some samples in front of the lens, at the wavelengths of one set.
#[derive(Clone, Debug)]
struct Traced {
    /// The number of the hero set.
    set: usize,
    rays: [ExitRays; HERO],
}

impl SpectralCorrections {
    /// Removes all rays and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.firsts.clear();
        self.uniform.clear();
        self.traced.clear();
    }

    /// Copies the rays to be shaded to `accepted`, and subtracts their share from their first rays
    /// in `rays`. `is_unlike` returns whether a correction hits another surface than its first ray.
    pub(crate) fn accept(
        &self,
        is_unlike: impl Fn(usize) -> bool,
        rays: &mut CameraRays,
        accepted: &mut CameraRays,
    ) {
        accepted.clear();
        for (number, (first, uniform)) in self.firsts.iter().zip(&self.uniform).enumerate() {
            let probability = match is_unlike(number) {
                true => 1.0,
                false => SAME_SURFACE_PROBABILITY,
            };
            if *uniform >= probability {
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
    /// Makes the rays of samples at their wavelengths. Samples of one hero set share its lenses, so
    /// they are traced together; the rays continue into the scene in the order of the samples.
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
                    let mut transmittances = self.transmittances(lens);
                    let dimming = transmittances.as_mut();
                    self.trace(lens, &lanes, &aims, bundle, dimming, &mut out);
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

/// The hero set of a number in [0, 1), and the position of the number in the set, also in [0, 1).
fn split(wavelength: f64) -> (usize, f64) {
    let place = wavelength * SETS as f64;
    let set = (place as usize).min(SETS - 1);
    (set, place - set as f64)
}

/// The choice of the rays of one sample that continue into the scene.
struct Choice<'a> {
    lines: &'a [Line; HERO],
    /// The sizes of the colors of the wavelengths.
    sizes: &'a [f64; HERO],
    rays: &'a [ExitRays; HERO],
    /// The lane of the sample in `rays`.
    lane: usize,
    /// The number of the sample.
    sample: u32,
}

impl Choice<'_> {
    /// Appends the ray that represents all to `rays`, if any gets through, and the further rays to
    /// be intersected to `corrections`. `uniform` is a random number in [0, 1).
    fn make(&self, uniform: f64, rays: &mut CameraRays, corrections: &mut SpectralCorrections) {
        let through = |i: usize| self.rays[i].rays.mask >> self.lane & 1 == 1;
        let Some(chosen) = PREFERENCE.into_iter().find(|i| through(*i)) else {
            return;
        };
        let first = rays.len() as u32;
        let mut sum = self.color(chosen);
        // Systematic sampling: the probabilities are summed, and a ray is chosen if an integer plus
        // the random number falls into its interval of the sum.
        let (mut sum_of_probabilities, mut next) = (0.0, uniform);
        for i in (0..HERO).filter(|i| *i != chosen && through(*i)) {
            let color = self.color(i);
            sum += color;
            let probability = self.probability(i, chosen);
            sum_of_probabilities += probability;
            if sum_of_probabilities > next {
                // The position in the interval is uniform, too.
                let position = 1.0 - (sum_of_probabilities - next) / probability;
                corrections.uniform.push(position);
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

    /// The probability with which a ray is intersected. It is proportional to the root mean square
    /// of its correction. A correction differs from 0 mostly if there is an edge between the two
    /// rays, whose probability is proportional to their distance, so the root mean square grows as
    /// the root of it.
    fn probability(&self, i: usize, first: usize) -> f64 {
        let [a, b] = [i, first].map(|i| &self.rays[i]);
        let apart = |axis: usize| {
            let [a, b] = [a, b].map(|out| out.rays.direction[axis][self.lane]);
            let apart = a - b;
            f64::from(apart * apart)
        };
        let distance = (apart(0) + apart(1) + apart(2)).sqrt();
        let share = a.weights[self.lane] / b.weights[self.lane];
        (self.sizes[i] * share * (distance / FAR + MIN_DISTANCE).sqrt()).clamp(1e-3, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Spectrum;

    /// The rays leave the lens at different distances, in radians. Some are lost, and their weights
    /// differ.
    #[test]
    fn on_average_every_ray_counts_by_its_own_color() {
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
            let (mut most, mut quarters) = (0, [0i32; 4]);
            for step in 0..STEPS {
                let (mut shaded, mut corrections) =
                    (CameraRays::default(), SpectralCorrections::default());
                let uniform = (f64::from(step) + 0.5) / f64::from(STEPS);
                choice.make(uniform, &mut shaded, &mut corrections);
                most = most.max(corrections.rays.len());
                for uniform in &corrections.uniform {
                    assert!((0.0..=1.0).contains(uniform));
                    quarters[(4.0 * uniform) as usize & 3] += 1;
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
            // The positions in the intervals are uniform.
            assert!(
                quarters.iter().all(|n| (n - quarters[0]).abs() < 20),
                "{quarters:?}"
            );
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
