//! The samples of pixels: functions of seed, pixel and index alone.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::hash::{mix, unit};
use super::path_points::PathPoints;
use super::sobol::{PendingPoints, Sobol};

/// A sample of film and pupil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensSample {
    /// The point of the pixel, in the unit square.
    pub film: [f64; 2],
    /// The point of the unit square that determines the lens point.
    pub pupil: [f64; 2],
}

/// The distribution of a pixel's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SamplerKind {
    /// Pixel and pupil are stratified and jittered separately, with several pupil samples for each
    /// pixel sample. The 1999 program does this (the paper, section Sampling).
    Jittered,
    /// Independent uniform random numbers.
    Random,
    /// Owen-scrambled Sobol' points in the four dimensions of film and pupil together, with a
    /// different scrambling for each pixel. This is the default.
    Sobol,
    /// One scrambled Sobol' sequence over all pixels along Morton's curve. The errors of
    /// neighboring pixels differ, so the noise has less low frequency (Ahmed and Wonka,
    /// "Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical ordering
    /// of pixels", 2020).
    Blue,
    /// Multiples of the generalized golden ratio (Roberts's R sequence), with a different shift for
    /// each pixel.
    Golden,
    /// The middle of the pixel for every sample, as OpenGL samples, with the pupil points of
    /// [`SamplerKind::Golden`]. Edges are stepped.
    Center,
}

impl SamplerKind {
    /// All kinds with their names.
    pub const ALL: [(&'static str, Self); 6] = [
        ("jittered", Self::Jittered),
        ("random", Self::Random),
        ("sobol", Self::Sobol),
        ("blue", Self::Blue),
        ("golden", Self::Golden),
        ("center", Self::Center),
    ];

    /// The name in options and reports.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, k)| *k == self)
            .map_or("", |(n, _)| n)
    }
}

/// The samples of every pixel of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampler {
    /// The distribution of a pixel's samples.
    pub kind: SamplerKind,
    /// The number of samples of a pixel, which determines the strata of [`SamplerKind::Jittered`].
    pub samples: u32,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Sampler {
    /// Creates the samples of a picture.
    pub const fn new(kind: SamplerKind, samples: u32, seed: u64) -> Self {
        Self {
            kind,
            samples,
            seed,
        }
    }

    /// The samples of the pixel with a number, and with a column and a row in the picture.
    pub fn pixel(&self, number: u64, [x, y]: [u32; 2]) -> PixelSampler {
        let key = mix(self.seed ^ mix(number.wrapping_add(0x9e37_79b9_7f4a_7c15)));
        let layout = match self.kind {
            SamplerKind::Jittered => SampleLayout::Jittered(self.samples),
            SamplerKind::Random => SampleLayout::Random,
            SamplerKind::Sobol => SampleLayout::Sobol(Sobol::new(key)),
            SamplerKind::Golden => SampleLayout::Golden(golden_shift(key)),
            SamplerKind::Center => SampleLayout::Center(golden_shift(key)),
            SamplerKind::Blue => {
                let bits = self.samples.max(1).next_power_of_two().trailing_zeros();
                let block = u64::from(x >> BLOCK_BITS) << 32 | u64::from(y >> BLOCK_BITS);
                let seed = mix(self.seed ^ mix(block));
                SampleLayout::Blue {
                    sequence: Sobol::new(seed),
                    start: u64::from(shuffled_morton(x, y, seed)) << bits,
                    bits,
                    key,
                }
            }
        };
        PixelSampler { key, layout }
    }

    /// The number of samples of a pixel must be a multiple of this: the first samples of a jittered
    /// set are not stratified.
    pub fn period(&self) -> u32 {
        match self.kind {
            SamplerKind::Jittered => self.samples.max(1),
            _ => 1,
        }
    }
}

/// The samples of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    key: u64,
    layout: SampleLayout,
}

/// The parameters of a pixel's samples.
#[derive(Clone, Copy, Debug)]
enum SampleLayout {
    /// The number of samples in a set of strata.
    Jittered(u32),
    Random,
    Sobol(Sobol),
    Blue {
        sequence: Sobol,
        /// The index in the sequence at which the pixel's points start.
        start: u64,
        /// The binary logarithm of the number of the pixel's points.
        bits: u32,
        /// The key of the sequence that is used after them.
        key: u64,
    },
    /// The shift in each dimension.
    Golden([f64; 4]),
    /// The shift in each dimension, of which only the pupil's are used.
    Center([f64; 4]),
}

impl PixelSampler {
    /// The numbers in [0, 1) that determine the wavelengths of consecutive samples from an index
    /// on. They are stratified over a pixel's samples, and shuffled relative to the other
    /// dimensions.
    pub fn wavelengths(&self, first: u32, out: &mut [f64]) {
        if let SampleLayout::Random = self.layout {
            for (index, out) in (first..).zip(out) {
                *out = unit(mix(self.key ^ mix((u64::from(index) << 3) | 4)));
            }
            return;
        }
        let sobol = Sobol::new(mix(self.key ^ 0x7761_7665));
        for (index, out) in (first..).zip(out) {
            *out = sobol.shuffled(index);
        }
    }

    /// The random numbers of the light path of the sample with an index.
    pub fn path(&self, index: u32) -> PathPoints {
        match self.layout {
            SampleLayout::Random => PathPoints::independent(mix(self.key ^ !u64::from(index))),
            _ => PathPoints::of_sample(self.key, index),
        }
    }

    /// The scrambled sequence and the index in it, for kinds that have one.
    #[inline]
    fn net(&self, index: u32) -> Option<(Sobol, u32)> {
        match self.layout {
            SampleLayout::Sobol(sobol) => Some((sobol, index)),
            SampleLayout::Blue {
                sequence,
                start,
                bits,
                key,
            } => Some(match u32::try_from(start + u64::from(index)) {
                Ok(place) if index >> bits == 0 => (sequence, place),
                // After the end of the pixel's part, or of the sequence, the pixel has its own
                // sequence.
                _ => (Sobol::new(key), index),
            }),
            _ => None,
        }
    }

    /// The sample with an index, counted from 0.
    #[inline]
    pub fn sample(&self, index: u32) -> LensSample {
        let [a, b, c, d] = match self.layout {
            SampleLayout::Jittered(samples) => return jittered(self.key, samples, index),
            SampleLayout::Random => {
                let n = |d| unit(mix(self.key ^ mix((u64::from(index) << 3) | d)));
                [n(0), n(1), n(2), n(3)]
            }
            SampleLayout::Sobol(_) | SampleLayout::Blue { .. } => match self.net(index) {
                Some((sobol, place)) => sobol.point(place),
                None => [0.0; 4],
            },
            SampleLayout::Golden(shift) => golden(shift, index),
            SampleLayout::Center(shift) => {
                let [.., c, d] = golden(shift, index);
                [0.5, 0.5, c, d]
            }
        };
        LensSample {
            film: [a, b],
            pupil: [c, d],
        }
    }
}

/// A batch of samples, in the order of the requests.
#[derive(Clone, Debug, Default)]
pub struct CameraSamples {
    /// The points of the pixel in the unit square. The caller may replace them by points of the
    /// picture.
    pub film: [Vec<f64>; 2],
    /// The points of the unit square that determine the lens points.
    pub pupil: [Vec<f64>; 2],
    /// The numbers that determine the wavelengths, if the caller adds them.
    pub wavelength: Vec<f64>,
    pending: PendingPoints,
}

impl CameraSamples {
    /// The number of samples that were drawn.
    pub fn len(&self) -> usize {
        self.film[0].len()
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        let [a, b] = &mut self.film;
        let [c, d] = &mut self.pupil;
        for all in [a, b, c, d, &mut self.wavelength] {
            all.clear();
        }
    }

    /// Requests samples of a pixel, to be drawn by [`Self::draw`]. They are bit-identical to those
    /// of [`PixelSampler::sample`].
    pub fn request(&mut self, pixel: &PixelSampler, indices: Range<u32>) {
        if let SampleLayout::Sobol(sobol) = pixel.layout {
            return self.pending.push_all(&sobol, indices);
        }
        for index in indices {
            match pixel.net(index) {
                Some((sobol, place)) => self.pending.push(&sobol, place),
                None => {
                    let LensSample { film, pupil } = pixel.sample(index);
                    for d in 0..2 {
                        self.film[d].push(film[d]);
                        self.pupil[d].push(pupil[d]);
                    }
                }
            }
        }
    }

    /// Draws the requested samples.
    pub fn draw(&mut self) {
        let [a, b] = &mut self.film;
        let [c, d] = &mut self.pupil;
        self.pending.draw([a, b, c, d]);
    }
}

/// The powers 1/g, 1/g², … where g⁵ = g + 1 (Roberts, "The unreasonable effectiveness of
/// quasirandom sequences").
const GOLDEN: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_126,
    0.628_706_721_037_808_6,
    0.538_597_257_223_601_1,
];

/// A pixel's shift of the multiples of [`GOLDEN`] in each dimension.
fn golden_shift(key: u64) -> [f64; 4] {
    std::array::from_fn(|d| unit(mix(key ^ mix(d as u64))))
}

/// The shifted multiple of [`GOLDEN`] with an index, counted from 0.
fn golden(shift: [f64; 4], index: u32) -> [f64; 4] {
    let n = f64::from(index) + 1.0;
    std::array::from_fn(|d| (shift[d] + n * GOLDEN[d]).fract())
}

/// The binary logarithm of the side of the squares whose pixels share a sequence of
/// [`SamplerKind::Blue`]. Of its 2^32 points each pixel has up to 2^14.
const BLOCK_BITS: u32 = 9;

/// The index of a pixel along Morton's curve through its square, with a random order of the four
/// quadrants at every level.
fn shuffled_morton(x: u32, y: u32, seed: u64) -> u32 {
    let mut place = 0u32;
    for level in (0..BLOCK_BITS).rev() {
        let quadrant = (x >> level & 1) | (y >> level & 1) << 1;
        let draw = mix(seed ^ mix(u64::from(place) << 5 | u64::from(level)));
        // One of the 24 permutations of four (Fisher and Yates).
        let mut order = [0, 1, 2, 3];
        let mut rest = draw;
        for i in (1..4).rev() {
            order.swap(i, (rest % (i as u64 + 1)) as usize);
            rest /= i as u64 + 1;
        }
        place = place << 2 | order[quadrant as usize];
    }
    place
}

/// A jittered sample. After `samples` samples, a new set of strata starts with other jitter.
fn jittered(key: u64, samples: u32, index: u32) -> LensSample {
    let (on_pixel, on_pupil) = split(samples);
    let (round, index) = (index / samples.max(1), index % samples.max(1));
    let key = mix(key ^ u64::from(round) << 40);
    let (i, j) = (index / on_pupil, index % on_pupil);
    let jitter = |d: u64, n: u32| unit(mix(key ^ mix((u64::from(n) << 3) | d)));
    // The jitter of a pixel stratum is shared by its pupil samples, which start from one film
    // point.
    let film = stratum(i, on_pixel, jitter(0, i), jitter(1, i));
    let pupil = stratum(j, on_pupil, jitter(2, index), jitter(3, index));
    LensSample { film, pupil }
}

/// The numbers of pixel samples, and of pupil samples for each, of `n` samples. The pupil gets the
/// larger factor, because it causes more of the noise. 16 samples are 4 times 4.
fn split(n: u32) -> (u32, u32) {
    let on_pixel = largest_factor(n.max(1));
    (on_pixel, n.max(1) / on_pixel)
}

/// The largest factor of n that is at most √n.
fn largest_factor(n: u32) -> u32 {
    (1..=n.isqrt())
        .rev()
        .find(|a| n.is_multiple_of(*a))
        .unwrap_or(1)
}

/// A point of stratum `i` of `n` on the unit square, jittered by (u, v). The strata form a grid
/// that is as square as n allows.
fn stratum(i: u32, n: u32, u: f64, v: f64) -> [f64; 2] {
    let rows = largest_factor(n);
    let columns = n / rows;
    let (column, row) = (f64::from(i % columns), f64::from(i / columns));
    [
        (column + u) / f64::from(columns),
        (row + v) / f64::from(rows),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampler(kind: SamplerKind, samples: u32) -> Sampler {
        Sampler::new(kind, samples, 7)
    }

    #[test]
    fn sixteen_jittered_samples_fill_four_pixel_strata_with_four_pupil_strata_each() {
        let s = sampler(SamplerKind::Jittered, 16);
        let cell = |[u, v]: [f64; 2]| (u * 2.0) as usize + 2 * (v * 2.0) as usize;
        let mut seen = [[0; 4]; 4];
        for i in 0..16 {
            let sample = s.pixel(123, [123, 0]).sample(i);
            seen[cell(sample.film)][cell(sample.pupil)] += 1;
        }
        assert_eq!(seen, [[1; 4]; 4]);
    }

    #[test]
    fn pupil_samples_of_one_pixel_stratum_share_their_film_point() {
        let s = sampler(SamplerKind::Jittered, 16);
        let film = |i: u32| s.pixel(5, [5, 0]).sample(i).film;
        assert_eq!(film(0), film(3));
        assert_ne!(film(0), film(4));
    }

    #[test]
    fn every_sampler_is_uniform_on_film_and_pupil() {
        // The mean of n uniform numbers is 1/2 within 5 standard errors of 1/√(12 n).
        for (_, kind) in SamplerKind::ALL {
            let s = sampler(kind, 16);
            let n = 16 * 2_000;
            let mut sum = [0.0; 4];
            for column in 0..2_000 {
                let pixel = s.pixel(u64::from(column), [column, 0]);
                for i in 0..16 {
                    let LensSample { film, pupil } = pixel.sample(i);
                    for (total, x) in sum.iter_mut().zip([film[0], film[1], pupil[0], pupil[1]]) {
                        assert!((0.0..1.0).contains(&x));
                        *total += x;
                    }
                }
            }
            for total in sum {
                let error = (total / f64::from(n) - 0.5).abs();
                assert!(
                    error < 5.0 / (12.0 * f64::from(n)).sqrt(),
                    "{kind:?}: {error}"
                );
            }
        }
    }

    #[test]
    fn samples_of_the_center_differ_on_the_pupil_only() {
        let pixel = sampler(SamplerKind::Center, 4).pixel(9, [9, 0]);
        let [a, b] = [0, 1].map(|i| pixel.sample(i));
        assert_eq!([a.film, b.film], [[0.5; 2]; 2]);
        assert_ne!(a.pupil, b.pupil);
    }

    #[test]
    fn the_pixels_of_a_square_share_one_sequence_without_gaps() {
        let mut seen = vec![false; 1 << 18];
        for y in 0..512 {
            for x in 0..512 {
                let place = shuffled_morton(x, y, 3) as usize;
                assert!(!seen[place]);
                seen[place] = true;
            }
        }
        // The samples of four neighboring pixels, one each, are a net of four points.
        let s = sampler(SamplerKind::Blue, 1);
        let quarter = |x: u32, y: u32| {
            let u = s.pixel(0, [x, y]).sample(0).pupil;
            (u[0] * 4.0) as usize
        };
        let mut parts = [quarter(6, 8), quarter(7, 8), quarter(6, 9), quarter(7, 9)];
        parts.sort_unstable();
        assert_eq!(parts, [0, 1, 2, 3]);
    }

    #[test]
    fn every_eight_samples_have_one_in_each_eighth_of_the_wavelengths() {
        for kind in [SamplerKind::Jittered, SamplerKind::Sobol, SamplerKind::Blue] {
            let s = sampler(kind, 16);
            for column in 0..50 {
                let mut wavelengths = [0.0; 16];
                let pixel = s.pixel(u64::from(column), [column, 0]);
                pixel.wavelengths(0, &mut wavelengths);
                let mut seen = [[0; 8]; 2];
                for (i, wavelength) in wavelengths.into_iter().enumerate() {
                    seen[i / 8][(8.0 * wavelength) as usize] += 1;
                }
                assert_eq!(seen, [[1; 8]; 2], "{kind:?}");
            }
        }
    }

    #[test]
    fn a_prime_number_of_samples_is_still_stratified() {
        assert_eq!(split(16), (4, 4));
        assert_eq!(split(7), (1, 7));
        assert_eq!(split(0), (1, 1));
    }
}
