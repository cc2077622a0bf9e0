//! The error of a picture, estimated from pairs of independent exposures of some of its pixels.
//!
//! Let a pixel of the picture have the error e, and let a and b be two further exposures of the
//! pixel with samples that are independent of the picture's and of each other. Then
//! (p − a)·(p − b) has the expectation e², whatever the distribution of the samples: not the
//! variance that the method has on average, but the squared error of this picture. A bright
//! contribution that only one of the three exposures has seen multiplies a small number.
//!
//! The pixels of the pairs are drawn with probabilities that the picture determines, in
//! proportion to the scatter of their samples for the most part, so that pixels that carry much of
//! the error are nearly always drawn, often several times. The sum over all pixels is the mean of
//! the products over their probabilities (Hansen and Hurwitz, "On the theory of sampling from
//! finite populations", 1943). It is unbiased for adaptive sampling too, because the picture is
//! fixed when the pairs are drawn.

use std::fmt;

use glam::DVec3;

use super::format::Resolution;
use super::pixel::Exposed;

/// The error of a picture, as estimated from its own samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Root mean square error over the mean of the picture.
    pub relative_rmse: f64,
    /// The lower end of the 95% confidence interval.
    pub low: f64,
    /// The upper end of the 95% confidence interval.
    pub high: f64,
}

/// Why the error of a picture is unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorUnknown {
    /// The film has not been measured.
    NotMeasured,
    /// The picture is black.
    Black,
    /// The estimate has too few pairs of exposures: the picture is small, or adaptive sampling
    /// has concentrated its samples on few pixels.
    FewPairs {
        /// The number of pairs.
        pairs: usize,
    },
    /// A few pixels carry most of the estimate's variance.
    FewPixels {
        /// The number of pixels.
        pixels: usize,
        /// Their share of the variance of the estimate.
        share: f64,
    },
    /// The mean of the picture, which the error is relative to, is not known well enough.
    UncertainMean {
        /// The relative standard error of the mean.
        relative: f64,
    },
    /// A light that is small in the picture may have been missed by all samples.
    MissedLight {
        /// The area of the light in pixels.
        pixels: f64,
        /// The level of the light over the mean of the picture.
        brightness: f64,
    },
}

impl fmt::Display for ErrorUnknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotMeasured => write!(f, "not measured"),
            Self::Black => write!(f, "the picture is black"),
            Self::FewPairs { pairs } => {
                write!(f, "only {pairs} pairs of exposures estimate it")
            }
            Self::FewPixels { pixels, share } => {
                let (noun, verb) = match pixels {
                    1 => ("pixel", "carries"),
                    _ => ("pixels", "carry"),
                };
                let share = 100.0 * share;
                write!(f, "{pixels} {noun} {verb} {share:.0}% of the variance")
            }
            Self::UncertainMean { relative } => {
                let percent = 100.0 * relative;
                write!(f, "the picture's mean is uncertain by {percent:.0}%")
            }
            Self::MissedLight { pixels, brightness } => write!(
                f,
                "a light of {pixels:.1e} pixels, {brightness:.0} times as bright as the picture, \
                 may have been missed"
            ),
        }
    }
}

/// Two exposures of a pixel that are independent of the picture and of each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub pixel: u32,
    /// The probability with which the pixel was drawn.
    pub probability: f64,
    /// The levels of the two exposures.
    pub levels: [DVec3; 2],
}

/// An estimate of the squared error of a film, summed over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SquaredError {
    sum: f64,
    /// The variance of `sum` as an estimate.
    variance: f64,
    /// The degrees of freedom of `variance`.
    freedom: f64,
    /// The skewness of `sum` as an estimate.
    skewness: f64,
    /// The part of `sum` that comes from one pair, at most.
    largest: f64,
    /// The number of pairs.
    pairs: usize,
    /// The least number of pixels that carry half of `variance`, and the share that they carry.
    heaviest: (usize, f64),
    /// The light with the largest squared error that may have been missed.
    pub missed: Option<MissedLight>,
}

/// A light that is so small in the picture that no sample may have hit it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MissedLight {
    /// The area in pixels.
    pub pixels: f64,
    /// The level.
    pub level: f64,
    /// The squared error of a picture without the light, summed over channels.
    pub squared_error: f64,
}

/// The largest ratio of the ends of an interval that is stated.
const WIDEST: f64 = 4.0;
/// The least number of pairs, of which the skewness and the kurtosis can be judged.
const LEAST_PAIRS: usize = 48;
/// The largest relative standard error of the picture's mean with a stated interval.
const LARGEST_SHIFT: f64 = 0.2;
/// The squared error of a light that may have been missed, over that of the picture, from which the
/// error is unknown: it would then be 5% larger.
const MISSED_SHARE: f64 = 0.1;

impl SquaredError {
    /// Estimates the squared error of a picture, or returns `None` if there are fewer than two
    /// pairs.
    pub(crate) fn of(pairs: &[Pair], picture: &[Exposed]) -> Option<Self> {
        if pairs.len() < 2 {
            return None;
        }
        let count = pairs.len() as f64;
        let value = |pair: &Pair| {
            let level = picture[pair.pixel as usize].mean;
            let [a, b] = pair.levels.map(|other| level - other);
            a.dot(b) / pair.probability
        };
        let values: Vec<f64> = pairs.iter().map(value).collect();
        let sum = values.iter().sum::<f64>() / count;
        let squares = |v: &f64| (v - sum) * (v - sum);
        let second = values.iter().map(squares).sum::<f64>();
        let fourth = values.iter().map(|v| squares(v) * squares(v)).sum::<f64>();
        // The variance of a variance is (kurtosis − 1) of its square over the count; that of a χ²
        // variable is two over its degrees of freedom.
        let third = values.iter().map(|v| squares(v) * (v - sum)).sum::<f64>();
        let skewness = third / (second * second.sqrt());
        let kurtosis = count * fourth / (second * second);
        let freedom = 2.0 * count / (kurtosis - 1.0).max(2.0);
        Some(Self {
            sum,
            variance: second / (count * (count - 1.0)),
            freedom: if freedom.is_finite() { freedom } else { count },
            skewness: if skewness.is_finite() { skewness } else { 0.0 },
            largest: values.iter().copied().fold(0.0, f64::max) / count,
            pairs: pairs.len(),
            heaviest: heaviest(pairs, values.iter().map(squares), second),
            missed: None,
        })
    }

    /// Returns the squared error of the weighted sum of two films with independent errors.
    /// `overlap` is the sum over pixels of the products of their squared errors.
    pub(crate) fn join(&self, other: &Self, share: f64, overlap: f64) -> Self {
        let [a, b] = [1.0 - share, share].map(|part| part * part);
        let variances = [a * a * self.variance, b * b * other.variance];
        let both = variances[0] + variances[1];
        let freedom = both * both
            / (variances[0] * variances[0] / self.freedom
                + variances[1] * variances[1] / other.freedom);
        let more = variances[1] > variances[0];
        Self {
            sum: a * self.sum + b * other.sum,
            // The errors of two films have products of their own, with mean 0.
            variance: both + 4.0 * a * b * overlap,
            freedom: if freedom.is_finite() {
                freedom
            } else {
                self.freedom
            },
            skewness: self.skewness.max(other.skewness),
            largest: (a * self.largest).max(b * other.largest),
            pairs: self.pairs + other.pairs,
            heaviest: if more { other.heaviest } else { self.heaviest },
            missed: self.missed.or(other.missed),
        }
    }

    /// Returns the sum of squared errors.
    pub(crate) fn sum(&self) -> f64 {
        self.sum
    }

    /// Returns the relative error of a picture with a number of pixels and a mean.
    ///
    /// The interval is Student's, symmetric in the logarithm, and extended upward if the estimate
    /// is skewed (Johnson, "Modified t tests and confidence intervals for asymmetrical
    /// populations", 1978). The mean has an error too, whose variance is at most the sum of squared
    /// errors over 3 N².
    ///
    /// # Errors
    /// Returns the reason if no interval can be stated.
    pub(crate) fn relative(&self, pixels: usize, mean: f64) -> Result<ErrorEstimate, ErrorUnknown> {
        if !(mean > 0.0) {
            return Err(ErrorUnknown::Black);
        }
        let pixels = pixels as f64;
        let scatter = self.variance.sqrt() / self.sum;
        let shift = (self.sum.max(0.0) / 3.0).sqrt() / (pixels * mean);
        if let Some(light) = self.missed
            && light.squared_error > MISSED_SHARE * self.sum
        {
            return Err(ErrorUnknown::MissedLight {
                pixels: light.pixels,
                brightness: light.level / mean,
            });
        }
        if shift > LARGEST_SHIFT {
            return Err(ErrorUnknown::UncertainMean { relative: shift });
        }
        if self.pairs < LEAST_PAIRS {
            return Err(ErrorUnknown::FewPairs { pairs: self.pairs });
        }
        // The factor is half, because the error is the root of the sum.
        let quantile = student(self.freedom);
        let reach = (0.5 * quantile * scatter).hypot(1.96 * shift);
        // A skewed estimate is more often too low: a pair like the largest may have been missed.
        // The interval that is symmetric in the logarithm contains a part of Johnson's shift.
        let johnson = (1.0 / 6.0 + quantile * quantile / 3.0) * self.skewness * scatter;
        let unseen = libm::log1p(self.largest / self.sum);
        let more = 0.5 * (johnson - 0.5 * (quantile * scatter).powi(2)).max(unseen);
        if !(self.sum > 0.0 && 2.0 * reach + more <= libm::log(WIDEST)) {
            let (pixels, share) = self.heaviest;
            return Err(ErrorUnknown::FewPixels { pixels, share });
        }
        let rmse = (self.sum / (3.0 * pixels)).sqrt() / mean;
        Ok(ErrorEstimate {
            relative_rmse: rmse,
            low: rmse * libm::exp(-reach),
            high: rmse * libm::exp(reach + more),
        })
    }
}

/// Returns the least number of pixels that carry half of a sum of squares, and their share of it.
fn heaviest(pairs: &[Pair], squares: impl Iterator<Item = f64>, all: f64) -> (usize, f64) {
    let mut of_pixels: Vec<(u32, f64)> = Vec::new();
    for (pair, square) in pairs.iter().zip(squares) {
        match of_pixels.last_mut() {
            Some(last) if last.0 == pair.pixel => last.1 += square,
            _ => of_pixels.push((pair.pixel, square)),
        }
    }
    of_pixels.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut sum = 0.0;
    for (i, (_, square)) in of_pixels.iter().enumerate() {
        sum += square;
        if sum >= 0.5 * all {
            return (i + 1, sum / all);
        }
    }
    (of_pixels.len(), 1.0)
}

/// Returns the 97.5% quantile of Student's distribution: exact for 1 and 2 degrees of freedom, and
/// Cornish and Fisher's expansion from 3, which is right to 1%.
pub(crate) fn student(freedom: f64) -> f64 {
    if freedom <= 2.0 {
        // The quantiles of 1 and 2 degrees of freedom, and a line between them.
        return 12.706 + (4.303 - 12.706) * (freedom - 1.0).clamp(0.0, 1.0);
    }
    let z: f64 = 1.959_964;
    let (z3, z5) = (z.powi(3), z.powi(5));
    let first = (z3 + z) / 4.0;
    let second = (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / 384.0;
    z + first / freedom + second / freedom.powi(2) + third / freedom.powi(3)
}

/// Returns the probability of each pixel to be drawn for a pair. They add up to 1.
///
/// A part follows the variance of the pixel's mean by its own samples. A part follows the variance
/// that a pixel with its number of samples would have by the samples of its neighborhood: the few
/// samples of a pixel on an edge may agree by chance, and adaptive sampling gives few samples to a
/// pixel whose noise its first look missed. The rest is even.
pub(crate) fn probabilities(picture: &[Exposed], size: Resolution) -> Vec<f64> {
    const OWN: f64 = 0.4;
    const AROUND: f64 = 0.45;
    const EVEN: f64 = 0.15;
    let mut of_sample: Vec<f64> = picture.iter().map(variance_of_sample).collect();
    if picture.iter().any(|p| p.count < 2) {
        let differences = differences(picture, size);
        for ((variance, difference), p) in of_sample.iter_mut().zip(differences).zip(picture) {
            if p.count < 2 {
                *variance = difference;
            }
        }
    }
    let count = |p: &Exposed| f64::from(p.count.max(1));
    let around = blurred(&of_sample, size);
    let own = || of_sample.iter().zip(picture).map(|(v, p)| v / count(p));
    let around = || around.iter().zip(picture).map(|(v, p)| v / count(p));
    let (sum, sum_around) = (own().sum::<f64>(), around().sum::<f64>());
    let pixels = picture.len() as f64;
    if !(sum > 0.0 && sum_around > 0.0 && sum.is_finite()) {
        return vec![1.0 / pixels; picture.len()];
    }
    let [a, b, c] = [OWN / sum, AROUND / sum_around, EVEN / pixels];
    let both = own().zip(around());
    both.map(|(own, around)| a * own + b * around + c).collect()
}

/// Returns the variance of a pixel's samples, summed over channels, or 0 for fewer than two.
fn variance_of_sample(pixel: &Exposed) -> f64 {
    match pixel.count {
        0 | 1 => 0.0,
        n => pixel.variance_of_mean().element_sum() * f64::from(n),
    }
}

/// Returns the squared difference of each pixel from the mean of its neighborhood.
fn differences(picture: &[Exposed], size: Resolution) -> Vec<f64> {
    let channel = |c: usize| picture.iter().map(|p| p.mean[c]).collect::<Vec<f64>>();
    let mut sum = vec![0.0; picture.len()];
    for c in 0..3 {
        let level = channel(c);
        for ((sum, level), mean) in sum.iter_mut().zip(&level).zip(blurred(&level, size)) {
            *sum += (level - mean) * (level - mean);
        }
    }
    sum
}

/// Returns the means over squares of three by three pixels; beyond the edge a row repeats.
fn blurred(values: &[f64], size: Resolution) -> Vec<f64> {
    let (width, height) = (size.width as usize, size.height as usize);
    let mut across = Vec::with_capacity(values.len());
    for row in values.chunks_exact(width.max(1)) {
        let right = row.iter().skip(1).chain(row.last());
        let left = row.first().into_iter().chain(row);
        across.extend(left.zip(row).zip(right).map(|((a, b), c)| a + b + c));
    }
    let row = |y: usize| across[y * width..(y + 1) * width].iter();
    let mut out = Vec::with_capacity(values.len());
    for y in 0..height {
        let (above, below) = (row(y.saturating_sub(1)), row((y + 1).min(height - 1)));
        let sums = above.zip(row(y)).zip(below);
        out.extend(sums.map(|((a, b), c)| (a + b + c) / 9.0));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{mix, unit};

    /// Returns a number with mean 0 and variance 1 that is nearly normal.
    fn normal(key: u64) -> f64 {
        let sum: f64 = (0..12).map(|i| unit(mix(key ^ mix(i)))).sum();
        sum - 6.0
    }

    const SIZE: Resolution = Resolution {
        width: 32,
        height: 24,
    };

    /// Returns a picture of level 1 with errors of given standard deviations, and the sum of its
    /// squared errors. Each pixel has the scatter that belongs to its error.
    fn picture(seed: u64, deviation: impl Fn(u64) -> f64) -> (Vec<Exposed>, f64) {
        let mut sum = 0.0;
        let exposed = |i: u64| {
            let off = deviation(i) * normal(mix(seed) ^ i);
            sum += 3.0 * off * off;
            let mut pixel = Exposed::default();
            for k in 0..4 {
                let spread = deviation(i) * [3.0, -1.0, -1.0, -1.0][k];
                pixel.add(DVec3::splat(1.0 + off + spread));
            }
            pixel
        };
        let pixels = (0..32 * 24).map(exposed).collect();
        (pixels, sum)
    }

    /// Draws pairs whose exposures have twice the picture's variance.
    fn pairs(
        seed: u64,
        count: u64,
        picture: &[Exposed],
        deviation: impl Fn(u64) -> f64,
    ) -> Vec<Pair> {
        let probabilities = probabilities(picture, SIZE);
        let draw = |number: u64| {
            let mut left = (number as f64 + unit(mix(seed))) / count as f64;
            let pixel = probabilities.iter().position(|p| {
                left -= p;
                left < 0.0
            });
            let pixel = pixel.unwrap_or(picture.len() - 1) as u64;
            let level = |half: u64| {
                let key = mix(seed ^ 0xabcd) ^ mix(2 * number + half);
                DVec3::splat(1.0 + std::f64::consts::SQRT_2 * deviation(pixel) * normal(key))
            };
            Pair {
                pixel: pixel as u32,
                probability: probabilities[pixel as usize],
                levels: [level(0), level(1)],
            }
        };
        (0..count).map(draw).collect()
    }

    /// Counts the pictures, of 200, whose interval holds the error, and those of unknown error.
    fn held(deviation: impl Fn(u64) -> f64 + Copy) -> (usize, usize) {
        let (mut held, mut unknown) = (0, 0);
        for seed in 0..200 {
            let (picture, sum) = picture(seed, deviation);
            let pairs = pairs(seed, 256, &picture, deviation);
            let error = SquaredError::of(&pairs, &picture).unwrap();
            let truth = (sum / (3.0 * picture.len() as f64)).sqrt();
            match error.relative(picture.len(), 1.0) {
                Ok(e) => held += usize::from(e.low <= truth && truth <= e.high),
                Err(_) => unknown += 1,
            }
        }
        (held, unknown)
    }

    /// 95% of 200 are 190 ± 3.1, and a test with a p-value of 1% accepts 182 or more. The interval
    /// is extended for skewed estimates, so that up to 99% are accepted.
    #[test]
    fn the_interval_holds_the_error_for_even_and_for_concentrated_noise() {
        let even = |_: u64| 0.1;
        let on_an_edge = |i: u64| if i % 32 == 9 { 0.5 } else { 0.01 };
        for (name, (held, unknown)) in [("even", held(even)), ("edge", held(on_an_edge))] {
            assert!(
                (182..=198).contains(&held),
                "{name}: {held} held, {unknown} unknown"
            );
        }
    }

    /// Three pixels with nearly all of the error are drawn so often that it is known.
    #[test]
    fn the_error_of_three_bright_pixels_is_known() {
        let bright = |i: u64| {
            if [40, 300, 701].contains(&i) {
                9.0
            } else {
                0.01
            }
        };
        let (held, unknown) = held(bright);
        assert!(
            unknown < 40 && 10 * held >= 9 * (200 - unknown),
            "{held} {unknown}"
        );
    }

    #[test]
    fn probabilities_add_up_and_follow_the_neighborhood() {
        let (mut picture, _) = picture(1, |i| if i % 32 == 9 { 0.5 } else { 0.0 });
        // The samples of one pixel on the edge agree by chance.
        let quiet = 5 * 32 + 9;
        picture[quiet] = Exposed::default();
        (0..4).for_each(|_| picture[quiet].add(DVec3::ONE));
        let all = probabilities(&picture, SIZE);
        assert!((all.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(
            all[quiet] > 3.0 * all[quiet + 5],
            "{} {}",
            all[quiet],
            all[quiet + 5]
        );
        assert!(all[quiet + 32] > all[quiet]);
        let black = vec![Exposed::default(); 32 * 24];
        let all = probabilities(&black, SIZE);
        assert!(all.iter().all(|p| (p * 768.0 - 1.0).abs() < 1e-12));
    }

    #[test]
    fn the_errors_of_the_parts_of_an_exposure_add_up() {
        let part = |seed| {
            let (picture, _) = picture(seed, |_| 0.1);
            let pairs = pairs(seed, 400, &picture, |_| 0.1);
            SquaredError::of(&pairs, &picture).unwrap()
        };
        let (a, b) = (part(1), part(2));
        let both = a.join(&b, 0.25, 0.0);
        assert!((both.sum - (0.5625 * a.sum + 0.0625 * b.sum)).abs() < 1e-12);
        let mean = a.join(&b, 0.5, 0.0);
        assert!(mean.variance < 0.25 * a.variance.max(b.variance));
        assert!(mean.freedom > a.freedom.min(b.freedom));
    }

    #[test]
    fn an_unknown_error_says_why() {
        let (picture, _) = picture(1, |_| 0.1);
        let all = pairs(1, 256, &picture, |_| 0.1);
        let error = SquaredError::of(&all, &picture).unwrap();
        assert_eq!(error.relative(768, 0.0), Err(ErrorUnknown::Black));
        let mut missed = error;
        missed.missed = Some(MissedLight {
            pixels: 0.02,
            level: 500.0,
            squared_error: error.sum,
        });
        let text = missed.relative(768, 1.0).unwrap_err().to_string();
        assert!(
            text.contains("2.0e-2 pixels, 500 times as bright"),
            "{text}"
        );
        let few = SquaredError::of(&all[..20], &picture).unwrap();
        let text = few.relative(768, 1.0).unwrap_err().to_string();
        assert_eq!(text, "only 20 pairs of exposures estimate it");
        let one = ErrorUnknown::FewPixels {
            pixels: 3,
            share: 0.6,
        };
        assert_eq!(one.to_string(), "3 pixels carry 60% of the variance");
        assert!(error.relative(1, 0.1).is_err());
    }

    #[test]
    fn the_quantiles_are_those_of_the_table() {
        for (freedom, quantile) in [
            (1.0, 12.706),
            (2.0, 4.303),
            (3.0, 3.182),
            (5.0, 2.571),
            (10.0, 2.228),
            (100.0, 1.984),
        ] {
            let off = student(freedom) / quantile - 1.0;
            assert!(off.abs() < 0.02, "{freedom}: {off}");
        }
    }
}
