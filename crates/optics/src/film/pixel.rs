//! The samples of one pixel of the film.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The exposure of a pixel: the running mean of its samples and their scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exposed {
    /// The number of samples.
    pub count: u32,
    /// The mean of red, green and blue.
    pub mean: DVec3,
    /// The sum of squared deviations of each channel.
    squares: DVec3,
}

impl Exposed {
    /// A pixel whose samples are all black.
    pub fn black(count: u32) -> Self {
        Self {
            count,
            ..Self::default()
        }
    }

    /// Adds one sample by Welford's update, which has no cancellation.
    pub fn add(&mut self, value: DVec3) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off * (1.0 / f64::from(self.count));
        self.squares += off * (value - self.mean);
    }

    /// Adds another pixel's samples (Chan, Golub and LeVeque's update).
    pub fn join(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (n, m) = (f64::from(self.count), f64::from(other.count));
        let off = other.mean - self.mean;
        self.count += other.count;
        self.mean += off * (m / (n + m));
        self.squares += other.squares + off * off * (n * m / (n + m));
    }

    /// Adds another pixel's samples so that they have a given share of the mean, independent of
    /// their number.
    pub(crate) fn join_as(&mut self, other: &Self, share: f64) {
        let (n, m) = (f64::from(self.count), f64::from(other.count));
        if n < 1.0 || m < 1.0 || (m - share * (n + m)).abs() < 1e-9 * m {
            return self.join(other);
        }
        let [a, b] = [1.0 - share, share];
        if n < 2.0 || m < 2.0 {
            // The variance of a single sample is unknown, so that of the plain sum is kept.
            let mean = self.mean * a + other.mean * b;
            self.join(other);
            self.mean = mean;
            return;
        }
        let variance = self.variance_of_mean() * a * a + other.variance_of_mean() * b * b;
        self.mean = self.mean * a + other.mean * b;
        self.count += other.count;
        self.squares = variance * (n + m) * (n + m - 1.0);
    }

    /// The number of bytes of a pixel in a file.
    pub const BYTES: usize = 4 + 6 * 8;

    /// Returns the pixel as bytes with the least significant first.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[..4].copy_from_slice(&self.count.to_le_bytes());
        let numbers = [self.mean.to_array(), self.squares.to_array()];
        for (place, number) in bytes[4..].chunks_exact_mut(8).zip(numbers.as_flattened()) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    /// Returns the pixel that [`Exposed::to_bytes`] has written.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let (count, numbers) = bytes.split_at(4);
        let numbers = numbers.as_chunks().0;
        let number = |i: usize| f64::from_le_bytes(numbers[i]);
        Self {
            count: count.iter().rev().fold(0, |n, b| n << 8 | u32::from(*b)),
            mean: DVec3::new(number(0), number(1), number(2)),
            squares: DVec3::new(number(3), number(4), number(5)),
        }
    }

    /// Returns the variance of the mean for independent samples, which is an upper bound for
    /// stratified ones. It is infinite for fewer than two samples.
    pub fn variance_of_mean(&self) -> DVec3 {
        match self.count {
            0 | 1 => DVec3::INFINITY,
            n => self.squares / (f64::from(n) * f64::from(n - 1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_the_mean_is_the_textbooks() {
        let values = [1.0, 4.0, 4.0, 7.0];
        let mut pixel = Exposed::default();
        values.iter().for_each(|&v| pixel.add(DVec3::splat(v)));
        // Mean 4, squared deviations 9 + 0 + 0 + 9, divided by 4·3.
        assert_eq!(pixel.mean.x, 4.0);
        assert!((pixel.variance_of_mean().x - 1.5).abs() < 1e-15);
    }

    #[test]
    fn the_bytes_of_a_pixel_are_read_back_bit_for_bit() {
        let mut pixel = Exposed::default();
        (0..70_000).for_each(|i| pixel.add(DVec3::new(0.1 * f64::from(i), -0.0, 1e-300)));
        assert_eq!(pixel.count, 70_000);
        assert_eq!(Exposed::from_bytes(&pixel.to_bytes()), pixel);
    }

    #[test]
    fn samples_in_two_parts_are_the_samples_in_one() {
        let values = [0.3, 2.0, 5.5, 1.0, 4.25];
        let (mut one, mut first, mut second) = Default::default();
        let add = |pixel: &mut Exposed, v: f64| pixel.add(DVec3::splat(v));
        values.iter().for_each(|&v| add(&mut one, v));
        values[..2].iter().for_each(|&v| add(&mut first, v));
        values[2..].iter().for_each(|&v| add(&mut second, v));
        first.join(&second);
        assert_eq!(first.count, one.count);
        assert!((first.mean - one.mean).length() < 1e-14);
        assert!((first.variance_of_mean() - one.variance_of_mean()).length() < 1e-14);
    }

    #[test]
    fn the_share_of_a_moment_does_not_depend_on_its_number_of_samples() {
        let of = |values: &[f64]| {
            let mut pixel = Exposed::default();
            values.iter().for_each(|&v| pixel.add(DVec3::splat(v)));
            pixel
        };
        let (mut still, busy) = (of(&[1.0, 3.0]), of(&[4.0, 8.0, 4.0, 8.0]));
        let expected = (still.variance_of_mean() + busy.variance_of_mean()) / 4.0;
        still.join_as(&busy, 0.5);
        assert_eq!((still.count, still.mean.x), (6, 4.0));
        assert!((still.variance_of_mean() - expected).length() < 1e-14);
    }

    /// Adaptive sampling may give one sample to a pixel at one moment and several at another.
    #[test]
    fn the_share_of_a_single_sample_does_not_depend_on_the_others_either() {
        let mut single = Exposed::default();
        single.add(DVec3::splat(1.0));
        let mut busy = Exposed::default();
        [5.0, 7.0, 6.0]
            .iter()
            .for_each(|&v| busy.add(DVec3::splat(v)));
        single.join_as(&busy, 0.5);
        assert_eq!((single.count, single.mean.x), (4, 3.5));
        assert!(single.variance_of_mean().is_finite());
    }
}
