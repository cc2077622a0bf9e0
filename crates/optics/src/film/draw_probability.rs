//! The probabilities with which the pixels of a picture are drawn for the estimate of its error.

use std::ops::{Add, Div, Range};

use glam::DVec3;
use rayon::prelude::*;

use super::format::Resolution;
use super::pixel::Exposed;

/// The part of the draws that is the same for every pixel.
pub(super) const EVEN: f64 = 0.15;

/// The part that follows a pixel's own samples, and the part that follows its neighborhood.
const OWN: f64 = 0.4;
const AROUND: f64 = 0.45;

/// The probability of each pixel to be drawn for a pair. They add up to 1.
///
/// A part follows the variance of the pixel's mean by its own samples. A part follows the variance
/// that a pixel with its number of samples would have by the samples of its neighborhood: the few
/// samples of a pixel on an edge may agree by chance, and adaptive sampling gives few samples to a
/// pixel whose noise its first look missed. The rest is even.
/// A pixel that is exposed in any case is not drawn, and its noise is not that of its neighborhood.
///
/// The probabilities are computed anew whenever they are asked for, so that a large picture needs
/// no memory for them.
pub struct DrawProbabilities<'a> {
    picture: &'a [Exposed],
    /// The indices of the pixels that are not drawn, in their order.
    exempt: &'a [u32],
    width: usize,
    /// The factors of the two variances. Both are 0 in a picture without any.
    factors: [f64; 2],
    /// The part that is the same for every pixel.
    even: f64,
    /// The expected number of samples of a pixel that is drawn.
    pub samples: f64,
}

impl<'a> DrawProbabilities<'a> {
    /// Returns the probabilities for a picture of which some pixels are not drawn, whose indices
    /// are in their order.
    pub fn new(picture: &'a [Exposed], size: Resolution, exempt: &'a [u32]) -> Self {
        let width = size.width.max(1) as usize;
        let (mut sums, mut weighted, mut all) = ([0.0; 2], [0.0; 2], 0.0);
        let both = variances(picture, width, exempt);
        for ((number, pixel), variances) in picture.iter().enumerate().zip(both) {
            if is_exempt(exempt, number) {
                continue;
            }
            let count = f64::from(pixel.count);
            all += count;
            for i in 0..2 {
                sums[i] += variances[i];
                weighted[i] += count * variances[i];
            }
        }
        let even = 1.0 / (picture.len() - exempt.len()).max(1) as f64;
        let [own, around] = sums;
        let (factors, even) = if own > 0.0 && around > 0.0 && own.is_finite() {
            ([OWN / own, AROUND / around], EVEN * even)
        } else {
            ([0.0; 2], even)
        };
        let noisy = match factors {
            [0.0, _] => 0.0,
            [a, b] => a * weighted[0] + b * weighted[1],
        };
        Self {
            picture,
            exempt,
            width,
            factors,
            even,
            samples: noisy + even * all,
        }
    }

    /// The probabilities in the order of the pixels.
    pub fn iter(&self) -> impl Iterator<Item = f64> {
        let [a, b] = self.factors;
        // The variances may be infinite where the factors are 0.
        let noisy = (a > 0.0).then(|| variances(self.picture, self.width, self.exempt));
        let mut noisy = noisy.into_iter().flatten();
        (0..self.picture.len()).map(move |pixel| {
            let noise = noisy.next().map(|[own, around]| a * own + b * around);
            match is_exempt(self.exempt, pixel) {
                true => 0.0,
                false => noise.unwrap_or_default() + self.even,
            }
        })
    }
}

/// Returns the squared error of each pixel that its own samples let expect, with the mean of its
/// neighborhood as one sample more: a single sample has one too.
pub(super) fn expected_errors(picture: &[Exposed], size: Resolution) -> Vec<f32> {
    let variances = variances(picture, size.width.max(1) as usize, &[]);
    variances.map(|[own, _]| own as f32).collect()
}

fn is_exempt(exempt: &[u32], pixel: usize) -> bool {
    exempt.binary_search(&(pixel as u32)).is_ok()
}

/// Returns the number of the pixel that stands for a pixel in the neighborhood of others: the next
/// one in its row that is drawn.
fn stand_in(exempt: &[u32], width: usize, pixel: usize) -> usize {
    if !is_exempt(exempt, pixel) {
        return pixel;
    }
    let row = pixel - pixel % width;
    let mut near = (row..pixel).rev().chain(pixel + 1..row + width);
    let drawn = near.find(|pixel| !is_exempt(exempt, *pixel));
    drawn.unwrap_or(pixel)
}

/// The rows of a band, whose variances one thread computes, and the bands that are computed before
/// any others, so that a large picture needs little memory.
const BAND: usize = 16;
const BANDS: usize = 16;

/// Returns the variances of each pixel's mean, by its own samples and by those of its neighborhood.
fn variances<'a>(
    picture: &'a [Exposed],
    width: usize,
    exempt: &'a [u32],
) -> impl Iterator<Item = [f64; 2]> + 'a {
    let rows = picture.len() / width;
    let firsts = (0..rows).step_by(BAND * BANDS);
    firsts.flat_map(move |first| {
        let last = (first + BAND * BANDS).min(rows);
        let bands = (first..last).into_par_iter().step_by(BAND);
        let of_band = |first: usize| {
            let band = first..(first + BAND).min(last);
            variances_of_rows(picture, width, exempt, band)
        };
        bands.flat_map_iter(of_band).collect::<Vec<_>>()
    })
}

/// Returns the variances of the pixels of some rows.
fn variances_of_rows<'a>(
    picture: &'a [Exposed],
    width: usize,
    exempt: &'a [u32],
    rows: Range<usize>,
) -> impl Iterator<Item = [f64; 2]> + 'a {
    // The neighborhoods of neighborhoods reach two rows further.
    let first = rows.start.saturating_sub(2);
    let last = (rows.end + 2).min(picture.len() / width);
    let shown = move || {
        (first..last).map(move |row| {
            let pixels = row * width..(row + 1) * width;
            let shown = |pixel| &picture[stand_in(exempt, width, pixel)];
            pixels.map(shown).collect::<Vec<&Exposed>>()
        })
    };
    let levels = blurred(shown().map(|row| row.iter().map(|p| p.mean).collect()));
    let of_sample = shown().zip(levels).map(|(row, (levels, means))| {
        let around = levels.into_iter().zip(means);
        let of_pixel = |(p, (level, mean)): (&Exposed, _)| variance_of_sample(p, level - mean);
        row.into_iter().zip(around).map(of_pixel).collect()
    });
    let both = blurred(of_sample).skip(rows.start - first).take(rows.len());
    let both = both.flat_map(|(own, around)| own.into_iter().zip(around));
    both.zip(&picture[rows.start * width..])
        .map(|((own, around), p)| {
            let count = f64::from(p.count.max(1));
            [own / count, around / count]
        })
}

/// Returns the variance of a pixel's samples, summed over channels. `off` is the difference of its
/// level from the mean of its neighborhood.
///
/// That mean is one sample more: the only samples of a pixel that lie all on a thin bright line
/// have no scatter, but differ from those around it.
fn variance_of_sample(pixel: &Exposed, off: DVec3) -> f64 {
    let squares = match pixel.count {
        0 | 1 => 0.0,
        n => pixel.variance_of_mean().element_sum() * f64::from(n) * f64::from(n - 1),
    };
    (squares + off.length_squared()) / f64::from(pixel.count.max(1))
}

/// Returns each row with its means over squares of three by three pixels; beyond the edge a row
/// repeats.
fn blurred<T>(rows: impl Iterator<Item = Vec<T>>) -> impl Iterator<Item = (Vec<T>, Vec<T>)>
where
    T: Copy + Add<Output = T> + Div<f64, Output = T>,
{
    let mut rows = rows.map(|row| {
        let right = row.iter().skip(1).chain(row.last());
        let left = row.first().into_iter().chain(&row);
        let across = left.zip(&row).zip(right);
        let across: Vec<T> = across.map(|((a, b), c)| *a + *b + *c).collect();
        (row, across)
    });
    let mut above = None;
    let mut next = rows.next();
    std::iter::from_fn(move || {
        let (row, across) = next.take()?;
        next = rows.next();
        let below = next.as_ref().map_or(&across, |(_, below)| below);
        let sums = above
            .as_ref()
            .unwrap_or(&across)
            .iter()
            .zip(&across)
            .zip(below);
        let means = sums.map(|((a, b), c)| (*a + *b + *c) / 9.0).collect();
        above = Some(across);
        Some((row, means))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Resolution = Resolution::of(32, 24);

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
    fn the_variances_of_all_rows_are_those_of_its_bands() {
        let picture: Vec<Exposed> = (0..3).flat_map(|_| picture()).collect();
        let rows = picture.len() / 32;
        assert!(rows > 4 * BAND && !rows.is_multiple_of(BAND));
        let exempt = [40, 41, 1000];
        let whole: Vec<_> = variances_of_rows(&picture, 32, &exempt, 0..rows).collect();
        let bands: Vec<_> = variances(&picture, 32, &exempt).collect();
        assert_eq!(whole.len(), picture.len());
        assert_eq!(whole, bands);
    }

    #[test]
    fn probabilities_add_up_and_follow_the_neighborhood() {
        let mut picture = picture();
        // The samples of one pixel on the edge agree by chance.
        let quiet = 5 * 32 + 9;
        picture[quiet] = Exposed::default();
        (0..4).for_each(|_| picture[quiet].add(DVec3::ONE));
        let all: Vec<f64> = DrawProbabilities::new(&picture, SIZE, &[]).iter().collect();
        assert!((all.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(
            all[quiet] > 3.0 * all[quiet + 5],
            "{} {}",
            all[quiet],
            all[quiet + 5]
        );
        assert!(all[quiet + 32] > all[quiet]);
        let black = vec![Exposed::default(); 32 * 24];
        let all = DrawProbabilities::new(&black, SIZE, &[]);
        assert!(all.iter().all(|p| (p * 768.0 - 1.0).abs() < 1e-12));
    }

    /// A bright pixel that is exposed in any case leaves the probabilities of the others as they
    /// are in a picture without it.
    #[test]
    fn an_exempt_pixel_is_not_drawn_nor_noise_for_others() {
        let mut picture = picture();
        let plain: Vec<f64> = DrawProbabilities::new(&picture, SIZE, &[]).iter().collect();
        let (bright, pixel) = (2 * 32 + 3, 3 * 32 + 4);
        picture[bright].add(DVec3::splat(900.0));
        let seen: Vec<f64> = DrawProbabilities::new(&picture, SIZE, &[]).iter().collect();
        assert!(seen[pixel] > 10.0 * plain[pixel]);
        let exempt = [bright as u32];
        let all = DrawProbabilities::new(&picture, SIZE, &exempt);
        let each: Vec<f64> = all.iter().collect();
        assert_eq!(each[bright], 0.0);
        assert!((each.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((each[pixel] / plain[pixel] - 1.0).abs() < 0.05);
        assert!(all.samples < 4.01);
    }

    #[test]
    fn the_expected_number_of_samples_is_that_of_the_probabilities() {
        let mut picture = picture();
        picture[100..200].fill(Exposed::default());
        let all = DrawProbabilities::new(&picture, SIZE, &[]);
        let counts = picture.iter().map(|p| f64::from(p.count));
        let expected: f64 = counts.zip(all.iter()).map(|(n, p)| n * p).sum();
        assert!((all.samples - expected).abs() < 1e-12 * expected);
    }
}
