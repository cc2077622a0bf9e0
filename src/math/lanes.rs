//! Work on many values side by side, compiled for every width of vectors that a processor may
//! have, and chosen when the program runs.
//!
//! Such work is loops over plain arrays without branches, which the compiler turns into vectors.
//! Where the processor multiplies and adds in one step, work may ask for that (`FUSED`): it is
//! rounded once instead of twice, so results differ in the last bit from machine to machine
//! (docs/decisions/0002-fused-arithmetic.md), and are the same on one machine always.

/// Values side by side: enough for four of the widest vectors, which hides the wait for roots
/// and quotients.
pub const LANES: usize = 32;

pub type Lane = [f64; LANES];

/// Work to be compiled for each width. `run` must be `#[inline(always)]`, and so must be what it
/// calls in its loops.
pub trait Lanewise {
    type Output;

    fn run<const FUSED: bool>(self) -> Self::Output;
}

/// A sum of a product, rounded once where that is fast.
#[inline(always)]
pub fn fused<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Whether every processor of this kind fuses.
const ALWAYS_FUSED: bool = cfg!(any(target_arch = "aarch64", target_feature = "fma"));

/// The width of the vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    /// The widest that this processor has.
    #[inline]
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            let widest = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            return if widest { Self::Avx512 } else { Self::Avx2 };
        }
        Self::Plain
    }

    /// Does the work with vectors of this width, or of the widest that the processor has.
    #[inline]
    pub fn run<W: Lanewise>(self, work: W) -> W::Output {
        match self.min(Self::detect()) {
            Self::Plain => work.run::<ALWAYS_FUSED>(),
            // SAFETY: the processor was just asked.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { run_avx2(work) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { run_avx512(work) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<W: Lanewise>(work: W) -> W::Output {
    work.run::<true>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
fn run_avx512<W: Lanewise>(work: W) -> W::Output {
    work.run::<true>()
}

/// Does the work as wide as the processor can.
#[inline]
pub fn widely<W: Lanewise>(work: W) -> W::Output {
    Width::detect().run(work)
}
