//! An engine's inputs of several values: a shorter one repeats its last.

/// The most values that an engine computes; further ones are left out.
pub(super) const MAX_VALUES: usize = 1 << 22;

/// Makes one value for each value of the longest input.
pub(super) fn run<T, const N: usize>(lengths: [usize; N], make: impl Fn(usize) -> T) -> Vec<T> {
    let count = lengths.into_iter().max().unwrap_or(0).min(MAX_VALUES);
    (0..count).map(make).collect()
}

/// Returns the value at an index, the last one past the end, or zero of an empty list.
pub(super) fn at<T: Copy + Default>(values: &[T], i: usize) -> T {
    at_or(values, i, T::default())
}

/// Returns the same as [`at`], with another value for an empty list.
pub(super) fn at_or<T: Copy>(values: &[T], i: usize, silent: T) -> T {
    values.get(i).or(values.last()).copied().unwrap_or(silent)
}
