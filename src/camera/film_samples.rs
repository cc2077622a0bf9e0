//! Film points and lens points, one of each in a lane.

use crate::film::FilmFormat;
use crate::math::lanes::{LANES, Lane};
use crate::sampling::Samples;

/// Points of the film in millimeters from its middle, and points of the lens in the unit square.
#[derive(Default)]
pub(super) struct FilmSamples {
    /// The x and y of the film points.
    pub film: [Lane; 2],
    /// The coordinates of the lens points.
    pub pupil: [Lane; 2],
    /// The number of lanes that are samples. The other lanes repeat one of them.
    pub count: usize,
}

impl FilmSamples {
    /// Takes the samples with the given numbers, at most [`LANES`].
    pub(super) fn take(&mut self, format: FilmFormat, samples: &Samples, numbers: &[usize]) {
        let at = |lane: usize| numbers.get(lane).copied().unwrap_or(numbers[0]);
        self.fill(format, samples, numbers.len(), |lane, all| {
            *lane = std::array::from_fn(|i| all[at(i)]);
        });
    }

    /// Takes the samples from number `first` on.
    pub(super) fn take_from(&mut self, format: FilmFormat, samples: &Samples, first: usize) {
        let count = (samples.len() - first).min(LANES);
        self.fill(format, samples, count, |lane, all| {
            lane[count..].fill(all[first]);
            lane[..count].copy_from_slice(&all[first..first + count]);
        });
    }

    /// Copies each coordinate by `copy`, and converts film points to millimeters.
    fn fill(
        &mut self,
        format: FilmFormat,
        samples: &Samples,
        count: usize,
        copy: impl Fn(&mut Lane, &[f64]),
    ) {
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
