//! Measures of the difference of two pictures of the same size, over the pixels that count.

use ivcam_base::diag::{Diagnostic, Result};
use rayon::prelude::*;

use crate::plane::{Plane, Plate, gaussian};

/// The set of pixels that count in a comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Whether each pixel counts, row by row.
    pub counts: Vec<bool>,
}

impl Mask {
    /// Returns a mask of all pixels.
    pub fn all(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            counts: vec![true; width * height],
        }
    }

    /// Checks that the mask is one of a picture with this size, and that pixels count.
    ///
    /// # Errors
    /// Fails if the mask has another size, or if no pixel counts.
    pub fn check(&self, width: usize, height: usize) -> Result<()> {
        if (self.width, self.height) != (width, height) {
            return Err(Diagnostic::error(format!(
                "the mask is {}x{}, the new picture {width}x{height}",
                self.width, self.height
            ))
            .with_help("a mask has the new picture's size; its white pixels count"));
        }
        if self.pixels() == 0 {
            return Err(
                Diagnostic::error("no pixel is within both the mask and the crop")
                    .with_help("white pixels of a mask count, black ones do not"),
            );
        }
        Ok(())
    }

    /// Returns the number of pixels that count.
    pub(crate) fn pixels(&self) -> usize {
        self.counts.iter().filter(|c| **c).count()
    }

    /// Returns the pixels that count in both masks.
    pub fn and(mut self, other: &Self) -> Self {
        for (a, b) in self.counts.iter_mut().zip(&other.counts) {
            *a &= b;
        }
        self
    }

    /// Returns the pixels whose surroundings, up to a distance along x and y, count too and are
    /// within the picture.
    pub(crate) fn eroded(&self, distance: usize) -> Self {
        let (width, height) = (self.width, self.height);
        let across = |i: usize| {
            let x = i % width;
            let is_inside = x >= distance && x + distance < width;
            is_inside && self.counts[i - distance..=i + distance].iter().all(|c| *c)
        };
        let rows: Vec<bool> = (0..self.counts.len()).map(across).collect();
        let down = |i: usize| {
            let y = i / width;
            let is_inside = y >= distance && y + distance < height;
            is_inside && (y - distance..=y + distance).all(|y| rows[y * width + i % width])
        };
        Self {
            counts: (0..rows.len()).map(down).collect(),
            ..*self
        }
    }

    /// Returns a picture in which each pixel that does not count is the nearest one that does, in
    /// its column, or in the nearest column with any. Around a rectangle this is what filters take
    /// beyond the border of a picture, so that its measures are those of the cropped picture.
    pub(crate) fn extended(&self, plate: &Plate) -> Plate {
        if self.counts.iter().all(|counts| *counts) {
            return plate.clone();
        }
        let (width, height) = (self.width, self.height);
        let column = |x: usize| nearest(height, |y| self.counts[y * width + x]);
        let rows: Vec<Vec<usize>> = (0..width).map(column).collect();
        let columns = nearest(width, |x| !rows[x].is_empty());
        let at = |x: usize, y: usize| (columns[x], rows[columns[x]][y]);
        plate.map(|plane| {
            Plane::from_fn(width, height, |x, y| {
                let (x, y) = at(x, y);
                plane.at(x, y)
            })
        })
    }

    /// Returns the mean of a plane over the pixels that count.
    pub(crate) fn mean(&self, plane: &Plane) -> f64 {
        let sum: f64 = self.kept(plane).map(f64::from).sum();
        sum / self.pixels() as f64
    }

    /// Returns the values of the pixels that count.
    pub(crate) fn kept<'a>(&'a self, plane: &'a Plane) -> impl Iterator<Item = f32> + 'a {
        let pairs = plane.values.iter().zip(&self.counts);
        pairs.filter(|(_, c)| **c).map(|(v, _)| *v)
    }
}

/// Returns the nearest place that counts of each of `number` places; nothing if none counts.
fn nearest(number: usize, counts: impl Fn(usize) -> bool) -> Vec<usize> {
    let all: Vec<usize> = (0..number).filter(|&i| counts(i)).collect();
    let of = |i: usize| {
        let next = all.partition_point(|&place| place < i);
        let around = all[next.saturating_sub(1)..].iter().take(2);
        around.copied().min_by_key(|place| place.abs_diff(i))
    };
    (0..number).filter_map(of).collect()
}

/// Returns the mean square error over all channels.
pub(crate) fn mse(new: &Plate, old: &Plate, mask: &Mask) -> f64 {
    let one = |c: usize| {
        let squares = new.channels[c].zip(&old.channels[c], |a, b| (a - b) * (a - b));
        mask.mean(&squares)
    };
    (one(0) + one(1) + one(2)) / 3.0
}

/// Returns the peak signal-to-noise ratio in decibels for a peak of 1; it is infinite for equal
/// pictures.
pub(crate) fn psnr(mse: f64) -> f64 {
    -10.0 * libm::log10(mse)
}

/// The distance in pixels from the middle of a window of [`ssim`] to its sides.
pub(crate) const SSIM_RADIUS: usize = 5;

/// Returns the structural similarity of the brightness at each pixel (Wang, Bovik, Sheikh,
/// Simoncelli 2004), with an 11×11 Gaussian window of σ = 1.5, K1 = 0.01, K2 = 0.03, and range 1.
pub(crate) fn ssim(new: &Plate, old: &Plate) -> Plane {
    const C1: f64 = 0.01 * 0.01;
    const C2: f64 = 0.03 * 0.03;
    let (a, b) = (new.luma(), old.luma());
    let at = |plane: &Plane, i: usize| f64::from(plane.values[i]);
    let mean = |value: &(dyn Fn(usize) -> f64 + Sync)| window_means(a.width, a.height, value);
    let [ma, mb] = [&a, &b].map(|plane| mean(&|i| at(plane, i)));
    let product = |x: &Plane, y: &Plane| mean(&|i| at(x, i) * at(y, i));
    let (aa, bb, ab) = (product(&a, &a), product(&b, &b), product(&a, &b));
    Plane::from_fn(a.width, a.height, |x, y| {
        let i = y * a.width + x;
        let (ma, mb) = (ma[i], mb[i]);
        let (va, vb, cov) = (aa[i] - ma * ma, bb[i] - mb * mb, ab[i] - ma * mb);
        let similarity =
            (2.0 * ma * mb + C1) * (2.0 * cov + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2));
        similarity as f32
    })
}

/// Returns the means of a function of the pixels in the windows of [`ssim`], in double precision:
/// a variance is a small difference of means where levels are far above 1.
fn window_means(width: usize, height: usize, value: &(dyn Fn(usize) -> f64 + Sync)) -> Vec<f64> {
    let kernel = gaussian(1.5, SSIM_RADIUS);
    let mean = |place: usize, size: usize, of: &dyn Fn(usize) -> f64| {
        let near = |tap: usize| (place + tap).saturating_sub(SSIM_RADIUS).min(size - 1);
        let taps = kernel.iter().enumerate();
        taps.map(|(tap, weight)| weight * of(near(tap))).sum()
    };
    let pixels = || (0..width * height).into_par_iter();
    let along_rows: Vec<f64> = pixels()
        .map(|i| mean(i % width, width, &|x| value(i - i % width + x)))
        .collect();
    pixels()
        .map(|i| mean(i / width, height, &|y| along_rows[y * width + i % width]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate(f: impl Fn(usize, usize) -> f32 + Sync) -> Plate {
        let plane = Plane::from_fn(24, 16, f);
        Plate::from_planes([plane.clone(), plane.clone(), plane])
    }

    #[test]
    fn an_error_of_a_tenth_everywhere_is_twenty_decibels() {
        let (a, b) = (plate(|_, _| 0.5), plate(|_, _| 0.6));
        let error = mse(&a, &b, &Mask::all(24, 16));
        assert!((psnr(error) - 20.0).abs() < 1e-5);
    }

    #[test]
    fn a_masked_pixel_does_not_count() {
        let (a, b) = (
            plate(|_, _| 0.5),
            plate(|x, _| if x == 3 { 1.0 } else { 0.5 }),
        );
        let mut mask = Mask::all(24, 16);
        assert!(mse(&a, &b, &mask) > 0.0);
        for (i, counts) in mask.counts.iter_mut().enumerate() {
            *counts = i % 24 != 3;
        }
        assert_eq!(mse(&a, &b, &mask), 0.0);
    }

    /// Of pictures far above white, whose first factor is 1, the similarity is that of their
    /// variances, which no level changes.
    #[test]
    fn bright_pictures_are_as_similar_as_dark_ones() {
        let grain = |x: usize, y: usize, k: usize| ((x * 7 + y * 3 * k) % 11) as f32 / 64.0;
        let at = |level: f32| {
            let [a, b] = [1, 2].map(|k| plate(|x, y| level + grain(x, y, k)));
            ssim(&a, &b).at(12, 8)
        };
        let (low, high) = (at(8.0), at(1024.0));
        assert!((low - high).abs() < 2e-4, "{low} {high}");
    }

    #[test]
    fn the_same_picture_is_similar_to_one_and_flat_grays_by_the_formula() {
        let a = plate(|x, y| ((x * 7 + y * 3) % 11) as f32 / 11.0);
        assert!(ssim(&a, &a).values.iter().all(|s| (s - 1.0).abs() < 1e-4));
        // For flat pictures only the first factor remains, (2ab + C1) / (a² + b² + C1).
        let s = ssim(&plate(|_, _| 0.4), &plate(|_, _| 0.8)).at(8, 8);
        assert!((s - (0.64 + 1e-4) / (0.8 + 1e-4)).abs() < 1e-3);
    }
}
