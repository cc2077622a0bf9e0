//! The random numbers of a light path: points in the unit square, as many as the path needs.
//!
//! Each pair is the first two dimensions of a Sobol' sequence with its own scrambling and its own
//! order of the samples (padding: Burley, "Practical hash-based Owen scrambling", 2020). So a
//! longer path changes no number of a shorter one, and every pair is stratified over a pixel's
//! samples.

use super::hash::{mix, unit};
use super::sobol::Sobol;

/// The numbers of one sample of a pixel, as a function of seed, pixel and index alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathPoints {
    key: u64,
    /// The index of the sample; `None` draws independent numbers.
    index: Option<u32>,
}

impl PathPoints {
    /// Returns the numbers of a sample with an index, for a pixel with a key.
    pub(super) fn of_sample(key: u64, index: u32) -> Self {
        Self {
            key: mix(key ^ 0x7061_7468),
            index: Some(index),
        }
    }

    /// Returns independent numbers that depend only on a key.
    pub fn independent(key: u64) -> Self {
        Self { key, index: None }
    }

    /// Returns the point of the unit square with a number; neither coordinate reaches 1.
    #[inline]
    pub fn pair(&self, number: u32) -> [f32; 2] {
        let key = mix(self.key ^ mix(u64::from(number)));
        let point = match self.index {
            Some(index) => Sobol::new(key).shuffled_pair(index),
            None => [unit(key), unit(mix(key))],
        };
        // Rounding down keeps a number in its box of the net, and below 1.
        const STEPS: f32 = (1 << 24) as f32;
        point.map(|x| (x * f64::from(STEPS)) as u32 as f32 / STEPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 64 samples fill each of 64 boxes of every shape once, and two pairs are independent: over
    /// 1,000 keys the correlation of their first coordinates is within 5 standard errors of 0.
    #[test]
    fn every_pair_is_a_net_over_the_samples_and_independent_of_the_others() {
        let mut sum = 0.0;
        for key in 0..1000 {
            let samples: Vec<_> = (0..64).map(|i| PathPoints::of_sample(key, i)).collect();
            for bits in 0..=6 {
                let (columns, rows) = ((1u32 << bits) as f32, (64u32 >> bits) as f32);
                let mut seen = [false; 64];
                for sample in &samples {
                    let [x, y] = sample.pair(key as u32 % 7);
                    let cell = (x * columns) as usize * rows as usize + (y * rows) as usize;
                    assert!(!seen[cell], "key {key}, {columns} by {rows}");
                    seen[cell] = true;
                }
            }
            sum += f64::from(samples[5].pair(0)[0] - 0.5) * f64::from(samples[5].pair(1)[0] - 0.5);
        }
        // The product of two uniform numbers about 0 has the standard deviation 1/12.
        assert!(sum.abs() < 5.0 * 1000f64.sqrt() / 12.0, "{sum}");
    }
}
