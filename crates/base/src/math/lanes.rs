//! SIMD arithmetic: kernels are compiled for every vector width that a processor may have, and one
//! is selected at run time.
//!
//! A kernel consists of loops over plain arrays without branches, which the compiler vectorizes. If
//! the processor has a fused multiply-add, a kernel may use it (`FUSED`). The result is then
//! rounded once instead of twice, so it may differ in the last bit from one kind of processor to
//! another (docs/decisions/0002-fused-arithmetic.md).

use glam::Vec3;

pub use super::simd::{
    SimdKernel, VectorKernel, Vectors, Width, dispatch, dispatch_vectors, fused, is_portable,
};

/// The number of lanes, which is the same for rays in lenses, trees and shading. It is four of the
/// widest vectors of `f64`, which hides the latency of roots and quotients.
pub const LANES: usize = 32;

/// A value for each lane.
pub type Lanes<T> = [T; LANES];

/// A double-precision number for each lane.
pub type Lane = Lanes<f64>;

/// A point or direction for each lane, axis by axis.
pub type Vec3Lanes = [Lanes<f32>; 3];

/// Rays in lanes, from distance 0.
#[derive(Clone, Copy, Debug)]
pub struct RaysInLanes<'a> {
    /// The rays' origins.
    pub origin: &'a Vec3Lanes,
    /// The rays' directions, of any length; distances are multiples of it.
    pub direction: &'a Vec3Lanes,
    /// Farther hits are ignored.
    pub t_max: &'a Lanes<f32>,
}

/// The point or direction of one lane.
#[inline(always)]
pub fn of_lane(all: &Vec3Lanes, lane: usize) -> Vec3 {
    Vec3::new(all[0][lane], all[1][lane], all[2][lane])
}

/// Sets the point or direction of one lane.
#[inline(always)]
pub fn set_lane(all: &mut Vec3Lanes, lane: usize, value: Vec3) {
    (all[0][lane], all[1][lane], all[2][lane]) = (value.x, value.y, value.z);
}

/// The numbers of the bits that are set, lowest first.
pub fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        at
    })
}

/// A number from 0 to 1 raised to a power of at least 0, with a relative error of at most 1.2e-7.
/// It has no branches, so it can be vectorized, and is the same on every machine. The logarithm is
/// computed by the series of the inverse hyperbolic tangent, for arguments up to (√2 − 1)/(√2 + 1).
/// The power of two is computed by the exponential series, for exponents up to 1/2.
#[inline(always)]
pub fn power(base: f32, exponent: f32) -> f32 {
    // base = m 2^k with m from √½ to √2.
    let bits = base.max(f32::MIN_POSITIVE).to_bits() as i32;
    let k = (bits - 0x3f35_04f3) >> 23;
    let m = f64::from(f32::from_bits((bits - (k << 23)) as u32));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let series = 1.0 / 9.0 + z * (1.0 / 11.0 + z * (1.0 / 13.0));
    let series = 1.0 + z * (1.0 / 3.0 + z * (0.2 + z * (1.0 / 7.0 + z * series)));
    let log = f64::from(k) + std::f64::consts::LOG2_E * 2.0 * s * series;
    // A result below 2^-126 is replaced by 0.
    let y = (f64::from(exponent) * log).max(-200.0);
    // Adding this number rounds to the nearest integer, which is then in the lowest bits.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    let shifted = y + SHIFT;
    let whole = shifted.to_bits() as i32;
    let x = (y - (shifted - SHIFT)) * std::f64::consts::LN_2;
    let rest = 1.0 / 120.0 + x * (1.0 / 720.0 + x * (1.0 / 5040.0 + x * (1.0 / 40320.0)));
    let rest = 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * rest))));
    let scale = f32::from_bits(((whole + 127).max(0) << 23) as u32);
    let is_positive = (base > 0.0) | (exponent == 0.0);
    if is_positive {
        rest as f32 * scale
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::power;

    #[test]
    fn powers_in_lanes_are_those_of_the_library() {
        for i in 0..=4000 {
            let base = i as f32 / 4000.0;
            // The bases include numbers near 0 and near 1.
            let near = libm::exp2f(-(i as f32) / 40.0);
            for base in [base, near, 1.0 - near] {
                for exponent in [0.0, 0.01, 0.5, 1.0, 2.0, 25.6, 100.0, 127.9, 128.0] {
                    let known = libm::pow(f64::from(base), f64::from(exponent));
                    let found = f64::from(power(base, exponent));
                    let off = (found - known).abs();
                    assert!(
                        off <= 1.2e-7 * known + f64::from(f32::MIN_POSITIVE),
                        "{base}^{exponent}: {found} {known}"
                    );
                }
            }
        }
    }
}
