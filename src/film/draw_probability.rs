//! The probabilities with which the pixels of a picture are drawn for the estimate of its error.

use super::format::Resolution;
use super::pixel::Exposed;

/// The part of the draws that is the same for every pixel.
pub(super) const EVEN: f64 = 0.15;

/// Returns the probability of each pixel to be drawn for a pair. They add up to 1.
///
/// A part follows the variance of the pixel's mean by its own samples. A part follows the variance
/// that a pixel with its number of samples would have by the samples of its neighborhood: the few
/// samples of a pixel on an edge may agree by chance, and adaptive sampling gives few samples to a
/// pixel whose noise its first look missed. The rest is even.
pub(crate) fn probabilities(picture: &[Exposed], size: Resolution) -> Vec<f64> {
    const OWN: f64 = 0.4;
    const AROUND: f64 = 0.45;
    let of_sample = variances_of_sample(picture, size);
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

/// Returns the variance of each pixel's samples, summed over channels.
///
/// The mean of the neighborhood is one sample more: the only samples of a pixel that lie all on a
/// thin bright line have no scatter, but differ from those around it.
fn variances_of_sample(picture: &[Exposed], size: Resolution) -> Vec<f64> {
    let squares = |p: &Exposed| match p.count {
        0 | 1 => 0.0,
        n => p.variance_of_mean().element_sum() * f64::from(n) * f64::from(n - 1),
    };
    let mut sum: Vec<f64> = picture.iter().map(squares).collect();
    for c in 0..3 {
        let level: Vec<f64> = picture.iter().map(|p| p.mean[c]).collect();
        for ((sum, level), mean) in sum.iter_mut().zip(&level).zip(blurred(&level, size)) {
            *sum += (level - mean) * (level - mean);
        }
    }
    for (sum, p) in sum.iter_mut().zip(picture) {
        *sum /= f64::from(p.count.max(1));
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
    use glam::DVec3;

    use super::*;

    const SIZE: Resolution = Resolution {
        width: 32,
        height: 24,
    };

    /// Returns a picture of level 1 with a column of pixels whose samples scatter.
    fn picture() -> Vec<Exposed> {
        let exposed = |i: u32| {
            let spread = if i % 32 == 9 { 0.5 } else { 0.0 };
            let mut pixel = Exposed::default();
            for off in [3.0, -1.0, -1.0, -1.0] {
                pixel.add(DVec3::splat(1.0 + spread * off));
            }
            pixel
        };
        (0..32 * 24).map(exposed).collect()
    }

    #[test]
    fn probabilities_add_up_and_follow_the_neighborhood() {
        let mut picture = picture();
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
}
