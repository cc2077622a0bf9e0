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
//! A sample whose main ray is lost is aimed again as in `resample`, if the unvignetted fraction of
//! the area is known at the main wavelength. Later aims are points of the main wavelength's pupil
//! alone, so the rays of the first aim that get through at other wavelengths continue as well.

use std::iter::zip;

use ivcam_base::math::lanes::{LANES, Lane, Lanes, SimdKernel, Vec3Lanes, bits, dispatch};
use ivcam_optics::lens::{Aims, Bundle, Lens};
use ivcam_optics::sampling::CameraSamples;
use ivcam_optics::spectrum::{HERO, MAIN, OTHERS, SETS};

use super::aim::film_point;
use super::choose::{Choices, Choosing, ChosenCamera};
use super::film_samples::{AimedSample, FilmSamples, ROUNDS};
use super::lens_camera::LensCamera;
use super::rays::{CameraRays, ColorFactor, ExitRays};
use super::spectral_lenses::SpectralLenses;

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
/// The share of the area at whose inner end that rim begins if the unvignetted fraction is not
/// known.
const UNKNOWN_RIM: f64 = 0.9;

/// The probability with which a ray should be intersected. It is proportional to the root mean
/// square of its correction. A correction differs from 0 mostly if there is an edge between the two
/// rays, whose probability is proportional to their distance, so the root mean square grows as the
/// root of it. `size` is the size of the ray's color, and `distance` is in radians.
pub(super) fn probability(size: f64, distance: f64) -> f64 {
    (size * (distance / FAR + MIN_DISTANCE).sqrt()).clamp(1e-3, 1.0)
}

/// The distance between the directions of the rays in a lane of two packets, in radians.
#[inline(always)]
pub(super) fn distance([a, b]: [&ExitRays; 2], lane: usize) -> f64 {
    let apart = |axis: usize| a.rays.direction[axis][lane] - b.rays.direction[axis][lane];
    let squares = [0, 1, 2].map(|axis| f64::from(apart(axis) * apart(axis)));
    squares.iter().sum::<f64>().sqrt()
}

/// Rays of further wavelengths, whose radiance may differ from that of the main ray of their
/// sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpectralCorrections {
    /// The rays, in the order of their samples.
    pub rays: CameraRays,
    /// For each ray, a random number that is independent of its choice.
    uniform: Vec<f64>,
    /// The rays in the order in which they were found.
    found: Vec<Correction>,
    /// For each sample, the place in `found` of its last ray; [`NONE`] if it has none.
    last: Vec<u32>,
    /// The samples of each hero set.
    of_set: [Vec<AimedSample>; SETS],
    /// The rays of [`SetTracing::others`].
    others: [(Vec<OtherRays>, usize); HERO],
}

/// The place of no ray.
const NONE: u32 = u32::MAX;

/// A ray of another wavelength that is to be intersected.
#[derive(Clone, Copy, Debug)]
struct Correction {
    ray: ([f32; 3], [f32; 3]),
    sample: u32,
    /// The number of its wavelength among those of all sets.
    line: u32,
    /// The factor of its radiance.
    factor: f64,
    uniform: f64,
    /// The place of the ray of its sample that was found before; [`NONE`] for the first.
    before: u32,
}

impl SpectralCorrections {
    /// Removes all rays and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.uniform.clear();
        self.found.clear();
    }

    /// Copies the rays to be shaded to `accepted`, and subtracts their share from their main rays
    /// in `rays`. `is_unlike` returns whether a correction hits another surface than its main ray;
    /// it receives their numbers in `self.rays` and `rays`.
    pub(crate) fn accept(
        &self,
        is_unlike: impl Fn(&CameraRays, [u32; 2]) -> bool,
        rays: &mut CameraRays,
        accepted: &mut CameraRays,
    ) {
        accepted.clear();
        for (color, uniform) in zip(&self.rays.colors, &self.uniform) {
            let (packet, lane) = self.rays.lane(color.number);
            let sample = packet.samples[lane];
            let probability = match is_unlike(rays, [color.number, sample]) {
                true => 1.0,
                false => SAME_SURFACE_PROBABILITY,
            };
            if *uniform >= probability {
                continue;
            }
            let factor = color.factor / probability;
            rays.colors.push(ColorFactor {
                number: sample,
                factor: -factor,
                ..*color
            });
            accepted.push_colored(sample, packet.ray(lane), color.line, factor);
        }
    }

    /// Puts the rays that were found in the order of their samples, whose neighbors are in the same
    /// pixel, so that rays in a packet are close together.
    fn order(&mut self, samples: usize) {
        self.last.clear();
        self.last.resize(samples, NONE);
        for (place, found) in (0..).zip(&mut self.found) {
            found.before = std::mem::replace(&mut self.last[found.sample as usize], place);
        }
        for last in &self.last {
            let mut place = *last;
            while let Some(found) = self.found.get(place as usize) {
                self.uniform.push(found.uniform);
                let (sample, line) = (found.sample, found.line);
                self.rays
                    .push_colored(sample, found.ray, line, found.factor);
                place = found.before;
            }
        }
    }
}

impl LensCamera {
    /// Makes the rays of samples at their wavelengths. Samples of one hero set share its lenses, so
    /// they are traced together. The main ray of each sample has the lane of its number.
    pub(super) fn shoot_by_wavelength(
        &self,
        lenses: &SpectralLenses,
        samples: &CameraSamples,
        bundle: &mut Bundle,
        rays: &mut CameraRays,
        corrections: &mut SpectralCorrections,
    ) {
        let mut of_set = std::mem::take(&mut corrections.of_set);
        of_set.iter_mut().for_each(Vec::clear);
        for (sample, wavelength) in samples.wavelength.iter().enumerate() {
            let at = |all: &[Vec<f64>; 2]| [all[0][sample], all[1][sample]];
            let [x, y] = at(&samples.film);
            of_set[split(*wavelength).0].push(AimedSample {
                film: film_point(self.format, x, y).to_array(),
                pupil: at(&samples.pupil),
                sample,
            });
        }
        rays.reserve(samples.len());
        let mut tracing = SetTracing {
            camera: self,
            lenses,
            wavelengths: &samples.wavelength,
            bundle,
            rays,
            found: &mut corrections.found,
            others: std::mem::take(&mut corrections.others),
            out: ExitRays::default(),
        };
        for (set, members) in of_set.iter().enumerate() {
            tracing.trace_main(set, members);
            tracing.trace_others(set);
        }
        corrections.others = tracing.others;
        corrections.of_set = of_set;
        corrections.order(samples.len());
    }
}

/// The hero set of a number in [0, 1), and the position of the number in the set, also in [0, 1).
pub(super) fn split(wavelength: f64) -> (usize, f64) {
    let place = wavelength * SETS as f64;
    let set = (place as usize).min(SETS - 1);
    (set, place - set as f64)
}

/// Rays of another wavelength than the main one, in lanes, to be traced through the lens.
#[derive(Clone, Debug, Default)]
struct OtherRays {
    /// The film points; the aims are not computed from these.
    film: FilmSamples,
    /// The points at which the main rays were aimed.
    aims: Aims,
    /// The numbers of the samples.
    samples: Lanes<u32>,
    /// A bit mask of the rays whose main ray of this aim was lost. They correct none.
    alone: u32,
    /// The choices of the other rays: [`ChosenCamera`].
    probability: Lane,
    uniform: Lane,
    /// The factor of the weights: the unvignetted fraction, if that is known.
    factor: Lane,
}

impl OtherRays {
    /// Appends the ray to the aim of a lane.
    #[inline(always)]
    fn push(
        &mut self,
        aimed: &AimedSample,
        (aims, from): (&Aims, usize),
        chosen: Option<ChosenCamera>,
    ) {
        let lane = self.film.count;
        self.film.count += 1;
        [self.film.film[0][lane], self.film.film[1][lane]] = aimed.film;
        self.aims.copy(lane, (aims, from));
        self.samples[lane] = aimed.sample as u32;
        self.alone |= u32::from(chosen.is_none()) << lane;
        let unvignetted = aims.unvignetted[from];
        self.factor[lane] = match chosen.is_some() && unvignetted > 0.0 {
            true => unvignetted,
            false => 1.0,
        };
        if let Some(chosen) = chosen {
            (self.probability[lane], self.uniform[lane]) = (chosen.probability, chosen.uniform);
        }
    }
}

/// The main rays of the samples in the lanes of [`OtherRays`].
#[derive(Default)]
struct MainRays {
    direction: Vec3Lanes,
    weight: Lane,
}

impl MainRays {
    /// Copies the ray of a lane of a packet to a lane.
    #[inline(always)]
    fn take(&mut self, lane: usize, (packet, from): (&ExitRays, usize)) {
        for axis in 0..3 {
            self.direction[axis][lane] = packet.rays.direction[axis][from];
        }
        self.weight[lane] = packet.weights[from];
    }
}

/// The kernel that decides which of the rays of another wavelength are intersected.
struct Correcting<'a> {
    others: &'a OtherRays,
    /// The rays after the lens.
    out: &'a ExitRays,
    main: &'a MainRays,
    /// The size of the wavelength's color.
    size: f64,
    to: &'a mut Decisions,
}

/// The decisions of [`Correcting`].
#[derive(Default)]
struct Decisions {
    /// What is added to the factor of the main ray at this wavelength.
    change: Lane,
    /// If the ray is intersected, a uniform random number; else 1 or more.
    uniform: Lane,
    /// The factor of the ray's radiance if it is intersected.
    factor: Lane,
}

impl SimdKernel for Correcting<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let (others, out, main, to) = (self.others, self.out, self.main, self.to);
        for i in 0..LANES {
            let weight = match out.rays.mask >> i & 1 {
                0 => 0.0,
                _ => out.weights[i] * others.factor[i],
            };
            let apart =
                |axis: usize| f64::from(out.rays.direction[axis][i] - main.direction[axis][i]);
            let [x, y, z] = [apart(0), apart(1), apart(2)];
            let distance = (x * x + y * y + z * z).sqrt();
            let chosen = others.probability[i];
            let both = probability(self.size, distance).min(chosen);
            to.change[i] = (weight - main.weight[i]) / chosen;
            to.uniform[i] = others.uniform[i] * chosen / both;
            to.factor[i] = weight / both;
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
    rays: &'a mut CameraRays,
    found: &'a mut Vec<Correction>,
    /// The rays of the set at hand that are to be traced at each wavelength, and the number of
    /// packets in use.
    others: [(Vec<OtherRays>, usize); HERO],
    /// The rays that were traced last.
    out: ExitRays,
}

impl SetTracing<'_> {
    /// Traces the main rays of the samples of a set, and chooses their other rays.
    fn trace_main(&mut self, set: usize, samples: &[AimedSample]) {
        let (mut lanes, mut aims) = (FilmSamples::default(), Aims::default());
        let mut main = ExitRays::default();
        let lenses = self.lenses;
        let vignetting = &lenses.aiming(set, self.camera).vignetting;
        let mut lost: Vec<AimedSample> = Vec::new();
        for round in 0..=ROUNDS {
            let again = std::mem::take(&mut lost);
            let members = if round == 0 { samples } else { &again };
            for chunk in members.chunks(LANES) {
                lanes.take(chunk);
                lenses
                    .target
                    .aims(&lanes.film, &lanes.pupil, vignetting, &mut aims);
                let known = aims.known_vignetting();
                let lens = &lenses.lenses[set][MAIN];
                self.camera
                    .trace_at(lens, &lanes, &aims, self.bundle, &mut main);
                self.accept(set, chunk, &aims, &main);
                let through = main.rays.mask;
                if round == 0 {
                    self.rays.passed += through.count_ones() as usize;
                    let missed = bits(!through).take_while(|lane| *lane < chunk.len());
                    for lane in missed.filter(|lane| aims.area[*lane] > 0.0) {
                        for line in OTHERS {
                            self.push(line, &chunk[lane], (&aims, lane), None);
                        }
                    }
                }
                let known = bits(known & !through).take_while(|lane| *lane < chunk.len());
                lost.extend(known.map(|lane| chunk[lane]));
            }
            lost.iter_mut().for_each(|lost| lost.aim_again(round));
        }
    }

    /// Accepts the main rays of samples that get through, and chooses their other rays.
    fn accept(&mut self, set: usize, samples: &[AimedSample], aims: &Aims, main: &ExitRays) {
        let aiming = self.lenses.aiming(set, self.camera);
        let mut choices = Choices::default();
        for lane in bits(main.rays.mask) {
            let aimed = &samples[lane];
            let unvignetted = Some(aims.unvignetted[lane]).filter(|known| *known > 0.0);
            let weight = main.weights[lane] * unvignetted.unwrap_or(1.0);
            self.rays.set(aimed.sample, main.ray(lane), weight);
            let rim = unvignetted.map_or(UNKNOWN_RIM, |fraction| fraction - RIM);
            let probabilities = match aimed.pupil[1] > rim {
                true => &[1.0; HERO],
                false => aiming.probabilities(aimed.film),
            };
            for line in OTHERS {
                choices.probability[line][lane] = probabilities[line];
            }
            choices.uniform[MAIN][lane] = split(self.wavelengths[aimed.sample]).1;
        }
        dispatch(Choosing(&mut choices));
        for line in OTHERS {
            for lane in bits(choices.chosen[line] & main.rays.mask) {
                let chosen = ChosenCamera {
                    probability: choices.probability[line][lane],
                    uniform: choices.uniform[line][lane],
                };
                self.push(line, &samples[lane], (aims, lane), Some(chosen));
            }
        }
    }

    /// Adds a ray to those that are to be traced at another wavelength.
    fn push(
        &mut self,
        line: usize,
        aimed: &AimedSample,
        aim: (&Aims, usize),
        chosen: Option<ChosenCamera>,
    ) {
        let (packets, used) = &mut self.others[line];
        if *used == 0 || packets[*used - 1].film.count == LANES {
            if *used == packets.len() {
                packets.push(OtherRays::default());
            }
            *used += 1;
        }
        packets[*used - 1].push(aimed, aim, chosen);
    }

    /// Traces the other rays of a set, wavelength by wavelength. What is added to a sample must
    /// have an order that does not depend on the other samples.
    fn trace_others(&mut self, set: usize) {
        for line in OTHERS {
            let (mut packets, used) = std::mem::take(&mut self.others[line]);
            for others in &mut packets[..used] {
                self.trace_packet([set, line], others);
                (others.film.count, others.alone) = (0, 0);
            }
            self.others[line] = (packets, 0);
        }
    }

    /// Traces other rays at a wavelength of a set. Chooses those that are to be intersected, and
    /// corrects the factors of their main rays.
    fn trace_packet(&mut self, [set, line]: [usize; 2], others: &OtherRays) {
        let Self {
            camera,
            lenses,
            bundle,
            rays,
            out,
            ..
        } = self;
        let lens = &lenses.lenses[set][line];
        camera.trace_at(lens, &others.film, &others.aims, bundle, out);
        let mut main = MainRays::default();
        for (lane, sample) in others.samples.iter().enumerate().take(others.film.count) {
            main.take(lane, rays.lane(*sample));
        }
        let mut to = Decisions::default();
        dispatch(Correcting {
            others,
            out,
            main: &main,
            size: lenses.sizes[set][line],
            to: &mut to,
        });
        let number = (set * HERO + line) as u32;
        for lane in 0..others.film.count {
            let (sample, is) = (others.samples[lane], |mask: u32| mask >> lane & 1 == 1);
            let is_through = is(out.rays.mask);
            if is(others.alone) {
                if is_through {
                    rays.push_colored(sample, out.ray(lane), number, out.weights[lane]);
                }
                continue;
            }
            if to.change[lane] != 0.0 {
                rays.colors.push(ColorFactor {
                    number: sample,
                    line: number,
                    factor: to.change[lane],
                });
            }
            if is_through && to.uniform[lane] < 1.0 {
                self.found.push(Correction {
                    ray: out.ray(lane),
                    sample,
                    line: number,
                    factor: to.factor[lane],
                    uniform: to.uniform[lane],
                    before: NONE,
                });
            }
        }
    }
}

impl LensCamera {
    /// Traces aims through a lens at one wavelength.
    fn trace_at(
        &self,
        lens: &Lens,
        lanes: &FilmSamples,
        aims: &Aims,
        bundle: &mut Bundle,
        out: &mut ExitRays,
    ) {
        let mut transmittances = self.transmittances(lens);
        self.trace(lens, lanes, aims, bundle, transmittances.as_mut(), out);
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::camera::Aim;
    use ivcam_base::math::Meters;
    use ivcam_inventor::pose::CameraPose;
    use ivcam_optics::film::FilmFormat;
    use ivcam_optics::lens::{Coating, FocusMethod, Iris, Lens};
    use ivcam_optics::sampling::{Sampler, SamplerKind};

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
    fn fast(camera: &LensCamera, samples: &CameraSamples) -> Vec<DVec3> {
        let lenses = camera.spectral.as_ref().unwrap();
        let (mut bundle, mut rays) = (Bundle::default(), CameraRays::default());
        let (mut corrections, mut accepted) =
            (SpectralCorrections::default(), CameraRays::default());
        camera.shoot_by_wavelength(lenses, samples, &mut bundle, &mut rays, &mut corrections);
        corrections.accept(|_, [number, _]| number % 2 == 0, &mut rays, &mut accepted);
        let mut sums = vec![DVec3::ZERO; samples.len()];
        for rays in [&rays, &accepted] {
            let mut add = |number: u32, color: DMat3| {
                let (packet, lane) = rays.lane(number);
                sums[packet.samples[lane] as usize] += color * radiance(packet.ray(lane).1);
            };
            for (first, packet) in (0..).step_by(LANES).zip(rays.packets()) {
                for lane in bits(packet.rays.mask) {
                    add(first + lane as u32, DMat3::IDENTITY * packet.weights[lane]);
                }
            }
            for color in &rays.colors {
                add(color.number, lenses.color(color.line) * color.factor);
            }
        }
        sums
    }

    /// The color of a sample whose rays of all wavelengths are traced, none again.
    fn plain(camera: &LensCamera, samples: &CameraSamples, sample: usize) -> DVec3 {
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
    /// one of 5,000 runs; the seeds are fixed. The unvignetted fraction is known
    /// to 3e-4
    /// (`lens::pupil::vignetting`).
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
                let sampler = Sampler::new(SamplerKind::Random, N, 5);
                let pixel = sampler.pixel(0, [0, 0]);
                let (mut sum, mut squares, mut known) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
                for first in (0..N).step_by(1 << 10) {
                    let indices = first..first + (1 << 10);
                    let mut samples = CameraSamples::default();
                    samples.request(&pixel, indices.clone());
                    samples.draw();
                    samples.film = film.map(|at| vec![at; indices.len()]);
                    samples.wavelength = vec![0.0; indices.len()];
                    pixel.wavelengths(first, &mut samples.wavelength);
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
