//! Vectors of four numbers, which the processors of most targets have: SSE2 on x86-64, NEON on
//! aarch64, 128-bit vectors on wasm32 with `simd128`. They are glam's; on other targets glam's are
//! plain numbers.

use glam::Vec4;

use super::Vectors;
#[cfg(target_arch = "aarch64")]
use super::neon as lanes;

/// Vectors of eight numbers, each in two of four.
#[derive(Clone, Copy)]
pub struct Quads;

/// The comparisons and bit masks that glam has, as `neon` has its own.
#[cfg(not(target_arch = "aarch64"))]
mod lanes {
    use glam::{BVec4A, Vec4};

    #[inline(always)]
    pub(super) fn less(a: Vec4, b: Vec4) -> BVec4A {
        a.cmplt(b)
    }

    #[inline(always)]
    pub(super) fn at_most(a: Vec4, b: Vec4) -> BVec4A {
        a.cmple(b)
    }

    #[inline(always)]
    pub(super) fn equal(a: Vec4, b: Vec4) -> BVec4A {
        a.cmpeq(b)
    }

    #[inline(always)]
    pub(super) fn mask([low, high]: [BVec4A; 2]) -> u32 {
        low.bitmask() | high.bitmask() << 4
    }
}

#[inline(always)]
fn both(f: impl Fn(usize) -> Vec4) -> [Vec4; 2] {
    [f(0), f(1)]
}

impl Vectors for Quads {
    type Vector = [Vec4; 2];

    const LANES: usize = 8;

    #[inline(always)]
    fn splat(self, x: f32) -> [Vec4; 2] {
        [Vec4::splat(x); 2]
    }

    #[inline(always)]
    fn load<const N: usize>(self, from: &[f32; N], first: usize) -> [Vec4; 2] {
        // The mask is what keeps the slice in the array, so there is no test of bounds.
        let from = &from[first & const { N - 8 }..];
        both(|half| Vec4::from_slice(&from[4 * half..]))
    }

    #[inline(always)]
    fn add(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| a[half] + b[half])
    }

    #[inline(always)]
    fn sub(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| a[half] - b[half])
    }

    #[inline(always)]
    fn mul(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| a[half] * b[half])
    }

    #[inline(always)]
    fn div(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| a[half] / b[half])
    }

    #[inline(always)]
    fn multiply_add(self, a: [Vec4; 2], b: [Vec4; 2], c: [Vec4; 2]) -> [Vec4; 2] {
        match cfg!(target_arch = "aarch64") {
            true => both(|half| a[half].mul_add(b[half], c[half])),
            false => both(|half| a[half] * b[half] + c[half]),
        }
    }

    #[inline(always)]
    fn min(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| a[half].min(b[half]))
    }

    #[inline(always)]
    fn max(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| a[half].max(b[half]))
    }

    #[cfg(target_arch = "aarch64")]
    #[inline(always)]
    fn min_num(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| lanes::min_num(a[half], b[half]))
    }

    #[cfg(target_arch = "aarch64")]
    #[inline(always)]
    fn max_num(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        both(|half| lanes::max_num(a[half], b[half]))
    }

    #[inline(always)]
    fn abs(self, a: [Vec4; 2]) -> [Vec4; 2] {
        a.map(Vec4::abs)
    }

    #[inline(always)]
    fn less(self, a: [Vec4; 2], b: [Vec4; 2]) -> u32 {
        lanes::mask([0, 1].map(|half| lanes::less(a[half], b[half])))
    }

    #[inline(always)]
    fn at_most(self, a: [Vec4; 2], b: [Vec4; 2]) -> u32 {
        lanes::mask([0, 1].map(|half| lanes::at_most(a[half], b[half])))
    }

    #[inline(always)]
    fn equal(self, a: [Vec4; 2], b: [Vec4; 2]) -> u32 {
        lanes::mask([0, 1].map(|half| lanes::equal(a[half], b[half])))
    }

    #[inline(always)]
    fn greatest(self, a: [Vec4; 2]) -> f32 {
        a[0].max(a[1]).max_element()
    }

    #[inline(always)]
    fn store<const N: usize>(self, to: &mut [f32; N], first: usize, lanes: u32, a: [Vec4; 2]) {
        let to = &mut to[first & const { N - 8 }..];
        for (half, to) in to.chunks_exact_mut(4).take(2).enumerate() {
            let lanes = lanes >> (4 * half) & 15;
            if lanes == 15 {
                a[half].write_to_slice(to);
            } else {
                for (lane, number) in a[half].to_array().into_iter().enumerate() {
                    if lanes >> lane & 1 == 1 {
                        to[lane] = number;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn fill<const N: usize>(self, to: &mut [u32; N], first: usize, lanes: u32, value: u32) {
        let to = &mut to[first & const { N - 8 }..];
        for (lane, to) in to.iter_mut().take(8).enumerate() {
            if lanes >> lane & 1 == 1 {
                *to = value;
            }
        }
    }
}
