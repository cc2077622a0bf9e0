//! What NEON does in fewer instructions than glam's functions for it: bit masks of eight lanes, and
//! the smaller or greater number where one may be NaN.

use std::arch::aarch64::{
    uint32x4_t, vaddvq_u16, vandq_u16, vceqq_f32, vcleq_f32, vcltq_f32, vld1q_u16, vmaxnmq_f32,
    vminnmq_f32, vreinterpretq_u16_u32, vuzp1q_u16,
};

use glam::Vec4;

/// Defines functions of one instruction for four lanes.
macro_rules! instructions {
    ($($(#[$doc:meta])* $name:ident: $instruction:ident -> $result:ty),*) => {
        $(
            $(#[$doc])*
            #[inline(always)]
            pub(super) fn $name(a: Vec4, b: Vec4) -> $result {
                // SAFETY: NEON belongs to the instructions of every aarch64 target.
                unsafe { $instruction(a.into(), b.into()) }.into()
            }
        )*
    };
}

instructions!(
    /// Returns the smaller number of each lane, or the other if one is NaN.
    min_num: vminnmq_f32 -> Vec4,
    /// Returns the greater number of each lane, or the other if one is NaN.
    max_num: vmaxnmq_f32 -> Vec4,
    /// Returns the lanes in which `a` is less than `b`.
    less: vcltq_f32 -> uint32x4_t,
    /// Returns the lanes in which `a` is at most `b`.
    at_most: vcleq_f32 -> uint32x4_t,
    /// Returns the lanes in which the numbers are equal.
    equal: vceqq_f32 -> uint32x4_t
);

/// Returns a bit mask of the lanes of two comparisons.
#[inline(always)]
pub(super) fn mask([low, high]: [uint32x4_t; 2]) -> u32 {
    const BITS: [u16; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
    // SAFETY: NEON belongs to the instructions of every aarch64 target, and the array has the
    // eight numbers that are loaded.
    u32::from(unsafe {
        let halves = vuzp1q_u16(vreinterpretq_u16_u32(low), vreinterpretq_u16_u32(high));
        vaddvq_u16(vandq_u16(halves, vld1q_u16(BITS.as_ptr())))
    })
}
