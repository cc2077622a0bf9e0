//! Rays that are lost in the margin of what is aimed at, drawn anew.
//!
//! A lost ray is a sample without light, and a hundredth of all samples is the greatest noise of
//! an even part of a picture. Where it is known how much of the figure aimed at is light
//! ([`PupilTransmission`]), a lost ray is aimed again from its film point until it gets through, and every
//! ray counts for the area of the light alone: the mean is the same, and the noise is gone.

use crate::lens::{Aims, Bundle, LANES, PupilTransmission};
use crate::sampling::mix;
use crate::scene::wide::bits;

use super::lanes::{Outside, Sheaf};
use super::{LensCamera, Shots};

/// As often a ray is aimed again: of a fifth that is lost at most, nothing is left.
const ROUNDS: u64 = 16;

/// A sample whose ray was lost: the film point, and the numbers that it was aimed by.
#[derive(Clone, Copy, Debug)]
struct Lost {
    film: [f64; 2],
    pupil: [f64; 2],
    sample: usize,
}

/// Samples to draw anew.
#[derive(Debug, Default)]
pub(super) struct Redraws {
    lost: Vec<Lost>,
}

impl Redraws {
    /// Weighs rays by the light in their figures, and takes down those that are lost, of samples
    /// from a number on.
    pub fn note(&mut self, sheaf: &Sheaf, aims: &Aims, out: &mut Outside, first: usize) {
        let mut known = 0u32;
        for (i, light) in aims.light.iter().enumerate() {
            let is_known = (*light > 0.0) & (aims.area[i] > 0.0);
            out.weight[i] *= if is_known { *light } else { 1.0 };
            known |= u32::from(is_known) << i;
        }
        let asked = u32::MAX >> (LANES - sheaf.count);
        for lane in bits(known & asked & !out.rays.mask) {
            self.lost.push(Lost {
                film: [sheaf.film[0][lane], sheaf.film[1][lane]],
                pupil: [sheaf.pupil[0][lane], sheaf.pupil[1][lane]],
                sample: first + lane,
            });
        }
    }
}

impl Lost {
    /// Other numbers, a function of those before and nothing else.
    fn aim_again(&mut self, round: u64) {
        let [x, y] = self.film.map(f64::to_bits);
        let [u, v] = self.pupil.map(f64::to_bits);
        let key = mix(mix(mix(mix(x) ^ y) ^ u) ^ v) ^ round;
        let unit = |key: u64| (mix(key) >> 11) as f64 * (1.0 / (1u64 << 53) as f64);
        self.pupil = [unit(key), unit(!key)];
    }
}

impl LensCamera {
    /// Aims again from the film points of rays that were lost, until they get through.
    pub(super) fn redraw(
        &self,
        redraws: &mut Redraws,
        light: &PupilTransmission,
        bundle: &mut Bundle,
        shots: &mut Shots,
    ) {
        let (mut sheaf, mut aims) = (Sheaf::default(), Aims::default());
        let mut out = Outside::default();
        for round in 0..ROUNDS {
            let lost = std::mem::take(&mut redraws.lost);
            for some in lost.chunks(LANES) {
                sheaf.count = some.len();
                for lane in 0..LANES {
                    let mut again = some[lane.min(some.len() - 1)];
                    again.aim_again(round);
                    for d in 0..2 {
                        sheaf.film[d][lane] = again.film[d];
                        sheaf.pupil[d][lane] = again.pupil[d];
                    }
                }
                self.target
                    .aims(&sheaf.film, &sheaf.pupil, light, &mut aims);
                self.trace(&self.lens, &sheaf, &aims, bundle, &mut out);
                let before = redraws.lost.len();
                redraws.note(&sheaf, &aims, &mut out, 0);
                for lost in &mut redraws.lost[before..] {
                    lost.sample = some[lost.sample].sample;
                }
                shots.take_some(&out, |lane| some[lane].sample);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::camera::Aim;
    use crate::film::FilmFormat;
    use crate::lens::{FocusMethod, Lens};
    use crate::math::Meters;
    use crate::pose::CameraPose;
    use crate::sampling::{Sampler, SamplerKind, Samples};

    /// No sample is without light, and all together bring the irradiance that the outline of the
    /// light gives: over 1,024 scrambled nets for each film point, to their error and 2e-4.
    #[test]
    fn every_sample_finds_light_and_the_mean_is_the_irradiance() {
        for name in ["double-gauss", "biogon", "primoplan"] {
            let lens = Lens::named(name).unwrap();
            let focus = lens
                .focus(FocusMethod::Film, Meters(f64::INFINITY))
                .unwrap();
            let pose = CameraPose::view_all(Default::default(), 1.5);
            let camera = LensCamera::new(lens, focus, FilmFormat::STANDARD, Aim::ExitPupil, &pose);
            for place in [[0.5, 0.5], [0.6, 0.35], [0.1, 0.9], [0.02, 0.03]] {
                let film: DVec2 = camera.film_point(place[0], place[1]);
                let known = camera.lens.irradiance(film, camera.focus.film_z);
                let sampler = Sampler {
                    kind: SamplerKind::Sobol,
                    samples: 64,
                    seed: 3,
                };
                let means: Vec<f64> = (0..1024)
                    .map(|pixel| {
                        let mut samples = Samples::default();
                        samples.ask(&sampler.pixel(pixel, [0, 0]), 0..64);
                        samples.draw();
                        samples.film = place.map(|at| vec![at; 64]);
                        let (mut bundle, mut shots) = (Bundle::default(), Shots::default());
                        camera.shoot(&samples, &mut bundle, &mut shots);
                        let (mut sum, mut rays) = (0.0, 0);
                        for (number, of) in shots.bundles().iter().enumerate() {
                            for lane in bits(of.mask) {
                                sum += shots.weights[number * LANES + lane];
                                rays += 1;
                            }
                        }
                        assert_eq!(rays, 64, "{name} {place:?}");
                        sum / 64.0 * camera.axial_irradiance()
                    })
                    .collect();
                let n = means.len() as f64;
                let mean = means.iter().sum::<f64>() / n;
                let square: f64 = means.iter().map(|m| (m - mean) * (m - mean)).sum();
                let error = (square / (n * (n - 1.0))).sqrt();
                assert!(
                    (mean - known).abs() < 4.5 * error + 2e-4 * known,
                    "{name} {place:?}: {mean} {known} {error}"
                );
            }
        }
    }
}
