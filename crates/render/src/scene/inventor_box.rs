//! Bounding boxes with a matrix, which are joined as in Inventor.
//!
//! `viewAll` places the camera by this box, so it must be that of the old libraries and not the
//! exact one. Two boxes are joined in the space of one of them, whichever gives the smaller volume.
//! A separator first joins its contents in its own space.

use glam::{DMat4, DVec3};

/// A box in the space of a matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct InventorBox {
    min: DVec3,
    max: DVec3,
    matrix: DMat4,
}

impl InventorBox {
    /// A box with the matrix from its space to the enclosing one.
    pub(super) fn new((min, max): (DVec3, DVec3), matrix: DMat4) -> Self {
        Self { min, max, matrix }
    }

    /// The box after a further matrix.
    pub(super) fn under(self, matrix: DMat4) -> Self {
        Self {
            matrix: matrix * self.matrix,
            ..self
        }
    }

    /// The box of two boxes.
    pub(super) fn join(self, other: Self) -> Self {
        let first = self.extended_by(&other);
        let second = other.extended_by(&self);
        match (first, second) {
            (Some(a), Some(b)) => {
                let (va, vb) = (a.volume(), b.volume());
                let first_is_smaller = if va != 0.0 || vb != 0.0 {
                    va < vb
                } else {
                    a.flat_measure() < b.flat_measure()
                };
                if first_is_smaller { a } else { b }
            }
            (Some(a), None) => a,
            (None, Some(b)) => b,
            (None, None) => {
                let (a, b) = (self.project(), other.project());
                Self::new((a.0.min(b.0), a.1.max(b.1)), DMat4::IDENTITY)
            }
        }
    }

    /// The box in the space of this one that contains another; `None` if the matrix has no inverse.
    fn extended_by(&self, other: &Self) -> Option<Self> {
        let inverse = self.matrix.inverse();
        if !inverse.is_finite() {
            return None;
        }
        let into = inverse * other.matrix;
        let mut out = *self;
        for corner in other.corners() {
            let p = into.project_point3(corner);
            out.min = out.min.min(p);
            out.max = out.max.max(p);
        }
        Some(out)
    }

    fn corners(&self) -> impl Iterator<Item = DVec3> {
        let (min, max) = (self.min, self.max);
        (0..8).map(move |i| {
            DVec3::new(
                if i & 4 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 1 == 0 { min.z } else { max.z },
            )
        })
    }

    fn volume(&self) -> f64 {
        let size = self.max - self.min;
        (size.x * size.y * size.z * self.matrix.determinant()).abs()
    }

    /// The area or length of a box whose volume is 0.
    fn flat_measure(&self) -> f64 {
        let size = self.max - self.min;
        let m = &self.matrix;
        let spans = [
            size.x * m.x_axis.truncate().length(),
            size.y * m.y_axis.truncate().length(),
            size.z * m.z_axis.truncate().length(),
        ];
        spans.iter().filter(|s| **s != 0.0).product()
    }

    /// The axis-aligned box around this one, as its smallest and largest corner.
    pub(super) fn project(&self) -> (DVec3, DVec3) {
        let mut points = self.corners().map(|c| self.matrix.project_point3(c));
        let first = points.next().unwrap_or_default();
        points.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_with_the_same_matrix_are_joined_in_its_space() {
        let turn = DMat4::from_rotation_z(0.5);
        let unit = (DVec3::ZERO, DVec3::ONE);
        let a = InventorBox::new(unit, turn);
        let b = InventorBox::new(unit, turn * DMat4::from_translation(DVec3::X));
        let joined = a.join(b);
        assert!((joined.volume() - 2.0).abs() < 1e-12);
    }
}
