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
