//! An engine's inputs of several values: a shorter one goes on with its last.

use glam::Vec3;

use crate::grammar::value::Get;
use crate::iv::NodeRef;

/// Values of one engine run; more are cut off.
pub const MAX_VALUES: usize = 1 << 22;

/// One value for each of the longest input.
pub fn run<T, const N: usize>(lengths: [usize; N], make: impl Fn(usize) -> T) -> Vec<T> {
    let count = lengths.into_iter().max().unwrap_or(0).min(MAX_VALUES);
    (0..count).map(make).collect()
}

pub fn at<T: Copy + Default>(values: &[T], i: usize) -> T {
    at_or(values, i, T::default())
}

pub fn at_or<T: Copy>(values: &[T], i: usize, silent: T) -> T {
    values.get(i).or(values.last()).copied().unwrap_or(silent)
}

pub fn list<'a, T, U>(node: NodeRef<'a>, name: &str) -> &'a [U]
where
    T: Get<Out<'a> = &'a [U]> + ?Sized,
    U: 'a,
{
    node.read::<T>(name).unwrap_or(&[])
}

pub fn floats<'a>(node: NodeRef<'a>, name: &str) -> &'a [f32] {
    list::<[f32], _>(node, name)
}

pub fn vectors<'a>(node: NodeRef<'a>, name: &str) -> &'a [Vec3] {
    list::<[Vec3], _>(node, name)
}
