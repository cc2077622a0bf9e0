//! Film points and lens points, one of each in a lane.

use ivcam_base::math::lanes::{LANES, Lane};
use ivcam_optics::film::FilmFormat;
use ivcam_optics::sampling::{CameraSamples, mix, unit};

/// Retries per lost ray. If at most 20% are lost, 0.2^16 ≈ 7e-12 remain lost.
pub(super) const ROUNDS: u64 = 16;

/// A sample, its film point, and the point of the unit square that it is aimed at.
#[derive(Clone, Copy, Debug)]
pub(super) struct AimedSample {
    /// In millimeters from the film's middle.
    pub film: [f64; 2],
    pub pupil: [f64; 2],
    /// The number of the sample.
    pub sample: usize,
}

impl AimedSample {
    /// Replaces the lens point by a random one, which depends only on the film point, the last lens
    /// point and the round.
    pub(super) fn aim_again(&mut self, round: u64) {
        let [x, y] = self.film.map(f64::to_bits);
        let [u, v] = self.pupil.map(f64::to_bits);
        let key = mix(mix(mix(mix(x) ^ y) ^ u) ^ v) ^ round;
        self.pupil = [unit(mix(key)), unit(mix(!key))];
    }
}

/// Points of the film in millimeters from its middle, and points of the lens in the unit square.
#[derive(Clone, Debug, Default)]
pub(super) struct FilmSamples {
    /// The x and y of the film points.
    pub film: [Lane; 2],
    /// The coordinates of the lens points.
    pub pupil: [Lane; 2],
    /// The number of lanes that are samples. The other lanes repeat one of them.
    pub count: usize,
}

impl FilmSamples {
    /// Takes the given aims, at most [`LANES`].
    pub(super) fn take(&mut self, aimed: &[AimedSample]) {
        for lane in 0..LANES {
            let aimed = aimed.get(lane).unwrap_or(&aimed[0]);
            for d in 0..2 {
                self.film[d][lane] = aimed.film[d];
                self.pupil[d][lane] = aimed.pupil[d];
            }
        }
        self.count = aimed.len();
    }

    /// The sample of a lane, which has a number.
    pub(super) fn of_lane(&self, lane: usize, sample: usize) -> AimedSample {
        AimedSample {
            film: [self.film[0][lane], self.film[1][lane]],
            pupil: [self.pupil[0][lane], self.pupil[1][lane]],
            sample,
        }
    }

    /// Takes the samples from number `first` on.
    pub(super) fn take_from(&mut self, format: FilmFormat, samples: &CameraSamples, first: usize) {
        let count = (samples.len() - first).min(LANES);
        let copy = |lane: &mut Lane, all: &[f64]| {
            lane[count..].fill(all[first]);
            lane[..count].copy_from_slice(&all[first..first + count]);
        };
        for d in 0..2 {
            copy(&mut self.film[d], &samples.film[d]);
            copy(&mut self.pupil[d], &samples.pupil[d]);
        }
        let [x, y] = &mut self.film;
        x.iter_mut().for_each(|x| *x = (0.5 - *x) * format.width);
        y.iter_mut().for_each(|y| *y = (*y - 0.5) * format.height);
        self.count = count;
    }
}
