//! Colors by their wavelengths.
//!
//! A sample sees a hero set of wavelengths (`spectrum`), whose rays start from one film point to
//! one lens point. They leave the lens on nearly the same way, and nearly always bring the same
//! light. So one of them stands for all: its radiance is seen at every wavelength that gets
//! through. What the others would bring instead is put right now and then: a ray is followed with
//! a probability that grows with its distance from the first, and the difference of the two counts
//! as often more. The mean is that of following all (a multilevel estimate: Heinrich, "Multilevel
//! Monte Carlo Methods", 2001), and most samples take one ray through the scene.

use glam::DMat3;

use crate::film::FilmFormat;
use crate::lens::{Aims, Bundle, ExitPupil, FilmPlace, LANES, Lens, PupilTarget};
use crate::sampling::Samples;
use crate::spectrum::{HERO, Line, SETS, Spectrum};

use super::lanes::{Outside, Sheaf};
use super::{LensCamera, Shots};

/// A lens at the wavelengths of every hero set.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    sets: [[Line; HERO]; SETS],
    lenses: [[Lens; HERO]; SETS],
    /// How much each wavelength matters: the root of the squares of its colors.
    sizes: [[f64; HERO]; SETS],
    /// What is aimed at, whatever the wavelength.
    target: PupilTarget,
}

/// Which ray of a set stands for all, if it gets through: those in the middle first.
const FIRST: [usize; HERO] = [2, 1, 3, 0];
/// A ray as far as this from the first, in radians, is followed as often as its color matters.
const FAR: f64 = 4e-3;
/// The same for rays that are not apart at all, so that every ray may be followed.
const LEAST: f64 = 0.02;

impl Waves {
    pub fn of(lens: &Lens, target: &PupilTarget, place: &FilmPlace, format: FilmFormat) -> Self {
        let sets = Spectrum::default().hero_sets();
        let lenses = sets
            .each_ref()
            .map(|lines| lines.each_ref().map(|line| lens.at_wavelength(line.nm)));
        let size = |line: &Line| {
            let entries = line.color.to_cols_array();
            entries.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        let target = match target {
            PupilTarget::RearElement(rear) => PupilTarget::RearElement(*rear),
            PupilTarget::ExitPupil(own) => {
                let at = |lens: &Lens| ExitPupil::new(lens, place, format.half_diagonal());
                let ends = [&lenses[0][0], &lenses[SETS - 1][HERO - 1]].map(at);
                let [blue, red] = &ends;
                PupilTarget::ExitPupil(Box::new(ExitPupil::around(&[blue, own, red])))
            }
        };
        Self {
            sizes: sets.each_ref().map(|lines| lines.each_ref().map(size)),
            sets,
            lenses,
            target,
        }
    }
}

/// A ray into the scene, and what becomes of its color.
#[derive(Clone, Copy)]
struct Followed {
    sample: usize,
    origin: [f32; 3],
    direction: [f32; 3],
    color: DMat3,
}

impl LensCamera {
    /// Samples of one set share its lenses, so they are traced together, however far apart they
    /// are; into the scene they go in their own order.
    pub(super) fn shoot_by_wavelength(
        &self,
        waves: &Waves,
        samples: &Samples,
        bundle: &mut Bundle,
        shots: &mut Shots,
    ) {
        let mut of_set: [Vec<usize>; SETS] = Default::default();
        for (i, wavelength) in samples.wavelength.iter().enumerate() {
            of_set[split(*wavelength).0].push(i);
        }
        let mut first: Vec<Option<Followed>> = vec![None; samples.len()];
        let mut more = Vec::new();
        let mut aims = Aims::default();
        for (set, members) in of_set.iter().enumerate() {
            for members in members.chunks(LANES) {
                let sheaf = Sheaf::of(self.format, samples, members);
                waves.target.aims(&sheaf.film, &sheaf.pupil, &mut aims);
                let rays = waves.lenses[set].each_ref().map(|lens| {
                    let out = self.trace(lens, &sheaf, &aims, bundle);
                    let through = bundle.through();
                    shots.passed += through.count_ones() as usize;
                    (out, through)
                });
                for (lane, sample) in members.iter().enumerate() {
                    let (_, dice) = split(samples.wavelength[*sample]);
                    let choice = Choice {
                        lines: &waves.sets[set],
                        sizes: &waves.sizes[set],
                        rays: &rays,
                        lane,
                        sample: *sample,
                    };
                    first[*sample] = choice.made(dice, &mut more);
                }
            }
        }
        more.sort_by_key(|ray: &Followed| ray.sample);
        for ray in first.iter().flatten().chain(&more) {
            shots.put(shots.len(), ray.origin, ray.direction);
            shots.samples.push(ray.sample as u32);
            shots.weights.push(1.0);
            shots.colors.push(ray.color);
        }
    }
}

/// The hero set of a number in [0, 1), and how far into it the number is.
fn split(wavelength: f64) -> (usize, f64) {
    let place = wavelength * SETS as f64;
    let set = (place as usize).min(SETS - 1);
    (set, place - set as f64)
}

/// Which rays of a sample are followed.
struct Choice<'a> {
    lines: &'a [Line; HERO],
    sizes: &'a [f64; HERO],
    rays: &'a [(Outside, u32); HERO],
    lane: usize,
    sample: usize,
}

impl Choice<'_> {
    /// The ray that stands for all, if any gets through; the others that are followed go to `more`.
    fn made(&self, dice: f64, more: &mut Vec<Followed>) -> Option<Followed> {
        let through = |i: usize| self.rays[i].1 >> self.lane & 1 == 1;
        let chosen = FIRST.into_iter().find(|i| through(*i))?;
        let mut first = self.ray(chosen);
        // Rays are picked where multiples of 1, moved by the dice, fall into a row of their
        // probabilities: each as often as it should be, and as few together as can be.
        let (mut row, mut picked) = (0.0, (0.0 - dice).ceil());
        for i in (0..HERO).filter(|i| *i != chosen && through(*i)) {
            let ray = self.ray(i);
            first.color += ray.color;
            let often = self.probability(i, chosen);
            row += often;
            let now = (row - dice).ceil();
            if now > picked {
                let color = ray.color * often.recip();
                first.color -= color;
                more.push(Followed { color, ..ray });
            }
            picked = now;
        }
        Some(first)
    }

    fn ray(&self, i: usize) -> Followed {
        let (out, lane) = (&self.rays[i].0, self.lane);
        let of = |v: &[[f32; LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        Followed {
            sample: self.sample,
            origin: of(&out.origin),
            direction: of(&out.direction),
            color: self.lines[i].color * out.weight[lane],
        }
    }

    /// How likely a ray is followed: as the root of the mean square of what it would put right.
    /// That is as likely as an edge lies between two rays, and so grows as their distance.
    fn probability(&self, i: usize, first: usize) -> f64 {
        let [a, b] = [i, first].map(|i| &self.rays[i].0);
        let apart = |axis: usize| {
            let apart = a.direction[axis][self.lane] - b.direction[axis][self.lane];
            f64::from(apart * apart)
        };
        let distance = (apart(0) + apart(1) + apart(2)).sqrt();
        let share = a.weight[self.lane] / b.weight[self.lane];
        (self.sizes[i] * share * (distance / FAR + LEAST).sqrt()).clamp(1e-3, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays that leave a lens this far apart, in radians; some are lost, and their light differs.
    #[test]
    fn over_all_dice_every_ray_counts_by_its_own_color() {
        let lines = &Spectrum::default().hero_sets()[3];
        for (apart, through) in [(1e-5, 15), (1e-3, 15), (1e-3, 0b1001), (1.0, 7), (0.1, 2)] {
            let rays = std::array::from_fn(|i| {
                let mut out = Outside::default();
                out.weight[5] = 0.5 + 0.1 * i as f64;
                out.direction[1][5] = apart * i as f32;
                (out, (through >> i & 1) << 5)
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
            let mut most = 0;
            for step in 0..STEPS {
                let mut more = Vec::new();
                let dice = (f64::from(step) + 0.5) / f64::from(STEPS);
                let first = choice.made(dice, &mut more).expect("one gets through");
                for ray in more.iter().chain([&first]) {
                    let number = (ray.direction[1] / apart).round() as usize;
                    sums[number] += ray.color * f64::from(STEPS).recip();
                }
                most = most.max(more.len());
            }
            assert!(most < through.count_ones() as usize);
            for (i, sum) in sums.iter().enumerate() {
                let own = choice.ray(i).color * f64::from(through >> i & 1);
                let off = (*sum - own).to_cols_array();
                let off = off.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                assert!(off < 1e-2, "{apart} {through:b}: ray {i} is off by {off}");
            }
        }
    }
}
