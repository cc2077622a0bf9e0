//! Vector instructions behind safe functions, and the choice of the vectors' width at run time.
//!
//! This is the program's place for `unsafe` code, which is denied elsewhere. Outside of it stand
//! only the stack of the tree's traversal (`bvh/stack.rs`), whose entries are not initialized, two
//! calls of functions that are compiled for a width that [`Width::detect`] has found
//! (`bvh/walk.rs`), and one of the C library (`memory/free_blocks.rs`).
//!
//! A function for AVX or AVX-512 has the attribute `target_feature`. The compiler lets only
//! functions with the same attribute call it without `unsafe`, or a value of a type of [`Vectors`]
//! proves that the processor has the instructions. Pointers need another proof: every load and
//! store takes a reference to an array and stays inside it.
#![allow(unsafe_code)]

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Arithmetic that is compiled for each vector width. `run` and everything that it calls in its
/// loops must be `#[inline(always)]`.
pub trait SimdKernel {
    /// The result.
    type Output;

    /// Does the work. `FUSED` is whether the processor has a fast fused multiply-add.
    fn run<const FUSED: bool>(self) -> Self::Output;
}

/// `a b + c`, rounded once if `FUSED`.
#[inline(always)]
pub fn fused<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
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
pub fn is_portable() -> bool {
    PORTABLE.load(Ordering::Relaxed)
}

/// Returns the name of the arithmetic in use. Pictures that are made with the same one have the
/// same bits.
pub fn arithmetic() -> &'static str {
    match Width::detect() {
        _ if is_portable() => "portable",
        Width::Plain if !ALWAYS_FUSED => "without fused multiply-add",
        _ => "with fused multiply-add",
    }
}

/// The width of the vectors, in ascending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
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
    pub fn detect() -> Self {
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
    pub fn run<W: SimdKernel>(self, work: W) -> W::Output {
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
pub fn dispatch<W: SimdKernel>(work: W) -> W::Output {
    Width::detect().run(work)
}

/// The vectors of `f32` of a processor. A value of such a type proves that the process may use
/// their instructions, so its functions are safe. They must be inlined into a function that enables
/// these instructions, as [`dispatch_vectors`] does.
pub trait Vectors: Copy {
    /// A vector.
    type Vector: Copy;

    /// The numbers of a vector. It is a power of two.
    const LANES: usize;

    /// Returns a vector with `x` in all lanes.
    fn splat(self, x: f32) -> Self::Vector;

    /// Loads the numbers from index `first` on, a multiple of [`Self::LANES`].
    fn load<const N: usize>(self, from: &[f32; N], first: usize) -> Self::Vector;

    /// Returns `a + b` of each lane.
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns `a - b` of each lane.
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns `a b` of each lane.
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns `a / b` of each lane.
    fn div(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns `a b + c`, rounded once.
    fn fused(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;

    /// Returns the smaller number of each lane, or that of `b` if either is NaN.
    fn min(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns the greater number of each lane, or that of `b` if either is NaN.
    fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns the absolute number of each lane.
    fn abs(self, a: Self::Vector) -> Self::Vector;

    /// Returns a bit mask of the lanes in which `a` is less than `b`.
    fn less(self, a: Self::Vector, b: Self::Vector) -> u32;

    /// Returns a bit mask of the lanes in which `a` is at most `b`.
    fn at_most(self, a: Self::Vector, b: Self::Vector) -> u32;

    /// Returns a bit mask of the lanes in which the numbers are equal.
    fn equal(self, a: Self::Vector, b: Self::Vector) -> u32;

    /// Returns the greatest number of all lanes; none may be NaN.
    fn greatest(self, a: Self::Vector) -> f32;

    /// Stores the lanes of a bit mask from index `first` on, a multiple of [`Self::LANES`].
    fn store<const N: usize>(self, to: &mut [f32; N], first: usize, lanes: u32, a: Self::Vector);

    /// Stores a number in the lanes of a bit mask from index `first` on, a multiple of
    /// [`Self::LANES`].
    fn fill<const N: usize>(self, to: &mut [u32; N], first: usize, lanes: u32, value: u32);
}

/// Work that is written with vectors, because the compiler makes none of its plain form.
pub trait VectorKernel {
    /// The result.
    type Output;

    /// Does the work. `eight` has vectors of eight numbers. This and everything that it calls with
    /// vectors must be `#[inline(always)]`.
    fn run<V: Vectors, E: Vectors>(self, vectors: V, eight: E) -> Self::Output;

    /// Does the same without vectors.
    fn run_plain(self) -> Self::Output;
}

/// Runs a kernel with the widest vectors of this processor.
#[inline]
pub fn dispatch_vectors<K: VectorKernel>(kernel: K) -> K::Output {
    match Width::detect() {
        Width::Plain => kernel.run_plain(),
        // SAFETY: `detect` has just found all instructions that the function enables.
        #[cfg(target_arch = "x86_64")]
        Width::Avx2 => unsafe { run_vectors_avx2(kernel) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Width::Avx512 => unsafe { run_vectors_avx512(kernel) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_vectors_avx2<K: VectorKernel>(kernel: K) -> K::Output {
    let eight = Avx2(());
    kernel.run(eight, eight)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_vectors_avx512<K: VectorKernel>(kernel: K) -> K::Output {
    kernel.run(Avx512(()), Avx2(()))
}

#[cfg(target_arch = "x86_64")]
pub use x86::*;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;
    use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

    use super::Vectors;

    /// Four numbers in a vector that every x86-64 processor has.
    #[derive(Clone, Copy)]
    pub struct F32x4(__m128);

    impl F32x4 {
        /// Returns a vector with `x` in all four lanes.
        #[inline(always)]
        pub fn splat(x: f32) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_set1_ps(x) })
        }

        /// Loads four numbers, the first into the first lane.
        #[inline(always)]
        pub fn load(from: &[f32; 4]) -> Self {
            // SAFETY: SSE as above; the array is four floats, and the load needs no alignment.
            Self(unsafe { _mm_loadu_ps(from.as_ptr()) })
        }

        /// Returns the numbers of the four lanes, that of the first lane first.
        #[inline(always)]
        pub fn to_array(self) -> [f32; 4] {
            let mut to = [0.0; 4];
            // SAFETY: SSE as above; the array is four floats, and the store needs no alignment.
            unsafe { _mm_storeu_ps(to.as_mut_ptr(), self.0) };
            to
        }

        /// Returns the smaller number of each lane, or that of `other` if either is NaN.
        #[inline(always)]
        pub fn min(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_min_ps(self.0, other.0) })
        }

        /// Returns the greater number of each lane, or that of `other` if either is NaN.
        #[inline(always)]
        pub fn max(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_max_ps(self.0, other.0) })
        }

        /// Returns a mask with all bits set in the lanes whose numbers are equal.
        #[inline(always)]
        pub fn equal(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_cmpeq_ps(self.0, other.0) })
        }

        /// Returns a mask with all bits set in the lanes whose numbers differ or include a NaN.
        #[inline(always)]
        pub fn not_equal(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_cmpneq_ps(self.0, other.0) })
        }

        /// Returns a mask with all bits set in the lanes where `self` is less than `other`.
        #[inline(always)]
        pub fn less(self, other: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_cmplt_ps(self.0, other.0) })
        }

        /// Returns the bits of `a` where this mask has ones, and those of `b` elsewhere.
        #[inline(always)]
        pub fn select(self, a: Self, b: Self) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            Self(unsafe { _mm_or_ps(_mm_and_ps(self.0, a.0), _mm_andnot_ps(self.0, b.0)) })
        }

        /// Returns a number whose bit `i` is the sign bit of lane `i`.
        #[inline(always)]
        pub fn mask(self) -> u32 {
            // SAFETY: SSE is part of every x86-64 processor.
            unsafe { _mm_movemask_ps(self.0) as u32 }
        }

        /// Returns `px qy − py qx`, with the products and their difference in f64.
        #[inline(always)]
        pub fn cross_in_f64(px: Self, qy: Self, py: Self, qx: Self) -> Self {
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
            fused: _mm256_fmadd_ps(a, b, c);
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
            unsafe { F32x4(_mm256_extractf128_ps::<1>(a)).max(F32x4(_mm256_castps256_ps128(a))) }
                .to_array()
                .into_iter()
                .fold(f32::NEG_INFINITY, f32::max)
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
            fused: _mm512_fmadd_ps(a, b, c);
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
}
