//! The choice at random of the other wavelengths at which a sample is traced.

use ivcam_base::math::lanes::{LANES, Lane, SimdKernel};
use ivcam_optics::spectrum::{HERO, MAIN, OTHERS};

/// The choice of a ray at random.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChosenCamera {
    /// The probability with which the ray is traced.
    pub probability: f64,
    /// A random number in [0, 1] that is independent of the choice.
    pub uniform: f64,
}

/// The choice of the other wavelengths of samples in lanes.
#[derive(Default)]
pub(super) struct Choices {
    /// The probability with which each wavelength is chosen.
    pub probability: [Lane; HERO],
    /// At the main wavelength a random number in [0, 1); at each other one that is chosen, a random
    /// number that is independent of the choice.
    pub uniform: [Lane; HERO],
    /// A bit mask of the samples for which each wavelength is chosen.
    pub chosen: [u32; HERO],
}

/// The kernel that chooses each of the other wavelengths with its probability.
///
/// It is systematic sampling: the probabilities are summed, and a wavelength is chosen if an
/// integer plus the random number falls into its interval of the sum. The position in the interval
/// is again a uniform random number.
pub(super) struct Choosing<'a>(pub &'a mut Choices);

impl SimdKernel for Choosing<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Choices {
            probability,
            uniform,
            chosen,
        } = self.0;
        let (mut sum, mut next) = ([0.0; LANES], uniform[MAIN]);
        for line in OTHERS {
            let mut is_chosen = [false; LANES];
            for i in 0..LANES {
                let probability = probability[line][i];
                sum[i] += probability;
                is_chosen[i] = sum[i] > next[i];
                uniform[line][i] = 1.0 - (sum[i] - next[i]) / probability;
                next[i] += if is_chosen[i] { 1.0 } else { 0.0 };
            }
            let lanes = is_chosen.iter().enumerate();
            chosen[line] = lanes.fold(0, |all, (lane, is)| all | u32::from(*is) << lane);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::lanes::{bits, dispatch};

    /// The mean position in an interval is 1/2, and each wavelength is chosen as often as its
    /// probability says.
    #[test]
    fn a_wavelength_is_chosen_with_its_probability_and_a_position_is_uniform() {
        const STEPS: u32 = 20_000;
        for probabilities in [[0.2, 0.7, 0.0, 0.4], [1.0; HERO], [0.01, 0.02, 0.0, 1.0]] {
            let (mut counts, mut sums) = ([0.0; HERO], [0.0; HERO]);
            for first in (0..STEPS).step_by(LANES) {
                let even = |lane: usize| (f64::from(first) + lane as f64 + 0.5) / f64::from(STEPS);
                let mut choices = Choices {
                    probability: probabilities.map(|p| [p; LANES]),
                    ..Choices::default()
                };
                choices.uniform[MAIN] = std::array::from_fn(even);
                dispatch(Choosing(&mut choices));
                for line in OTHERS {
                    for lane in bits(choices.chosen[line]) {
                        let uniform = choices.uniform[line][lane];
                        assert!((0.0..=1.0).contains(&uniform));
                        counts[line] += 1.0 / f64::from(STEPS);
                        sums[line] += uniform / f64::from(STEPS);
                    }
                }
            }
            for line in OTHERS {
                let (p, mean) = (probabilities[line], sums[line] / counts[line]);
                assert!((counts[line] - p).abs() < 2e-4, "{line}: {counts:?}");
                assert!((mean - 0.5).abs() < 0.01, "{line}: {mean}");
            }
        }
    }
}
