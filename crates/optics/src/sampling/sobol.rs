//! Owen-scrambled Sobol' points in four dimensions.
//!
//! Any aligned power of two of consecutive points is a net. Each pixel has its own scrambling, so
//! pixels are independent. Points are stored with their bits reversed. Owen's scrambling is then a
//! hash in which a bit affects only higher bits.

use std::ops::Range;

use ivcam_base::math::lanes::{LANES, SimdKernel, dispatch};

use super::hash::mix;

/// The definition of the first four dimensions (Joe and Kuo, 2008): the degree and the coefficients
/// of the primitive polynomial, and the first direction numbers.
const POLYNOMIALS: [(usize, u32, [u32; 3]); 4] = [
    (0, 0, [1, 1, 1]),
    (1, 0, [1, 0, 0]),
    (2, 1, [1, 3, 0]),
    (3, 1, [1, 3, 1]),
];

/// The direction numbers of a dimension.
const fn directions(dimension: usize) -> [u32; 32] {
    let (degree, coefficients, first) = POLYNOMIALS[dimension];
    let mut v = [0u32; 32];
    let mut k = 0;
    while k < 32 {
        v[k] = if degree == 0 {
            1 << (31 - k)
        } else if k < degree {
            first[k] << (31 - k)
        } else {
            let mut x = v[k - degree] ^ (v[k - degree] >> degree);
            let mut j = 1;
            while j < degree {
                if (coefficients >> (degree - 1 - j)) & 1 == 1 {
                    x ^= v[k - j];
                }
                j += 1;
            }
            x
        };
        k += 1;
    }
    v
}

/// For each dimension and each bit of an index, the number that is added (XOR), bits reversed.
static BITS: [[u32; 32]; 4] = bits();

/// Computes [`BITS`].
const fn bits() -> [[u32; 32]; 4] {
    let mut bits = [[0; 32]; 4];
    let mut dimension = 0;
    while dimension < 4 {
        let v = directions(dimension);
        let mut bit = 0;
        while bit < 32 {
            bits[dimension][bit] = v[bit].reverse_bits();
            bit += 1;
        }
        dimension += 1;
    }
    bits
}

/// For each byte of an index and each of its values, the numbers that are added (XOR) in the four
/// dimensions, bits reversed.
static TABLES: [[[u32; 4]; 256]; 4] = tables();

/// Computes [`TABLES`].
const fn tables() -> [[[u32; 4]; 256]; 4] {
    let mut tables = [[[0; 4]; 256]; 4];
    let mut dimension = 0;
    while dimension < 4 {
        let mut byte = 0;
        while byte < 4 {
            let mut value = 0;
            while value < 256 {
                let mut bit = 0;
                let mut x = 0;
                while bit < 8 {
                    if (value >> bit) & 1 == 1 {
                        x ^= BITS[dimension][8 * byte + bit];
                    }
                    bit += 1;
                }
                tables[byte][value][dimension] = x;
                value += 1;
            }
            byte += 1;
        }
        dimension += 1;
    }
    tables
}

/// A scrambled Sobol' sequence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sobol {
    /// The seeds of the scrambling in the four dimensions.
    seeds: [u32; 4],
}

impl Sobol {
    /// The sequence whose scrambling depends on a key.
    pub(super) fn new(key: u64) -> Self {
        let (a, b) = (mix(key), mix(!key));
        Self {
            seeds: [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32],
        }
    }

    /// The point with an index.
    #[inline]
    pub(super) fn point(&self, index: u32) -> [f64; 4] {
        let byte = |i: u32| &TABLES[i as usize][(index >> (8 * i)) as usize & 255];
        let mut x = *byte(0);
        for i in 1..4 {
            if index >> (8 * i) != 0 {
                let more = byte(i);
                (0..4).for_each(|d| x[d] ^= more[d]);
            }
        }
        std::array::from_fn(|d| coordinate(x[d], self.seeds[d]))
    }

    /// The first dimension of the point with a shuffled index: every aligned 2^k indices are
    /// permuted among themselves, so that the result is independent of another scrambling.
    pub(super) fn shuffled(&self, index: u32) -> f64 {
        // In the first dimension, a point before scrambling is its index with the bits reversed.
        let shuffled = scramble(index.reverse_bits(), self.seeds[1]).reverse_bits();
        coordinate(shuffled, self.seeds[0])
    }

    /// The first two dimensions of the point with a shuffled index (see [`Sobol::shuffled`]).
    #[inline]
    pub(super) fn shuffled_pair(&self, index: u32) -> [f64; 2] {
        let shuffled = scramble(index.reverse_bits(), self.seeds[2]).reverse_bits();
        let second = before(1, shuffled);
        [
            coordinate(shuffled, self.seeds[0]),
            coordinate(second, self.seeds[1]),
        ]
    }
}

/// Requested points of several sequences, to be drawn together.
#[derive(Clone, Debug, Default)]
pub(super) struct PendingPoints {
    /// The indices of the points.
    places: Vec<u32>,
    /// The seeds of the points' sequences.
    seeds: [Vec<u32>; 4],
}

impl PendingPoints {
    /// Requests a point of a sequence.
    #[inline]
    pub(super) fn push(&mut self, sobol: &Sobol, place: u32) {
        self.places.push(place);
        for (all, seed) in self.seeds.iter_mut().zip(sobol.seeds) {
            all.push(seed);
        }
    }

    /// Requests consecutive points of a sequence.
    pub(super) fn push_all(&mut self, sobol: &Sobol, places: Range<u32>) {
        let count = self.places.len() + places.len();
        self.places.extend(places);
        for (all, seed) in self.seeds.iter_mut().zip(sobol.seeds) {
            all.resize(count, seed);
        }
    }

    /// Appends the coordinates of the requested points to `out` and removes the requests.
    pub(super) fn draw(&mut self, out: [&mut Vec<f64>; 4]) {
        let count = self.places.len();
        let [a, b, c, d] = out;
        let filled = a.len();
        for all in [&mut *a, b, c, d] {
            all.resize(filled + count, 0.0);
        }
        for first in (0..count).step_by(LANES) {
            let now = first..(first + LANES).min(count);
            let seeds = [0, 1, 2, 3].map(|d| &self.seeds[d][now.clone()]);
            let to = filled + now.start..filled + now.end;
            dispatch(SobolDraw {
                places: &self.places[now],
                seeds,
                out: [
                    &mut a[to.clone()],
                    &mut b[to.clone()],
                    &mut c[to.clone()],
                    &mut d[to],
                ],
            });
        }
        self.places.clear();
        self.seeds.iter_mut().for_each(Vec::clear);
    }
}

/// For each dimension, the numbers that consecutive indices, starting at a multiple of [`LANES`],
/// add (XOR) to the first point.
static ROW: [[u32; LANES]; 4] = row();

/// Computes [`ROW`].
const fn row() -> [[u32; LANES]; 4] {
    let mut row = [[0; LANES]; 4];
    let mut dimension = 0;
    while dimension < 4 {
        let mut place = 0;
        while place < LANES {
            row[dimension][place] = TABLES[0][place][dimension];
            place += 1;
        }
        dimension += 1;
    }
    row
}

/// The kernel that computes [`Sobol::point`] for at most [`LANES`] points.
struct SobolDraw<'a> {
    places: &'a [u32],
    seeds: [&'a [u32]; 4],
    out: [&'a mut [f64]; 4],
}

impl SimdKernel for SobolDraw<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let places = whole(self.places);
        let first = places[0];
        let most = places.iter().fold(0, |all, place| all | place);
        // 0 if the indices are consecutive from a multiple of `LANES`.
        let mut irregular = first % LANES as u32;
        for (i, place) in places.iter().enumerate() {
            irregular |= place ^ (first | i as u32);
        }
        let bits = 32 - most.leading_zeros() as usize;
        for (d, out) in self.out.into_iter().enumerate() {
            let seeds = whole(self.seeds[d]);
            let mut x = [0u32; LANES];
            if irregular == 0 {
                let before = before(d, first);
                for (x, more) in x.iter_mut().zip(&ROW[d]) {
                    *x = before ^ more;
                }
            } else {
                for (bit, v) in BITS[d][..bits].iter().enumerate() {
                    for (x, place) in x.iter_mut().zip(&places) {
                        *x ^= v & 0u32.wrapping_sub(place >> bit & 1);
                    }
                }
            }
            let mut points = [0.0; LANES];
            for i in 0..LANES {
                points[i] = coordinate(x[i], seeds[i]);
            }
            out.copy_from_slice(&points[..out.len()]);
        }
    }
}

/// The coordinate of the point with an index before scrambling, bits reversed.
fn before(dimension: usize, place: u32) -> u32 {
    let table = |byte: usize| TABLES[byte][(place >> (8 * byte)) as usize & 255][dimension];
    table(0) ^ table(1) ^ table(2) ^ table(3)
}

/// A row of [`LANES`] numbers, padded with zeros.
#[inline(always)]
fn whole(part: &[u32]) -> [u32; LANES] {
    let mut row = [0; LANES];
    match part.first_chunk() {
        Some(all) => row = *all,
        None => row[..part.len()].copy_from_slice(part),
    }
    row
}

/// A coordinate, before scrambling with its bits reversed, scrambled and scaled to [0, 1).
#[inline(always)]
fn coordinate(x: u32, seed: u32) -> f64 {
    f64::from(scramble(x, seed).reverse_bits()) * (1.0 / (1u64 << 32) as f64)
}

/// Scrambles a number by the hash of Laine and Karras, with the constants of Vegdahl ("Building a
/// better LK hash", 2021).
#[inline(always)]
fn scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_dimension_has_one_point_in_each_of_n_equal_parts() {
        for key in 0..20 {
            let sobol = Sobol::new(key);
            for n in [2u32, 16, 256, 4096] {
                for d in 0..4 {
                    let mut seen = vec![false; n as usize];
                    for i in 0..n {
                        let part = (sobol.point(i)[d] * f64::from(n)) as usize;
                        assert!(!seen[part], "key {key}, dimension {d}, {n} points");
                        seen[part] = true;
                    }
                }
            }
        }
    }

    /// A (0, m, 2)-net has one point in every elementary box of area 1/n.
    #[test]
    fn the_film_dimensions_are_a_net() {
        for key in 0..20 {
            let sobol = Sobol::new(key);
            for start in [0u32, 64, 960] {
                for bits in 0..=6 {
                    let (columns, rows) = (1u32 << bits, 64u32 >> bits);
                    let mut seen = [false; 64];
                    for i in start..start + 64 {
                        let [x, y, ..] = sobol.point(i);
                        let cell = (x * f64::from(columns)) as usize * rows as usize
                            + (y * f64::from(rows)) as usize;
                        assert!(!seen[cell], "key {key}, from {start}, {columns} by {rows}");
                        seen[cell] = true;
                    }
                }
            }
        }
    }
}
