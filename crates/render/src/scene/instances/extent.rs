//! The size of a prototype, and whether it can be placed without loss of precision.

use glam::{DAffine3, DMat4, DVec3, DVec4};
use ivcam_inventor::traversal::Grid;

use super::shape::{ShapeLists, ShapePrimitives};

/// The largest number of primitives of a scene, each as often as it is drawn. The order of drawing
/// has 61 bits.
const MOST: u64 = 1 << 60;
/// The largest stretch by a matrix, and the inverse of the smallest. Beyond them, rounding in f32
/// would have to be examined, and positions would leave the range of compiling.
const STRETCH: f64 = 1e12;
/// The farthest coordinate in meters.
const FARTHEST: f64 = 1e17;

/// The size of what a prototype draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) struct Extent {
    /// The number of primitives, each as often as it is drawn.
    pub count: u64,
    /// The number of prototypes that are drawn, each as often as it is.
    pub placed: u64,
    /// A box around all primitives in the prototype's space.
    pub bounds: (DVec3, DVec3),
    /// Bounds of the least and the largest stretch between any primitive and the prototype.
    stretch: (f64, f64),
    /// The largest number of prototypes inside each other.
    pub depth: u32,
}

impl Extent {
    /// The largest depth of prototypes inside each other, which bounds the stack of a search.
    pub(in crate::scene) const DEEPEST: u32 = 64;

    /// The extent of no primitives.
    pub(in crate::scene) const NONE: Self = Self {
        count: 0,
        placed: 0,
        bounds: (DVec3::INFINITY, DVec3::NEG_INFINITY),
        stretch: (1.0, 1.0),
        depth: 0,
    };

    /// Returns an extent with `count` primitives whose place is not known.
    pub(super) fn of_count(count: u64) -> Self {
        Self {
            count,
            ..Self::NONE
        }
    }

    /// Returns the extent of a shape's primitives in a prototype. `matrices` lead from the
    /// prototype's space to their object space: see [`Self::under`].
    pub(in crate::scene) fn of_shape(
        lists: ShapeLists<'_>,
        shape: &ShapePrimitives,
        matrices: &[DMat4],
    ) -> Option<Self> {
        let matrix = product(matrices);
        let boxes = lists.numbers(shape).map(|n| lists.around(n, &matrix));
        let bounds = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let extent = Self::of_count(shape.len()).under(matrices)?;
        Some(Self { bounds, ..extent })
    }

    /// Whether nothing is drawn.
    pub(in crate::scene) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the extent of the copies of a prototype on a grid, or `None` if they are too many.
    pub(super) fn copied(&self, grid: &Grid) -> Option<Self> {
        let (low, high) = grid_bounds(grid, [0; 3], grid.last());
        Some(Self {
            count: self.count.checked_mul(grid.len()).filter(|n| *n <= MOST)?,
            placed: self.placed.saturating_mul(grid.len()),
            bounds: (self.bounds.0 + low, self.bounds.1 + high),
            ..*self
        })
    }

    /// Returns the extent under a product of matrices, or `None` if one of them is not affine or
    /// does not stretch space within the limits.
    pub(in crate::scene) fn under(&self, matrices: &[DMat4]) -> Option<Self> {
        let is_affine = |m: &DMat4| {
            let row = DVec4::new(m.x_axis.w, m.y_axis.w, m.z_axis.w, m.w_axis.w);
            row == DVec4::W && m.is_finite()
        };
        if !matrices.iter().all(is_affine) {
            return None;
        }
        let product = product(matrices);
        let norm = |m: DAffine3| {
            let squares = m.matrix3.to_cols_array().map(|x| x * x);
            squares.iter().sum::<f64>().sqrt()
        };
        let (least, most) = (1.0 / norm(product.inverse()), norm(product));
        let stretch = (least * self.stretch.0, most * self.stretch.1);
        let fits = stretch.0 >= 1.0 / STRETCH && stretch.1 <= STRETCH; // false for NaN
        fits.then(|| Self {
            bounds: moved(self.bounds, &product),
            stretch,
            ..*self
        })
    }

    /// Adds what is drawn beside it. Returns `None` if that is too much.
    pub(super) fn and(&self, other: &Self) -> Option<Self> {
        let count = self.count.checked_add(other.count)?;
        let depth = self.depth.max(other.depth);
        (count <= MOST).then_some(Self {
            count,
            placed: self.placed.saturating_add(other.placed),
            bounds: (
                self.bounds.0.min(other.bounds.0),
                self.bounds.1.max(other.bounds.1),
            ),
            stretch: (
                self.stretch.0.min(other.stretch.0),
                self.stretch.1.max(other.stretch.1),
            ),
            depth,
        })
    }

    /// The extent as a part of another prototype.
    pub(super) fn inside(&self) -> Self {
        Self {
            placed: self.placed.saturating_add(1),
            depth: self.depth + 1,
            ..*self
        }
    }

    /// Whether all positions in the world are near enough to the scene's origin.
    pub(in crate::scene) fn is_in_reach(&self, origin: DVec3) -> bool {
        let (low, high) = (self.bounds.0 - origin, self.bounds.1 - origin);
        low.abs().max(high.abs()).max_element() < FARTHEST
    }
}

/// The product of affine matrices, as an approximation of what compiling computes.
pub(in crate::scene) fn product(matrices: &[DMat4]) -> DAffine3 {
    let all = matrices.iter().fold(DMat4::IDENTITY, |all, m| all * *m);
    DAffine3::from_mat4(all)
}

/// Returns the box around a box under a matrix.
pub(in crate::scene) fn moved((low, high): (DVec3, DVec3), matrix: &DAffine3) -> (DVec3, DVec3) {
    let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
    let (center, reach) = (matrix.transform_point3(center), absolute(matrix, half));
    (center - reach, center + reach)
}

/// The product of a matrix and a vector, both without signs.
pub(super) fn absolute(matrix: &DAffine3, v: DVec3) -> DVec3 {
    let m = matrix.matrix3;
    m.x_axis.abs() * v.x + m.y_axis.abs() * v.y + m.z_axis.abs() * v.z
}

/// Returns the box around the translations of a grid's copies from one place to another.
pub(in crate::scene) fn grid_bounds(grid: &Grid, from: [u64; 3], to: [u64; 3]) -> (DVec3, DVec3) {
    let corners = grid.corners(from, to).into_iter();
    corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    })
}
