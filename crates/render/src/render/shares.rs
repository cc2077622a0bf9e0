//! The distribution of samples over the pixels in adaptive sampling.

use std::ops::Range;

use ivcam_optics::film::{Exposed, Resolution};
use serde::{Deserialize, Serialize};

/// For each pixel, the number of its samples over the number requested.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SampleShares {
    /// The number of samples per pixel that the shares were made for.
    samples: f64,
    /// The binary logarithm of the number of each pixel's samples; `None` is an even distribution.
    logarithms: Option<Vec<i8>>,
}

impl SampleShares {
    /// The shares of an even distribution.
    pub(super) const EVEN: Self = Self {
        samples: 1.0,
        logarithms: None,
    };

    /// The smallest share of a pixel, so that details that the pilot pass missed still receive
    /// samples. No search is recorded: a quarter of all samples is evenly distributed, and the
    /// picture has no bias with any value.
    const LEAST: f64 = 0.25;

    /// Returns whether the shares are those of a picture of this size.
    pub(super) fn fit(&self, picture: Resolution) -> bool {
        let logarithms = self.logarithms.as_ref();
        logarithms.is_none_or(|list| list.len() == picture.pixels())
    }

    /// Whether the distribution is even.
    pub(super) fn is_even(&self) -> bool {
        self.logarithms.is_none()
    }

    /// Returns the sample numbers of a pixel for a range of requested ones.
    pub(super) fn samples(&self, pixel: u32, all: &Range<u32>) -> Range<u32> {
        match &self.logarithms {
            None => all.clone(),
            Some(logarithms) => {
                let logarithm = i32::from(logarithms[pixel as usize]);
                let share = libm::ldexp(1.0, logarithm) / self.samples;
                let part = |n: u32| (f64::from(n) * share).round().max(f64::from(n.min(1))) as u32;
                part(all.start)..part(all.end)
            }
        }
    }

    /// Returns the variance of a sample of a pixel in the pilot pass; 0 if it is unknown.
    pub(super) fn variance(pixel: &Exposed) -> f32 {
        let variance = pixel.variance_of_mean().element_sum() * f64::from(pixel.count);
        let variance = variance as f32;
        if variance.is_finite() { variance } else { 0.0 }
    }

    /// Computes shares in proportion to the standard deviation of a sample, the allocation with the
    /// least error for a given sum (Neyman's). Each pixel's variance in the pilot pass is averaged
    /// with its eight neighbors', and its share of `samples` is a power of two.
    pub(super) fn of(variances: &[f32], size: Resolution, samples: u32) -> Self {
        let Resolution { width, height } = size;
        let around = |x: u32, y: u32| {
            let (rows, columns) = (
                y.saturating_sub(1)..(y + 2).min(height),
                x.saturating_sub(1)..(x + 2).min(width),
            );
            let count = f64::from((rows.end - rows.start) * (columns.end - columns.start));
            let sum: f64 = rows
                .flat_map(|y| columns.clone().map(move |x| (x, y)))
                .map(|(x, y)| f64::from(variances[(y * width + x) as usize]))
                .sum();
            (sum / count).sqrt()
        };
        // The noise is computed twice, because a list of it would be larger than the result.
        let noise = || (0..height).flat_map(|y| (0..width).map(move |x| around(x, y)));
        let mean = noise().sum::<f64>() / variances.len() as f64;
        if !(mean > 0.0) {
            return Self::EVEN;
        }
        let all = f64::from(samples);
        let share = |n: f64| Self::LEAST + (1.0 - Self::LEAST) * n / mean;
        let logarithm = |n: f64| logarithm_of_power(power_of_two(all * share(n)));
        Self {
            samples: all,
            logarithms: Some(noise().map(logarithm).collect()),
        }
    }
}

/// Rounds a positive number to a power of two, up from log₂e ≈ 1.443 times the power below, so that
/// numbers with evenly distributed logarithms keep their mean. Sobol' nets of 2^k points have the
/// least error for their number.
fn power_of_two(number: f64) -> f64 {
    let below = f64::from_bits(number.to_bits() & f64::INFINITY.to_bits());
    if number < below * std::f64::consts::LOG2_E {
        below
    } else {
        2.0 * below
    }
}

/// Returns the binary logarithm of a power of two.
fn logarithm_of_power(power: f64) -> i8 {
    ((power.to_bits() >> 52) as i32 - 1023) as i8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two_are_near_and_keep_the_mean() {
        let (mut sum, mut of) = (0.0, 0.0);
        for i in 0..8000 {
            let number = f64::exp2(f64::from(i) / 1000.0 - 2.0);
            let power = power_of_two(number);
            assert_eq!(f64::exp2(f64::from(logarithm_of_power(power))), power);
            assert!(power / number < 1.387 && number / power <= std::f64::consts::LOG2_E);
            (sum, of) = (sum + power / number, of + 1.0);
        }
        assert!(f64::abs(sum / of - 1.0) < 1e-3, "{}", sum / of);
    }
}
