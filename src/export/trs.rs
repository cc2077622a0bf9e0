//! Splits matrices into translation, rotation and scale, which are all that a node of most formats
//! can have.
//!
//! A matrix that also shears is the product of two such nodes: by its singular values it is a
//! rotation, a scale and another rotation.

use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Columns whose angle differs from a right angle by less count as orthogonal.
const SQUARE: f64 = 1e-6;

/// A translation after a rotation after a scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trs {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
}

impl Trs {
    /// The identity.
    pub(super) const IDENTITY: Self = Self {
        translation: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        scale: DVec3::ONE,
    };

    /// Returns the parts of a matrix, or `None` if it shears.
    pub(super) fn of(matrix: &DAffine3) -> Option<Self> {
        let m = matrix.matrix3;
        let columns = [m.x_axis, m.y_axis, m.z_axis];
        let lengths = columns.map(DVec3::length);
        for (i, k) in [(0, 1), (1, 2), (2, 0)] {
            if columns[i].dot(columns[k]).abs() > SQUARE * lengths[i] * lengths[k] {
                return None;
            }
        }
        let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let scale = DVec3::from_array(lengths) * DVec3::new(sign, 1.0, 1.0);
        let axes = orthonormal([columns[0] * sign, columns[1], columns[2]]);
        Some(Self {
            translation: matrix.translation,
            rotation: DQuat::from_mat3(&axes).normalize(),
            scale,
        })
    }
}

/// The parts of a matrix: an outer node, and an inner one that only rotates if the matrix shears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub outer: Trs,
    pub inner: Option<DQuat>,
}

/// Splits a finite matrix.
pub(super) fn split(matrix: &DAffine3) -> Split {
    if let Some(outer) = Trs::of(matrix) {
        return Split { outer, inner: None };
    }
    let m = matrix.matrix3;
    let axes = principal_axes(m.transpose() * m);
    let images = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| m * axis);
    let mut scale = DVec3::from_array(images.map(DVec3::length));
    let mut columns = images;
    if m.determinant() < 0.0 {
        scale.x = -scale.x;
        columns[0] = -columns[0];
    }
    let rotation = DQuat::from_mat3(&orthonormal(columns)).normalize();
    let outer = Trs {
        translation: matrix.translation,
        rotation,
        scale,
    };
    let inner = DQuat::from_mat3(&axes.transpose()).normalize();
    Split {
        outer,
        inner: Some(inner),
    }
}

/// Returns a right-handed system of unit vectors along some orthogonal vectors, of which those of
/// length 0 are replaced.
fn orthonormal(columns: [DVec3; 3]) -> DMat3 {
    let longest = columns.map(DVec3::length).into_iter().fold(0.0, f64::max);
    let unit = columns.map(|c| (c.length() > 1e-12 * longest).then(|| c.normalize()));
    let [x, y, z] = unit;
    match (x, y, z) {
        (Some(x), Some(y), _) => DMat3::from_cols(x, y, x.cross(y)),
        (Some(x), None, Some(z)) => DMat3::from_cols(x, z.cross(x), z),
        (None, Some(y), Some(z)) => DMat3::from_cols(y.cross(z), y, z),
        (Some(x), None, None) => {
            let y = x.any_orthonormal_vector();
            DMat3::from_cols(x, y, x.cross(y))
        }
        (None, Some(y), None) => {
            let z = y.any_orthonormal_vector();
            DMat3::from_cols(y.cross(z), y, z)
        }
        (None, None, Some(z)) => {
            let x = z.any_orthonormal_vector();
            DMat3::from_cols(x, z.cross(x), z)
        }
        (None, None, None) => DMat3::IDENTITY,
    }
}

/// Returns the eigenvectors of a symmetric matrix as a rotation, by Jacobi's method. It converges
/// quadratically; six sweeps reach the precision of f64.
fn principal_axes(symmetric: DMat3) -> DMat3 {
    let mut a = symmetric.transpose().to_cols_array_2d();
    let mut axes = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (mut first, mut second) = (a[p], a[q]);
            for k in 0..3 {
                (first[k], second[k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
            }
            (a[p], a[q]) = (first, second);
            // `axes` has the eigenvectors as its columns, each stored as a row here.
            let (x, y) = (axes[p], axes[q]);
            for k in 0..3 {
                (axes[p][k], axes[q][k]) = (c * x[k] - s * y[k], s * x[k] + c * y[k]);
            }
        }
    }
    DMat3::from_cols_array_2d(&axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product(split: &Split) -> DAffine3 {
        let Trs {
            translation,
            rotation,
            scale,
        } = split.outer;
        let outer = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
        outer * DAffine3::from_quat(split.inner.unwrap_or(DQuat::IDENTITY))
    }

    fn turn(angle: f64) -> DAffine3 {
        DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -3.0).normalize(), angle)
    }

    #[test]
    fn a_matrix_is_the_product_of_its_parts() {
        let scale = |x, y, z| DAffine3::from_scale(DVec3::new(x, y, z));
        let moved = DAffine3::from_translation(DVec3::new(4.0, 5.0, -6.0));
        let sheared = turn(0.7) * scale(1.0, 3.0, 0.2) * turn(-1.1) * scale(2.0, 1.0, 1.0);
        for (matrix, shears) in [
            (moved * turn(0.4) * scale(1.0, 2.0, 3.0), false),
            (moved * turn(2.9) * scale(-1.0, 2.0, 3.0), false),
            (turn(1.0) * scale(1.0, 0.0, 2.0), false),
            (turn(1.0) * scale(0.0, 0.0, 2.0), false),
            (moved * sheared, true),
            (moved * sheared * scale(1.0, -1.0, 1.0), true),
            (sheared * scale(1.0, 0.0, 1.0) * turn(0.3), true),
        ] {
            let parts = split(&matrix);
            assert_eq!(parts.inner.is_some(), shears, "{matrix}");
            let off = product(&parts).to_cols_array().into_iter();
            let off = off.zip(matrix.to_cols_array()).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-12, "{matrix}");
            assert!((parts.outer.rotation.length() - 1.0).abs() < 1e-14);
        }
    }
}
