//! Vectors of AVX2 and AVX-512.

use std::arch::x86_64::*;

use glam::Vec4;

use super::Vectors;

/// Loads eight numbers, the first into the first lane.
///
/// # Safety
/// The processor must have AVX.
#[inline]
#[target_feature(enable = "avx")]
pub fn load_8(from: &[f32; 8]) -> __m256 {
    // SAFETY: the array is eight floats, and the load needs no alignment.
    unsafe { _mm256_loadu_ps(from.as_ptr()) }
}

/// Stores the numbers of the eight lanes, that of the first lane first.
///
/// # Safety
/// The processor must have AVX.
#[inline]
#[target_feature(enable = "avx")]
pub fn store_8(to: &mut [f32; 8], value: __m256) {
    // SAFETY: the array is eight floats, and the store needs no alignment.
    unsafe { _mm256_storeu_ps(to.as_mut_ptr(), value) };
}

/// Vectors of eight numbers. Only [`super::dispatch_vectors`] makes a value.
#[derive(Clone, Copy)]
pub struct Avx2(pub(super) ());

/// Vectors of sixteen numbers. Only [`super::dispatch_vectors`] makes a value.
#[derive(Clone, Copy)]
pub struct Avx512(pub(super) ());

/// Defines functions of [`Vectors`] that are one instruction.
macro_rules! one_instruction {
    ($($name:ident: $instruction:ident($($operand:ident),+);)+) => {
        $(
            #[inline(always)]
            fn $name(self, $($operand: Self::Vector),+) -> Self::Vector {
                // SAFETY: the value proves that the processor has the instruction.
                unsafe { $instruction($($operand),+) }
            }
        )+
    };
}

impl Avx2 {
    /// Returns a vector whose lanes have all bits set if the bit of the mask is set.
    #[inline(always)]
    fn mask(self, lanes: u32) -> __m256i {
        // SAFETY: the value proves that the processor has the instructions.
        unsafe {
            let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let all = _mm256_set1_epi32(lanes as i32);
            _mm256_cmpeq_epi32(_mm256_and_si256(all, bit), bit)
        }
    }

    #[inline(always)]
    fn compare<const OPERATION: i32>(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the value proves that the processor has the instructions.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<OPERATION>(a, b)) as u32 }
    }
}

impl Vectors for Avx2 {
    type Vector = __m256;

    const LANES: usize = 8;

    one_instruction! {
        add: _mm256_add_ps(a, b);
        sub: _mm256_sub_ps(a, b);
        mul: _mm256_mul_ps(a, b);
        div: _mm256_div_ps(a, b);
        multiply_add: _mm256_fmadd_ps(a, b, c);
        min: _mm256_min_ps(a, b);
        max: _mm256_max_ps(a, b);
    }

    #[inline(always)]
    fn splat(self, x: f32) -> __m256 {
        // SAFETY: the value proves that the processor has the instruction.
        unsafe { _mm256_set1_ps(x) }
    }

    #[inline(always)]
    fn load<const N: usize>(self, from: &[f32; N], first: usize) -> __m256 {
        // SAFETY: as above. The index is at most N − 8, because no bit beyond those of N − 8 is
        // kept, so the eight numbers are in the array; the load needs no alignment.
        unsafe { _mm256_loadu_ps(from.as_ptr().add(first & const { N - 8 })) }
    }

    #[inline(always)]
    fn abs(self, a: __m256) -> __m256 {
        // SAFETY: the value proves that the processor has the instructions.
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
    }

    #[inline(always)]
    fn less(self, a: __m256, b: __m256) -> u32 {
        self.compare::<_CMP_LT_OQ>(a, b)
    }

    #[inline(always)]
    fn at_most(self, a: __m256, b: __m256) -> u32 {
        self.compare::<_CMP_LE_OQ>(a, b)
    }

    #[inline(always)]
    fn equal(self, a: __m256, b: __m256) -> u32 {
        self.compare::<_CMP_EQ_OQ>(a, b)
    }

    #[inline(always)]
    fn greatest(self, a: __m256) -> f32 {
        // SAFETY: the value proves that the processor has the instructions.
        unsafe {
            let halves = [_mm256_extractf128_ps::<1>(a), _mm256_castps256_ps128(a)];
            Vec4::from(_mm_max_ps(halves[0], halves[1])).max_element()
        }
    }

    #[inline(always)]
    fn store<const N: usize>(self, to: &mut [f32; N], first: usize, lanes: u32, a: __m256) {
        let mask = self.mask(lanes);
        // SAFETY: as in `load`.
        unsafe { _mm256_maskstore_ps(to.as_mut_ptr().add(first & const { N - 8 }), mask, a) };
    }

    #[inline(always)]
    fn fill<const N: usize>(self, to: &mut [u32; N], first: usize, lanes: u32, value: u32) {
        let mask = self.mask(lanes);
        // SAFETY: as in `load`; `u32` and `i32` have the same layout.
        unsafe {
            let to = to.as_mut_ptr().add(first & const { N - 8 });
            _mm256_maskstore_epi32(to.cast(), mask, _mm256_set1_epi32(value as i32));
        }
    }
}

impl Vectors for Avx512 {
    type Vector = __m512;

    const LANES: usize = 16;

    one_instruction! {
        add: _mm512_add_ps(a, b);
        sub: _mm512_sub_ps(a, b);
        mul: _mm512_mul_ps(a, b);
        div: _mm512_div_ps(a, b);
        multiply_add: _mm512_fmadd_ps(a, b, c);
        min: _mm512_min_ps(a, b);
        max: _mm512_max_ps(a, b);
        abs: _mm512_abs_ps(a);
    }

    #[inline(always)]
    fn splat(self, x: f32) -> __m512 {
        // SAFETY: the value proves that the processor has the instruction.
        unsafe { _mm512_set1_ps(x) }
    }

    #[inline(always)]
    fn load<const N: usize>(self, from: &[f32; N], first: usize) -> __m512 {
        // SAFETY: as for `Avx2`, with sixteen numbers.
        unsafe { _mm512_loadu_ps(from.as_ptr().add(first & const { N - 16 })) }
    }

    #[inline(always)]
    fn less(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: the value proves that the processor has the instruction.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) })
    }

    #[inline(always)]
    fn at_most(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as above.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) })
    }

    #[inline(always)]
    fn equal(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as above.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a, b) })
    }

    #[inline(always)]
    fn greatest(self, a: __m512) -> f32 {
        // SAFETY: as above.
        unsafe { _mm512_reduce_max_ps(a) }
    }

    #[inline(always)]
    fn store<const N: usize>(self, to: &mut [f32; N], first: usize, lanes: u32, a: __m512) {
        let to = &mut to[first & const { N - 16 }..];
        // SAFETY: as in `load`.
        unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr(), lanes as u16, a) };
    }

    #[inline(always)]
    fn fill<const N: usize>(self, to: &mut [u32; N], first: usize, lanes: u32, value: u32) {
        let to = &mut to[first & const { N - 16 }..];
        // SAFETY: as in `load`; `u32` and `i32` have the same layout.
        unsafe {
            let value = _mm512_set1_epi32(value as i32);
            _mm512_mask_storeu_epi32(to.as_mut_ptr().cast(), lanes as u16, value);
        }
    }
}

/// Returns `x` by an instruction that the compiler cannot merge with that of another `I`.
#[inline(always)]
pub fn distinct<const I: usize>(mut x: u32) -> u32 {
    // SAFETY: the assembly is a comment and contains no instruction; `x` stays as it is.
    unsafe {
        std::arch::asm!(
            "/* {1} {0:e} */",
            inout(reg) x,
            const I,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    x
}
