//! Vector instructions behind safe functions, and the choice of the vectors' width at run time.
//!
//! This is the program's place for `unsafe` code, which is denied elsewhere. Outside of it stand
//! only the stack of the tree's traversal (`bvh/stack.rs`), whose entries are not initialized, and
//! four calls of functions that are compiled for a width that [`Width::detect`] has found
//! (`bvh/walk.rs`, `bvh/prepared_packet.rs`).
//!
//! A function for AVX or AVX-512 has the attribute `target_feature`. The compiler lets only
//! functions with the same attribute call it without `unsafe`, so here only pointers need a proof:
//! every load and store takes a reference to an array of exactly the vector's size.
#![allow(unsafe_code)]

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Arithmetic that is compiled for each vector width. `run` and everything that it calls in its
/// loops must be `#[inline(always)]`.
pub(crate) trait SimdKernel {
    /// The result.
    type Output;

    /// Does the work. `FUSED` is whether the processor has a fast fused multiply-add.
    fn run<const FUSED: bool>(self) -> Self::Output;
}

/// `a b + c`, rounded once if `FUSED`.
#[inline(always)]
pub(crate) fn fused<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Whether every processor that the program is compiled for has a fused multiply-add.
const ALWAYS_FUSED: bool = cfg!(any(target_arch = "aarch64", target_feature = "fma"));

/// Whether the process uses only instructions that every processor of the target has.
static PORTABLE: AtomicBool = AtomicBool::new(false);

/// Makes all later computations of this process the same to the bit on every processor of the
/// target's architecture. Without it, pictures from processors with and without a fused
/// multiply-add differ in the last bits. Rendering is slower: kernels use the vectors that every
/// processor has, and rays are traced one by one.
pub fn use_portable_arithmetic() {
    PORTABLE.store(true, Ordering::Relaxed);
}

/// Returns whether [`use_portable_arithmetic`] was called.
pub(crate) fn is_portable() -> bool {
    PORTABLE.load(Ordering::Relaxed)
}

/// Returns the name of the arithmetic in use. Pictures that are made with the same one have the
/// same bits.
pub(crate) fn arithmetic() -> &'static str {
    match Width::detect() {
        _ if is_portable() => "portable",
        Width::Plain if !ALWAYS_FUSED => "without fused multiply-add",
        _ => "with fused multiply-add",
    }
}

/// The width of the vectors, in ascending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Width {
    /// The vectors that every processor of the target has.
    Plain,
    /// 256 bits, with fused multiply-add and the instructions that count bits.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 512 bits, with everything that `Avx2` has.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// The greatest width that this processor has. Rays ask for it one by one, so it is found once.
static OF_PROCESSOR: OnceLock<Width> = OnceLock::new();

impl Width {
    /// The greatest width that this processor has and the process may use.
    #[inline]
    pub(crate) fn detect() -> Self {
        if is_portable() {
            return Self::Plain;
        }
        *OF_PROCESSOR.get_or_init(Self::of_processor)
    }

    /// The greatest width that this processor has.
    fn of_processor() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt")
        {
            let widest = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            return if widest { Self::Avx512 } else { Self::Avx2 };
        }
        Self::Plain
    }

    /// Runs a kernel with vectors of this width, or of the greatest width that the process may use
    /// if that is less.
    #[inline]
    pub(crate) fn run<W: SimdKernel>(self, work: W) -> W::Output {
        match self.min(Self::detect()) {
            Self::Plain if ALWAYS_FUSED && !is_portable() => work.run::<true>(),
            Self::Plain => work.run::<false>(),
            // SAFETY: the width is at most that of `detect`, which has found these instructions.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { run_avx2(work) },
            // SAFETY: as above; only `detect` returns this width, so it has found them.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { run_avx512(work) },
        }
    }
}

/// Runs a kernel that is compiled for AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<W: SimdKernel>(work: W) -> W::Output {
    work.run::<true>()
}

/// Runs a kernel that is compiled for AVX-512.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
fn run_avx512<W: SimdKernel>(work: W) -> W::Output {
    work.run::<true>()
}

/// Runs a kernel with the widest vectors of this processor.
#[inline]
pub(crate) fn dispatch<W: SimdKernel>(work: W) -> W::Output {
    Width::detect().run(work)
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::*;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;
    use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

    /// Four numbers in a vector that every x86-64 processor has.
    #[derive(Clone, Copy)]
    pub(crate) struct F32x4(__m128);

    impl F32x4 {
        /// Returns a vector with `x` in all four lanes.
        #[inline(always)]
        pub(crate) fn splat(x: f32) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_set1_ps(x) })
        }

        #[inline(always)]
        pub(crate) fn load(from: &[f32; 4]) -> Self {
            // SAFETY: SSE as above; the array is four floats, and the load needs no alignment.
            Self(unsafe { _mm_loadu_ps(from.as_ptr()) })
        }

        #[inline(always)]
        pub(crate) fn to_array(self) -> [f32; 4] {
            let mut to = [0.0; 4];
            // SAFETY: SSE as above; the array is four floats, and the store needs no alignment.
            unsafe { _mm_storeu_ps(to.as_mut_ptr(), self.0) };
            to
        }

        /// Returns the smaller number of each lane, or that of `other` if either is NaN.
        #[inline(always)]
        pub(crate) fn min(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_min_ps(self.0, other.0) })
        }

        /// Returns the greater number of each lane, or that of `other` if either is NaN.
        #[inline(always)]
        pub(crate) fn max(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_max_ps(self.0, other.0) })
        }

        /// Returns a mask with all bits set in the lanes whose numbers are equal.
        #[inline(always)]
        pub(crate) fn equal(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_cmpeq_ps(self.0, other.0) })
        }

        /// Returns a mask with all bits set in the lanes whose numbers differ or include a NaN.
        #[inline(always)]
        pub(crate) fn not_equal(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_cmpneq_ps(self.0, other.0) })
        }

        /// Returns a mask with all bits set in the lanes where `self` is less than `other`.
        #[inline(always)]
        pub(crate) fn less(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_cmplt_ps(self.0, other.0) })
        }

        /// Returns the bits of `a` where this mask has ones, and those of `b` elsewhere.
        #[inline(always)]
        pub(crate) fn select(self, a: Self, b: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_or_ps(_mm_and_ps(self.0, a.0), _mm_andnot_ps(self.0, b.0)) })
        }

        /// Returns a number whose bit `i` is the sign bit of lane `i`.
        #[inline(always)]
        pub(crate) fn mask(self) -> u32 {
            // SAFETY: SSE is part of every x86-64 processor.
            unsafe { _mm_movemask_ps(self.0) as u32 }
        }

        /// Returns `px qy − py qx`, with the products and their difference in f64.
        #[inline(always)]
        pub(crate) fn cross_in_f64(px: Self, qy: Self, py: Self, qx: Self) -> Self {
            // SAFETY: SSE2 is part of every x86-64 processor.
            unsafe {
                let two = |px, qy, py, qx| {
                    let wide = |a| _mm_cvtps_pd(a);
                    let value = _mm_sub_pd(
                        _mm_mul_pd(wide(px), wide(qy)),
                        _mm_mul_pd(wide(py), wide(qx)),
                    );
                    _mm_cvtpd_ps(value)
                };
                let high = |a| _mm_movehl_ps(a, a);
                let [px, qy, py, qx] = [px.0, qy.0, py.0, qx.0];
                Self(_mm_movelh_ps(
                    two(px, qy, py, qx),
                    two(high(px), high(qy), high(py), high(qx)),
                ))
            }
        }
    }

    macro_rules! operator {
        ($name:ident, $method:ident, $instruction:ident) => {
            impl $name for F32x4 {
                type Output = Self;

                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: SSE is part of every x86-64 processor.
                    Self(unsafe { $instruction(self.0, other.0) })
                }
            }
        };
    }
    operator!(Add, add, _mm_add_ps);
    operator!(Sub, sub, _mm_sub_ps);
    operator!(Mul, mul, _mm_mul_ps);
    operator!(Div, div, _mm_div_ps);
    operator!(BitAnd, bitand, _mm_and_ps);
    operator!(BitOr, bitor, _mm_or_ps);

    #[inline]
    #[target_feature(enable = "avx")]
    pub(crate) fn load_8(from: &[f32; 8]) -> __m256 {
        // SAFETY: the array is eight floats, and the load needs no alignment.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    pub(crate) fn store_8(to: &mut [f32; 8], value: __m256) {
        // SAFETY: the array is eight floats, and the store needs no alignment.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), value) };
    }

    /// Loads sixteen lanes, beginning with lane 0 or 16.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn load_16(from: &[f32; 32], first: usize) -> __m512 {
        // SAFETY: `first & 16` is 0 or 16, so the sixteen floats are in the array; the load needs
        // no alignment.
        unsafe { _mm512_loadu_ps(from.as_ptr().add(first & 16)) }
    }

    /// Stores those of sixteen lanes whose bit is set, beginning with lane 0 or 16.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn store_some_16(to: &mut [f32; 32], first: usize, lanes: u16, value: __m512) {
        // SAFETY: as in `load_16`.
        unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr().add(first & 16), lanes, value) };
    }

    /// Stores a number in those of sixteen lanes whose bit is set, beginning with lane 0 or 16.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn fill_some_16(to: &mut [u32; 32], first: usize, lanes: u16, value: u32) {
        let value = _mm512_set1_epi32(value as i32);
        // SAFETY: as in `load_16`; `u32` and `i32` have the same layout.
        unsafe { _mm512_mask_storeu_epi32(to.as_mut_ptr().add(first & 16).cast(), lanes, value) };
    }

    /// Returns `x` by an instruction that the compiler cannot merge with that of another `I`.
    #[inline(always)]
    pub(crate) fn distinct<const I: usize>(mut x: u32) -> u32 {
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
}
