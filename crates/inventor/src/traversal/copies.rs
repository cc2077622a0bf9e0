//! The copies that an `Array` or a `MultipleCopy` makes of its children.
//!
//! A walk asks for one copy at a time, so that an array of any size takes no memory.

use glam::{DMat4, DVec3, Mat4};

use crate::grammar::{array, multiple_copy};
use crate::iv::NodeRef;

/// The copies of an `Array`, on a grid with x fastest and z slowest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The numbers of copies along the three directions.
    pub counts: [u64; 3],
    /// The steps from one copy to the next along each direction, in the array's space.
    steps: [DVec3; 3],
    /// The position of the first copy along each direction, in steps.
    from: [f64; 3],
}

impl Grid {
    /// The grid of an `Array`. A negative number of elements counts as 0.
    pub fn from_node(node: NodeRef<'_>) -> Self {
        let counts = [
            array::NUM_ELEMENTS1,
            array::NUM_ELEMENTS2,
            array::NUM_ELEMENTS3,
        ];
        let steps = [array::SEPARATION1, array::SEPARATION2, array::SEPARATION3];
        let counts = counts.map(|field| u64::try_from(node.get(field)).unwrap_or(0));
        let origin = node.get(array::ORIGIN);
        Self {
            counts,
            steps: steps.map(|field| node.get(field).as_dvec3()),
            from: counts.map(|n| match origin {
                array::ORIGIN_CENTER => 0.5 - 0.5 * n as f64,
                array::ORIGIN_LAST => 1.0 - n as f64,
                _ => 0.0,
            }),
        }
    }

    /// The number of copies. Three 16-bit numbers cannot overflow it, and larger ones saturate.
    pub fn len(&self) -> u64 {
        self.counts.into_iter().fold(1, u64::saturating_mul)
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The translation of the copy with a number below [`Self::len`].
    #[inline]
    pub fn offset(&self, number: u64) -> DVec3 {
        let [columns, rows, _] = self.counts;
        self.offset_at([
            number % columns,
            number / columns % rows,
            number / columns / rows,
        ])
    }

    /// The translation of the copy in a column, a row and a layer.
    #[inline]
    pub fn offset_at(&self, place: [u64; 3]) -> DVec3 {
        let along = |i: usize| (self.from[i] + place[i] as f64) * self.steps[i];
        along(0) + along(1) + along(2)
    }

    /// Returns the grid with each place of this one once: copies without a step between them are at
    /// one place.
    pub fn without_repeats(&self) -> Self {
        let mut grid = *self;
        for axis in 0..3 {
            if grid.steps[axis] == DVec3::ZERO && grid.counts[axis] > 1 {
                (grid.counts[axis], grid.from[axis]) = (1, 0.0);
            }
        }
        grid
    }

    /// Returns the grid whose places are those of the copies of a grid on this one, each once.
    /// Returns `None` if they are not on one grid, or if it has more than 2^31 places along an
    /// axis.
    pub fn of_grids(&self, inner: &Self) -> Option<Self> {
        let mut grid = *self;
        for axis in 0..3 {
            let ends = [self, inner].map(|g| (g.counts[axis], g.steps[axis], g.from[axis]));
            let (count, step, from) = match ends {
                [(1, _, _), inner] => inner,
                [outer, (1, _, _)] => outer,
                [outer, inner] => {
                    on_one_line(outer, inner).or_else(|| on_one_line(inner, outer))?
                }
            };
            (grid.counts[axis], grid.steps[axis], grid.from[axis]) = (count, step, from);
        }
        grid.counts.iter().all(|n| *n < 1 << 31).then_some(grid)
    }

    /// The place of the last copy of a grid that is not empty.
    pub fn last(&self) -> [u64; 3] {
        self.counts.map(|n| n.saturating_sub(1))
    }

    /// The translations of the copies at the corners of a range of places.
    #[inline]
    pub fn corners(&self, from: [u64; 3], to: [u64; 3]) -> [DVec3; 8] {
        std::array::from_fn(|corner| {
            let is_far = |axis: usize| corner >> axis & 1 == 1;
            let place = |axis| if is_far(axis) { to[axis] } else { from[axis] };
            self.offset_at(std::array::from_fn(place))
        })
    }
}

/// The number, step and first position of copies along one axis, the last in steps.
type AxisCopies = (u64, DVec3, f64);

/// Returns the line with the places of copies of a finer line on a coarser one, if its step is a
/// multiple of the finer one's and leaves no gap.
fn on_one_line(coarse: AxisCopies, fine: AxisCopies) -> Option<AxisCopies> {
    let longest = fine.1.abs().max_position();
    let times = coarse.1[longest] / fine.1[longest];
    let is_multiple = times.fract() == 0.0 && times >= 1.0 && times <= fine.0 as f64;
    let fits = is_multiple && fine.1 * times == coarse.1;
    fits.then(|| {
        let count = (coarse.0 - 1).saturating_mul(times as u64);
        (
            count.saturating_add(fine.0),
            fine.1,
            coarse.2 * times + fine.2,
        )
    })
}

/// The copies of an `Array` or a `MultipleCopy`.
#[derive(Clone, Copy)]
pub(super) enum Copies<'a> {
    /// The first copies of an `Array`, up to a number.
    Grid(Grid, u64),
    /// One copy for each matrix of a `MultipleCopy`.
    Matrices(&'a [Mat4]),
}

impl<'a> Copies<'a> {
    /// The copies of a `MultipleCopy`.
    pub(super) fn multiple(node: NodeRef<'a>) -> Self {
        Self::Matrices(node.get(multiple_copy::MATRIX))
    }

    /// Returns the matrix of the copy with a number, relative to the node, or `None` after the last
    /// copy.
    pub(super) fn get(&self, number: u64) -> Option<DMat4> {
        match self {
            Self::Grid(grid, most) => {
                (number < *most).then(|| DMat4::from_translation(grid.offset(number)))
            }
            Self::Matrices(matrices) => {
                let index = usize::try_from(number).ok()?;
                matrices.get(index).map(Mat4::as_dmat4)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn grid(counts: [u64; 3], steps: [f64; 3], from: [f64; 3]) -> Grid {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        Grid {
            counts,
            steps: std::array::from_fn(|axis| steps[axis] * axes[axis]),
            from,
        }
    }

    fn places(grid: &Grid) -> BTreeSet<[i64; 3]> {
        let all = (0..grid.len()).map(|n| (16.0 * grid.offset(n)).to_array());
        all.map(|place| place.map(|x| x as i64)).collect()
    }

    #[test]
    fn a_grid_of_grids_has_each_place_of_their_copies_once() {
        let inner = grid([4, 3, 1], [0.5, 2.0, 9.0], [0.0, -1.0, 0.0]);
        for (outer, fits) in [
            (grid([3, 2, 2], [0.5, 2.0, 7.0], [0.0; 3]), true),
            (grid([3, 1, 5], [2.0, 1.0, 0.25], [-2.0, 0.0, 1.5]), true),
            (grid([3, 9, 1], [1.0, 0.25, 1.0], [0.0; 3]), true),
            (grid([3, 9, 1], [2.5, 1.0, 1.0], [0.0; 3]), false),
            (grid([3, 2, 1], [0.5, 0.75, 1.0], [0.0; 3]), false),
        ] {
            let one = outer.of_grids(&inner);
            assert_eq!(one.is_some(), fits, "{outer:?}");
            let Some(one) = one else { continue };
            let both = places(&outer).into_iter().flat_map(|o| {
                let all = places(&inner).into_iter();
                all.map(move |i| std::array::from_fn(|axis| o[axis] + i[axis]))
            });
            assert_eq!(places(&one), both.collect::<BTreeSet<[i64; 3]>>());
            assert_eq!(places(&one).len() as u64, one.len());
        }
        let flat = grid([5, 2, 7], [0.0, 1.0, 0.0], [3.0, 0.0, -3.0]).without_repeats();
        assert_eq!((flat.len(), places(&flat).len()), (2, 2));
    }
}
