//! Vector instructions behind safe functions, and the choice of the vectors' width at run time.
//!
//! This is the program's place for `unsafe` code, which is denied elsewhere. Outside of it stand
//! only the stack of the tree's traversal (`bvh/stack.rs`), whose entries are not initialized, two
//! calls of functions that are compiled for a width that [`Width::detect`] has found
//! (`bvh/walk.rs`), one of the C library (`memory/free_blocks.rs`), the mapping of large files
//! (`files/mapped.rs`), and a look at standard output (`files/standard_output.rs`).
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
/// multiply-add differ in the last bits. Rendering is slower: kernels and rays use the vectors that
/// every processor has.
pub fn use_portable_arithmetic() {
    PORTABLE.store(true, Ordering::Relaxed);
}

/// Returns whether [`use_portable_arithmetic`] was called.
#[inline]
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

    /// Returns `a b + c`, rounded once, or after the product too if the processor rounds twice.
    fn multiply_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;

    /// Returns the smaller number of each lane, or that of `b` if either is NaN.
    fn min(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns the greater number of each lane, or that of `b` if either is NaN.
    fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Returns the smaller number of each lane, or that of `b` if that of `a` is NaN. No number of
    /// `b` may be NaN, so that NEON needs one instruction.
    #[inline(always)]
    fn min_num(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        self.min(a, b)
    }

    /// Returns the greater number of each lane, as [`Vectors::min_num`] returns the smaller.
    #[inline(always)]
    fn max_num(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        self.max(a, b)
    }

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
}

/// Runs a kernel with the widest vectors of this processor.
#[inline]
pub fn dispatch_vectors<K: VectorKernel>(kernel: K) -> K::Output {
    match Width::detect() {
        Width::Plain => kernel.run(Quads, Quads),
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

#[cfg(target_arch = "aarch64")]
mod neon;
mod quads;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use quads::Quads;
#[cfg(target_arch = "x86_64")]
pub use x86::*;
