//! Inputs of engines with several values. A shorter input repeats its last value.

/// Calls `make` for each index of the longest input.
pub(super) fn run<T, const N: usize>(lengths: [usize; N], make: impl Fn(usize) -> T) -> Vec<T> {
    let count = lengths.into_iter().max().unwrap_or(0);
    (0..count).map(make).collect()
}

/// Returns the value at an index, the last value for an index after the end, or zero for an empty
/// list.
pub(super) fn at<T: Copy + Default>(values: &[T], i: usize) -> T {
    at_or(values, i, T::default())
}

/// Returns the same value as [`at`], but `empty` for an empty list.
pub(super) fn at_or<T: Copy>(values: &[T], i: usize, empty: T) -> T {
    values.get(i).or(values.last()).copied().unwrap_or(empty)
}
