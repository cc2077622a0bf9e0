//! Rays of several wavelengths through a lens with dispersion.
//!
//! A sample has a hero set of wavelengths (`spectrum`), whose rays leave one film point and leave
//! the lens on nearly the same path. Nearly always they have the same radiance. So the ray of the
//! main wavelength represents all: its radiance is used at every wavelength. The error is corrected
//! at random, in three steps (a multilevel estimate: Heinrich, "Multilevel Monte Carlo Methods",
//! 2001). A ray of another wavelength is traced through the lens with a probability that is known
//! before. If it gets through, it is intersected with a probability that grows with its distance
//! from the main ray. If it hits another surface than the main ray it is shaded; otherwise it is
//! shaded with the probability [`SAME_SURFACE_PROBABILITY`]. The difference of the two radiances is
//! divided by the probabilities, so that the mean is that of tracing all rays.
//!
//! A sample whose main ray is lost is aimed again as in `resample`, if the open share of the area
//! is known at the main wavelength. Later aims are points of the main wavelength's pupil alone, so
//! the rays of the first aim that get through at other wavelengths continue as well.

use std::iter::zip;

use super::aim::film_point;
use super::film_samples::{AimedSample, FilmSamples, ROUNDS};
use super::lens_camera::LensCamera;
use super::rays::{CameraRays, ColorFactor, ExitRays};
use super::spectral_lenses::{MAIN, SpectralLenses};
use crate::lens::{Aims, Bundle};
use crate::math::lanes::LANES;
use crate::sampling::Samples;
use crate::spectrum::{HERO, SETS};

/// The wavelengths of a set except the main one.
const OTHERS: [usize; HERO - 1] = [0, 1, 3];
/// The distance from the main ray, in radians, at which a ray is intersected with the probability
/// of its color's size. This constant and the next three were measured to give the least time for a
/// given error.
const FAR: f64 = 6.4e-4;
/// The share of [`FAR`] that is added to every distance, so that every ray may be intersected.
const MIN_DISTANCE: f64 = 0.125;
/// The probability of shading a ray that hits the same surface as the main ray.
const SAME_SURFACE_PROBABILITY: f64 = 0.2;
/// All wavelengths are traced in a rim of the open area, because rays that are lost at some
/// wavelengths alone are near the rim. It is the rim's share of the area.
const RIM: f64 = 0.02;
/// The share of the area at whose inner end that rim begins if the open share is not known.
const UNKNOWN_RIM: f64 = 0.9;

/// The probability with which a ray should be intersected. It is proportional to the root mean
/// square of its correction. A correction differs from 0 mostly if there is an edge between the two
/// rays, whose probability is proportional to their distance, so the root mean square grows as the
/// root of it. `size` is the size of the ray's color, and `distance` is in radians.
pub(super) fn probability(size: f64, distance: f64) -> f64 {
    (size * (distance / FAR + MIN_DISTANCE).sqrt()).clamp(1e-3, 1.0)
}

/// The distance between the directions of two rays, each in a lane of a packet, in radians.
#[inline(always)]
pub(super) fn distance([a, b]: [&ExitRays; 2], [i, j]: [usize; 2]) -> f64 {
    let apart = |axis: usize| a.rays.direction[axis][i] - b.rays.direction[axis][j];
    let squares = [0, 1, 2].map(|axis| f64::from(apart(axis) * apart(axis)));
    squares.iter().sum::<f64>().sqrt()
}

/// Rays of further wavelengths, whose radiance may differ from that of the main ray of their
/// sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpectralCorrections {
    /// The rays.
    pub rays: CameraRays,
    /// For each ray, the number of the main ray of its sample in the batch that is shaded.
    pub firsts: Vec<u32>,
    /// Random numbers that are independent of the choice of the rays.
    uniform: Vec<f64>,
    traced: TracedSamples,
}

/// The rays of the samples of a batch in front of the lens.
#[derive(Clone, Debug, Default)]
struct TracedSamples {
    /// The samples of each hero set.
    of_set: [Vec<AimedSample>; SETS],
    /// The rays, and the number of packets in use.
    packets: Vec<ExitRays>,
    used: usize,
    /// For each sample, the number of its main ray, and at the other wavelengths the place in
    /// `chosen`; [`NONE`] for a ray that was not chosen or is lost.
    of_sample: Vec<[u32; HERO]>,
    /// The rays of other wavelengths that may correct a main ray.
    chosen: Vec<(Chosen, u32)>,
    /// The rays of other wavelengths whose main ray is lost.
    alone: Vec<LoneRay>,
}

/// The place of no ray.
const NONE: u32 = u32::MAX;

/// A ray of another wavelength whose main ray is lost.
#[derive(Clone, Copy, Debug)]
struct LoneRay {
    sample: u32,
    /// The number of its wavelength among those of all sets.
    line: u32,
    /// Its number among the traced rays.
    number: u32,
}

impl TracedSamples {
    fn clear(&mut self, samples: usize) {
        self.used = 0;
        self.of_set.iter_mut().for_each(Vec::clear);
        self.of_sample.clear();
        self.of_sample.resize(samples, [NONE; HERO]);
        self.chosen.clear();
        self.alone.clear();
    }

    /// The next packet, to be filled completely.
    fn next(&mut self) -> &mut ExitRays {
        if self.used == self.packets.len() {
            self.packets.push(ExitRays::default());
        }
        self.used += 1;
        &mut self.packets[self.used - 1]
    }

    /// The packet of a ray, and its lane.
    #[inline(always)]
    fn place(&self, number: u32) -> (&ExitRays, usize) {
        let number = number as usize;
        (&self.packets[number / LANES], number % LANES)
    }

    /// The packet of a ray, and its lane; none if it is lost.
    #[inline(always)]
    fn ray(&self, number: u32) -> Option<(&ExitRays, usize)> {
        let (packet, lane) = self.place(number);
        (packet.rays.mask >> lane & 1 == 1).then_some((packet, lane))
    }
}

impl SpectralCorrections {
    /// Removes all rays and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.firsts.clear();
        self.uniform.clear();
    }

    /// Copies the rays to be shaded to `accepted`, and subtracts their share from their main rays
    /// in `rays`. `is_unlike` returns whether a correction hits another surface than its main ray.
    pub(crate) fn accept(
        &self,
        is_unlike: impl Fn(usize) -> bool,
        rays: &mut CameraRays,
        accepted: &mut CameraRays,
    ) {
        accepted.clear();
        for (number, (first, uniform)) in zip(&self.firsts, &self.uniform).enumerate() {
            let probability = match is_unlike(number) {
                true => 1.0,
                false => SAME_SURFACE_PROBABILITY,
            };
            if *uniform >= probability {
                continue;
            }
            let color = self.rays.colors[number];
            let factor = color.factor / probability;
            rays.colors.push(ColorFactor {
                number: *first,
                factor: -factor,
                ..color
            });
            let (packet, lane) = (&self.rays.packets()[number / LANES], number % LANES);
            accepted.push_colored(packet.samples[lane], packet.ray(lane), color.line, factor);
        }
    }

    /// Corrects the radiance of a main ray at another wavelength: appends a change of the main
    /// ray's factor to `rays`, and a ray to be intersected. `line` is the number of the wavelength
    /// and the size of its color.
    #[inline(always)]
    fn correct(
        &mut self,
        main: &MainRay<'_>,
        (line, size): (u32, f64),
        chosen: &Chosen,
        other: Option<(&ExitRays, usize)>,
        rays: &mut CameraRays,
    ) {
        let own = main.packet.weights[main.lane];
        let weight = other.map_or(0.0, |(packet, lane)| packet.weights[lane] * chosen.factor);
        if weight != own {
            rays.colors.push(ColorFactor {
                number: main.number,
                line,
                factor: (weight - own) / chosen.probability,
            });
        }
        let Some((packet, lane)) = other else { return };
        let distance = distance([main.packet, packet], [main.lane, lane]);
        let both = probability(size, distance).min(chosen.probability);
        let place = chosen.uniform * chosen.probability;
        if place < both {
            self.uniform.push(place / both);
            self.firsts.push(main.number);
            self.rays
                .push_colored(main.sample, packet.ray(lane), line, weight / both);
        }
    }
}

/// The main ray of a sample.
struct MainRay<'a> {
    packet: &'a ExitRays,
    /// Its lane in the packet.
    lane: usize,
    /// Its number among the rays that continue into the scene.
    number: u32,
    /// The number of the sample.
    sample: u32,
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
        let mut traced = std::mem::take(&mut corrections.traced);
        traced.clear(samples.len());
        let mut of_set = std::mem::take(&mut traced.of_set);
        for (sample, wavelength) in samples.wavelength.iter().enumerate() {
            let at = |all: &[Vec<f64>; 2]| [all[0][sample], all[1][sample]];
            let [x, y] = at(&samples.film);
            of_set[split(*wavelength).0].push(AimedSample {
                film: film_point(self.format, x, y).to_array(),
                pupil: at(&samples.pupil),
                sample,
            });
        }
        let mut tracing = SetTracing {
            camera: self,
            lenses,
            wavelengths: &samples.wavelength,
            bundle,
            out: &mut traced,
            others: Default::default(),
            passed: 0,
        };
        for (set, members) in of_set.iter().enumerate() {
            tracing.trace_main(set, members);
            tracing.trace_others(set);
        }
        rays.passed += tracing.passed;
        traced.of_set = of_set;
        for (sample, numbers) in traced.of_sample.iter().enumerate() {
            if numbers[MAIN] == NONE {
                continue;
            }
            let (packet, lane) = traced.place(numbers[MAIN]);
            let set = split(samples.wavelength[sample]).0;
            let (number, sample) = (rays.len() as u32, sample as u32);
            rays.put(sample, packet.ray(lane), packet.weights[lane]);
            let main = MainRay {
                packet,
                lane,
                number,
                sample,
            };
            for line in OTHERS.into_iter().filter(|line| numbers[*line] != NONE) {
                let (chosen, other) = &traced.chosen[numbers[line] as usize];
                let line = ((set * HERO + line) as u32, lenses.sizes[set][line]);
                corrections.correct(&main, line, chosen, traced.ray(*other), rays);
            }
        }
        for alone in &traced.alone {
            if let Some((packet, lane)) = traced.ray(alone.number) {
                let weight = packet.weights[lane];
                rays.push_colored(alone.sample, packet.ray(lane), alone.line, weight);
            }
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

/// The choice of a ray at random.
#[derive(Clone, Copy, Debug)]
struct Chosen {
    /// The probability with which the ray is traced.
    probability: f64,
    /// A random number in [0, 1] that is independent of the choice.
    uniform: f64,
    /// The factor of the main ray's weight: the open share, if that is known.
    factor: f64,
}

/// Chooses each of the other wavelengths with its probability, by a random number in [0, 1), and
/// passes the chosen ones to `accept`.
///
/// It is systematic sampling: the probabilities are summed, and a wavelength is chosen if an
/// integer plus the random number falls into its interval of the sum. The position in the interval
/// is again a uniform random number.
#[inline(always)]
fn choose(probabilities: &[f64; HERO], uniform: f64, mut accept: impl FnMut(usize, Chosen)) {
    let (mut sum, mut next) = (0.0, uniform);
    for line in OTHERS {
        let probability = probabilities[line];
        sum += probability;
        if sum > next {
            let uniform = 1.0 - (sum - next) / probability;
            let chosen = Chosen {
                probability,
                uniform,
                factor: 1.0,
            };
            accept(line, chosen);
            next += 1.0;
        }
    }
}

/// A ray of another wavelength than the main one, to be traced through the lens.
#[derive(Clone, Copy, Debug)]
struct OtherRay {
    /// The number of its sample.
    sample: u32,
    /// The film point, in millimeters from the film's middle.
    film: [f64; 2],
    /// The point of the rear vertex plane at which the main ray was aimed, in millimeters.
    aim: [f64; 2],
    /// The area of [`Aims`].
    area: f64,
    /// The correction of the main ray; none if the main ray of this aim was lost.
    chosen: Option<Chosen>,
}

impl OtherRay {
    /// The ray to the aim of a lane.
    fn new(aimed: &AimedSample, aims: &Aims, lane: usize, chosen: Option<Chosen>) -> Self {
        Self {
            sample: aimed.sample as u32,
            film: aimed.film,
            aim: [aims.x[lane], aims.y[lane]],
            area: aims.area[lane],
            chosen,
        }
    }
}

/// Traces samples through the lenses of their sets.
struct SetTracing<'a> {
    camera: &'a LensCamera,
    lenses: &'a SpectralLenses,
    /// The numbers that determine the wavelengths of the samples.
    wavelengths: &'a [f64],
    bundle: &'a mut Bundle,
    out: &'a mut TracedSamples,
    /// The rays of the set at hand that are to be traced at each wavelength.
    others: [Vec<OtherRay>; HERO],
    /// The number of samples whose first main ray gets through.
    passed: usize,
}

impl SetTracing<'_> {
    /// Traces the main rays of the samples of a set, and chooses their other rays.
    fn trace_main(&mut self, set: usize, samples: &[AimedSample]) {
        let (mut lanes, mut aims) = (FilmSamples::default(), Aims::default());
        let lenses = self.lenses;
        let transmission = &lenses.aiming(set, self.camera).transmission;
        let mut lost: Vec<AimedSample> = Vec::new();
        for round in 0..=ROUNDS {
            let again = std::mem::take(&mut lost);
            let members = if round == 0 { samples } else { &again };
            for chunk in members.chunks(LANES) {
                lanes.take(chunk);
                lenses
                    .target
                    .aims(&lanes.film, &lanes.pupil, transmission, &mut aims);
                let known = aims.known_shares();
                let through = self.trace([set, MAIN], &lanes, &aims);
                for (lane, aimed) in chunk.iter().enumerate() {
                    let is = |mask: u32| mask >> lane & 1 == 1;
                    if is(through) {
                        self.note(set, lane, aimed, &aims);
                        self.passed += usize::from(round == 0);
                        continue;
                    }
                    if round == 0 && aims.area[lane] > 0.0 {
                        for line in OTHERS {
                            self.others[line].push(OtherRay::new(aimed, &aims, lane, None));
                        }
                    }
                    if is(known) {
                        lost.push(*aimed);
                    }
                }
            }
            lost.iter_mut().for_each(|lost| lost.aim_again(round));
        }
    }

    /// Notes the main ray of a sample, in a lane of the last packet, and chooses its other rays.
    #[inline(always)]
    fn note(&mut self, set: usize, lane: usize, aimed: &AimedSample, aims: &Aims) {
        let share = Some(aims.open_share[lane]).filter(|share| *share > 0.0);
        let (last, factor) = (self.out.used - 1, share.unwrap_or(1.0));
        self.out.packets[last].weights[lane] *= factor;
        self.out.of_sample[aimed.sample][MAIN] = (last * LANES + lane) as u32;
        let rim = share.map_or(UNKNOWN_RIM, |share| share - RIM);
        let probabilities = match aimed.pupil[1] > rim {
            true => &[1.0; HERO],
            false => self
                .lenses
                .aiming(set, self.camera)
                .probabilities(aimed.film),
        };
        let uniform = split(self.wavelengths[aimed.sample]).1;
        choose(probabilities, uniform, |line, chosen| {
            let chosen = Some(Chosen { factor, ..chosen });
            self.others[line].push(OtherRay::new(aimed, aims, lane, chosen));
        });
    }

    /// Traces the other rays that were chosen for the samples of a set.
    fn trace_others(&mut self, set: usize) {
        let (mut lanes, mut aims) = (FilmSamples::default(), Aims::default());
        for line in OTHERS {
            let mut others = std::mem::take(&mut self.others[line]);
            for chunk in others.chunks(LANES) {
                lanes.count = chunk.len();
                for (lane, other) in chunk.iter().enumerate() {
                    [lanes.film[0][lane], lanes.film[1][lane]] = other.film;
                    [aims.x[lane], aims.y[lane]] = other.aim;
                    aims.area[lane] = other.area;
                }
                self.trace([set, line], &lanes, &aims);
                let first = (self.out.used - 1) * LANES;
                for (number, other) in (first as u32..).zip(chunk) {
                    let sample = other.sample;
                    let Some(chosen) = other.chosen else {
                        let line = (set * HERO + line) as u32;
                        self.out.alone.push(LoneRay {
                            sample,
                            line,
                            number,
                        });
                        continue;
                    };
                    self.out.of_sample[sample as usize][line] = self.out.chosen.len() as u32;
                    self.out.chosen.push((chosen, number));
                }
            }
            others.clear();
            self.others[line] = others;
        }
    }

    /// Traces aims at a wavelength of a set, adds the packet to those traced, and returns a mask of
    /// the rays that get through.
    fn trace(&mut self, [set, line]: [usize; 2], lanes: &FilmSamples, aims: &Aims) -> u32 {
        let lens = &self.lenses.lenses[set][line];
        let mut transmittances = self.camera.transmittances(lens);
        let dimming = transmittances.as_mut();
        let out = self.out.next();
        self.camera
            .trace(lens, lanes, aims, self.bundle, dimming, out);
        out.rays.mask
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::camera::Aim;
    use crate::film::FilmFormat;
    use crate::lens::{Coating, FocusMethod, Iris, Lens};
    use crate::math::Meters;
    use crate::pose::CameraPose;
    use crate::sampling::{Sampler, SamplerKind};

    /// The mean position in an interval is 1/2, and each wavelength is chosen as often as its
    /// probability says.
    #[test]
    fn a_wavelength_is_chosen_with_its_probability_and_a_position_is_uniform() {
        const STEPS: u32 = 20_000;
        for probabilities in [[0.2, 0.7, 0.0, 0.4], [1.0; HERO], [0.01, 0.02, 0.0, 1.0]] {
            let (mut counts, mut sums) = ([0.0; HERO], [0.0; HERO]);
            for step in 0..STEPS {
                let uniform = (f64::from(step) + 0.5) / f64::from(STEPS);
                choose(&probabilities, uniform, |line, chosen| {
                    assert!((0.0..=1.0).contains(&chosen.uniform));
                    assert_eq!(chosen.probability, probabilities[line]);
                    counts[line] += 1.0 / f64::from(STEPS);
                    sums[line] += chosen.uniform / f64::from(STEPS);
                });
            }
            for line in OTHERS {
                let (p, mean) = (probabilities[line], sums[line] / counts[line]);
                assert!((counts[line] - p).abs() < 2e-4, "{line}: {counts:?}");
                assert!((mean - 0.5).abs() < 0.01, "{line}: {mean}");
            }
        }
    }

    /// The camera behind a lens that is focused at infinity, at several wavelengths.
    fn camera(lens: Lens) -> LensCamera {
        let focus = lens.focus(FocusMethod::Film, Meters(f64::INFINITY));
        let pose = CameraPose::view_all(Default::default(), 1.5);
        LensCamera::new(
            lens,
            focus.unwrap(),
            FilmFormat::STANDARD,
            Aim::ExitPupil,
            &pose,
        )
        .dispersing()
    }

    /// A scene whose radiance in a direction is nowhere even.
    fn radiance([x, y, z]: [f32; 3]) -> DVec3 {
        let wave = |phase: f32| f64::from((30.0 * x + 47.0 * y + phase + z).sin());
        DVec3::new(1.0 + wave(0.0), 1.0 + 0.7 * wave(1.0), 1.2 + wave(4.0))
    }

    /// The colors of samples by the rays of the main wavelength, with corrections.
    fn fast(camera: &LensCamera, samples: &Samples) -> Vec<DVec3> {
        let lenses = camera.spectral.as_ref().unwrap();
        let (mut bundle, mut rays) = (Bundle::default(), CameraRays::default());
        let (mut corrections, mut accepted) =
            (SpectralCorrections::default(), CameraRays::default());
        camera.shoot_by_wavelength(lenses, samples, &mut bundle, &mut rays, &mut corrections);
        corrections.accept(|number| number % 2 == 0, &mut rays, &mut accepted);
        let mut sums = vec![DVec3::ZERO; samples.len()];
        for rays in [&rays, &accepted] {
            let mut add = |number: usize, color: DMat3| {
                let (packet, lane) = (&rays.packets()[number / LANES], number % LANES);
                sums[packet.samples[lane] as usize] += color * radiance(packet.ray(lane).1);
            };
            for number in 0..rays.len() {
                let (packet, lane) = (&rays.packets()[number / LANES], number % LANES);
                add(number, DMat3::IDENTITY * packet.weights[lane]);
            }
            for color in &rays.colors {
                add(
                    color.number as usize,
                    lenses.color(color.line) * color.factor,
                );
            }
        }
        sums
    }

    /// The color of a sample whose rays of all wavelengths are traced, none again.
    fn plain(camera: &LensCamera, samples: &Samples, sample: usize) -> DVec3 {
        let lenses = camera.spectral.as_ref().unwrap();
        let [film, pupil] =
            [&samples.film, &samples.pupil].map(|at| [at[0][sample], at[1][sample]]);
        let film = camera.film_point(film[0], film[1]);
        let window = lenses.target.window(film);
        let set = split(samples.wavelength[sample]).0;
        let mut sum = DVec3::ZERO;
        for (lens, line) in zip(&lenses.lenses[set], &lenses.sets[set]) {
            if let Some(ray) = camera.ray_through(lens, film, &window, pupil) {
                let direction = ray.direction.as_vec3().to_array();
                sum += line.color * radiance(direction) * ray.weight;
            }
        }
        sum
    }

    /// The mean of the fast path is that of tracing every wavelength of random samples, by a z-test
    /// of the differences for each color. A correct program exceeds 4.5 in any of the 27 tests in
    /// one of 5,000 runs; the seeds are fixed. The open share is known to 3e-4
    /// (`lens::pupil::transmission`).
    #[test]
    fn the_mean_is_that_of_tracing_all_wavelengths_of_every_sample() {
        const N: u32 = 1 << 15;
        let named = |name: &str| Lens::named(name).unwrap();
        let lenses = [
            named("takumar-50"),
            named("flektogon").with_coating(Coating::MagnesiumFluoride),
            named("tessar").with_iris(Iris::Blades {
                count: 6,
                rotation: 0.0,
            }),
        ];
        for camera in lenses.map(camera) {
            for film in [[0.5, 0.5], [0.15, 0.8], [0.02, 0.03]] {
                let sampler = Sampler {
                    kind: SamplerKind::Random,
                    samples: N,
                    seed: 5,
                };
                let pixel = sampler.pixel(0, [0, 0]);
                let (mut sum, mut squares, mut known) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
                for first in (0..N).step_by(1 << 10) {
                    let indices = first..first + (1 << 10);
                    let mut samples = Samples::default();
                    samples.request(&pixel, indices.clone());
                    samples.draw();
                    samples.film = film.map(|at| vec![at; indices.len()]);
                    samples.wavelength = indices.map(|index| pixel.wavelength(index)).collect();
                    for (sample, fast) in fast(&camera, &samples).into_iter().enumerate() {
                        let plain = plain(&camera, &samples, sample);
                        let off = fast - plain;
                        (sum, squares, known) = (sum + off, squares + off * off, known + plain);
                    }
                }
                let n = f64::from(N);
                let (mean, known) = (sum / n, known / n);
                let error = ((squares / n - mean * mean) / n).map(f64::sqrt);
                let name = camera.lens.name();
                for axis in 0..3 {
                    assert!(
                        mean[axis].abs() < 4.5 * error[axis] + 3e-4 * known[axis],
                        "{name} {film:?}: {mean} ± {error} of {known}"
                    );
                    assert!(known[axis] > 0.0, "a black film point tests nothing");
                    assert!(
                        error[axis] < 0.02 * known[axis],
                        "{name}: {error} of {known}"
                    );
                }
            }
        }
    }
}
