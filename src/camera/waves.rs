//! Colors by their wavelengths.
//!
//! A sample sees a hero set of wavelengths (`spectrum`), whose rays start from one film point to
//! one lens point. They leave the lens on nearly the same way, and nearly always bring the same
//! light. So one of them stands for all: its radiance is seen at every wavelength that gets
//! through. What the others would bring instead is put right now and then: a ray is looked at with
//! a probability that grows with its distance from the first, it is followed if it meets another
//! surface, or else now and then, and the difference of the two counts as often more. The mean is
//! that of following all (a multilevel estimate: Heinrich, "Multilevel Monte Carlo Methods",
//! 2001), and most samples take one ray through the scene.

use glam::DMat3;

use crate::film::FilmFormat;
use crate::lens::{
    Aims, Bundle, ExitPupil, FilmPlace, LANES, Lens, PupilTarget, PupilTransmission,
};
use crate::sampling::Samples;
use crate::scene::{BUNDLE, of_lane};
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
/// A ray as far as this from the first, in radians, is looked at as often as its color matters.
/// Measured to give the least time to an error, as the next two are.
const FAR: f64 = 6.4e-4;
/// What is added to the distance in parts of that, so that every ray may be looked at.
const LEAST: f64 = 0.125;
/// How often a ray is followed that meets the same surface as the first.
const ALIKE: f64 = 0.2;

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

/// Rays of wavelengths that may bring other light than the first ray of their sample.
#[derive(Clone, Debug, Default)]
pub struct Doubts {
    /// The rays, by samples as the first ones.
    pub rays: Shots,
    /// The number of each one's first among the shots.
    pub firsts: Vec<u32>,
    /// What is left of the dice that each was picked by.
    dice: Vec<f64>,
    sheaves: Vec<Traced>,
}

/// The rays of a sheaf behind the lens, by the wavelengths of a set.
#[derive(Clone, Debug)]
struct Traced {
    set: usize,
    rays: [Outside; HERO],
}

impl Doubts {
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.firsts.clear();
        self.dice.clear();
        self.sheaves.clear();
    }

    /// Puts the rays that are to be followed into `more`; their firsts no longer count for them.
    /// `unlike` tells of the number of a doubt whether it meets anything else than its first.
    pub fn settle(&self, unlike: impl Fn(usize) -> bool, shots: &mut Shots, more: &mut Shots) {
        more.clear();
        for (number, (first, dice)) in self.firsts.iter().zip(&self.dice).enumerate() {
            let often = if unlike(number) { 1.0 } else { ALIKE };
            if *dice >= often {
                continue;
            }
            let color = self.rays.colors[number] * often.recip();
            shots.colors[*first as usize] -= color;
            let (of, lane) = (&self.rays.bundles[number / BUNDLE], number % BUNDLE);
            let [origin, direction] =
                [&of.origin, &of.direction].map(|all| of_lane(all, lane).to_array());
            more.push_colored(self.rays.samples[number], origin, direction, color);
        }
    }
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
        doubts: &mut Doubts,
    ) {
        let mut of_set: [Vec<usize>; SETS] = Default::default();
        for (i, wavelength) in samples.wavelength.iter().enumerate() {
            of_set[split(*wavelength).0].push(i);
        }
        let mut places = vec![(0, 0); samples.len()];
        let (mut sheaf, mut aims) = (Sheaf::default(), Aims::default());
        let unknown = PupilTransmission::default();
        for (set, members) in of_set.iter().enumerate() {
            for members in members.chunks(LANES) {
                sheaf.take(self.format, samples, members);
                waves
                    .target
                    .aims(&sheaf.film, &sheaf.pupil, &unknown, &mut aims);
                let rays = waves.lenses[set].each_ref().map(|lens| {
                    let mut out = Outside::default();
                    self.trace(lens, &sheaf, &aims, bundle, &mut out);
                    shots.passed += out.rays.mask.count_ones() as usize;
                    out
                });
                for (lane, sample) in members.iter().enumerate() {
                    places[*sample] = (doubts.sheaves.len(), lane);
                }
                doubts.sheaves.push(Traced { set, rays });
            }
        }
        let sheaves = std::mem::take(&mut doubts.sheaves);
        for (sample, (sheaf, lane)) in places.into_iter().enumerate() {
            let Traced { set, rays } = &sheaves[sheaf];
            let choice = Choice {
                lines: &waves.sets[*set],
                sizes: &waves.sizes[*set],
                rays,
                lane,
                sample: sample as u32,
            };
            choice.make(split(samples.wavelength[sample]).1, shots, doubts);
        }
        doubts.sheaves = sheaves;
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
    rays: &'a [Outside; HERO],
    lane: usize,
    sample: u32,
}

impl Choice<'_> {
    /// The ray that stands for all goes to the shots, if any gets through, and what is looked at
    /// besides to the doubts.
    fn make(&self, dice: f64, shots: &mut Shots, doubts: &mut Doubts) {
        let through = |i: usize| self.rays[i].rays.mask >> self.lane & 1 == 1;
        let Some(chosen) = FIRST.into_iter().find(|i| through(*i)) else {
            return;
        };
        let first = shots.len() as u32;
        let mut sum = self.color(chosen);
        // Rays are picked where multiples of 1, moved by the dice, fall into a row of their
        // probabilities: each as often as it should be, and as few together as can be.
        let (mut row, mut next) = (0.0, dice);
        for i in (0..HERO).filter(|i| *i != chosen && through(*i)) {
            let color = self.color(i);
            sum += color;
            let often = self.probability(i, chosen);
            row += often;
            if row > next {
                // As far into its own part of the row as chance would have it.
                doubts.dice.push(1.0 - (row - next) / often);
                doubts.firsts.push(first);
                let (origin, direction) = self.rays[i].ray(self.lane);
                let color = color * often.recip();
                let rays = &mut doubts.rays;
                rays.push_colored(self.sample, origin, direction, color);
                next += 1.0;
            }
        }
        let (origin, direction) = self.rays[chosen].ray(self.lane);
        shots.push_colored(self.sample, origin, direction, sum);
    }

    /// What a radiance along a ray adds to the film.
    fn color(&self, i: usize) -> DMat3 {
        self.lines[i].color * self.rays[i].weight[self.lane]
    }

    /// How likely a ray is looked at: as the root of the mean square of what it would put right.
    /// That is as likely as an edge lies between two rays, and so grows as their distance.
    fn probability(&self, i: usize, first: usize) -> f64 {
        let [a, b] = [i, first].map(|i| &self.rays[i]);
        let apart = |axis: usize| {
            let [a, b] = [a, b].map(|out| out.rays.direction[axis][self.lane]);
            let apart = a - b;
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
        for (apart, through) in [
            (1e-5, 15u32),
            (1e-3, 15),
            (1e-3, 0b1001),
            (1.0, 7),
            (0.1, 2),
        ] {
            let rays = std::array::from_fn(|i| {
                let mut out = Outside::default();
                out.weight[5] = 0.5 + 0.1 * i as f64;
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
                let (mut shots, mut doubts) = (Shots::default(), Doubts::default());
                let dice = (f64::from(step) + 0.5) / f64::from(STEPS);
                choice.make(dice, &mut shots, &mut doubts);
                most = most.max(doubts.rays.len());
                for dice in &doubts.dice {
                    assert!((0.0..=1.0).contains(dice));
                    left[(4.0 * dice) as usize & 3] += 1;
                }
                let mut more = Shots::default();
                doubts.settle(|_| true, &mut shots, &mut more);
                for shots in [&shots, &more] {
                    for (number, color) in shots.colors.iter().enumerate() {
                        let ray = shots.bundles()[0].ray(number);
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
