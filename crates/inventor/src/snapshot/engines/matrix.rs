//! Composes a matrix from Inventor's translation, rotation, scale and scale orientation, and
//! decomposes a matrix into them.

use glam::{DMat3, DMat4, DQuat, DVec3};

use crate::pose::diagonal;

/// The parts of a matrix. It scales along the axes of `scale_orientation`, then rotates, both about
/// a center, then translates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parts {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
    pub scale_orientation: DQuat,
}

/// Returns the matrix of the parts.
pub(super) fn compose(parts: &Parts, center: DVec3) -> DMat4 {
    let along = DMat4::from_quat(parts.scale_orientation);
    DMat4::from_translation(parts.translation + center)
        * DMat4::from_quat(parts.rotation)
        * along
        * DMat4::from_scale(parts.scale)
        * along.transpose()
        * DMat4::from_translation(-center)
}

/// Decomposes a matrix by polar decomposition. A perspective part is ignored. A singular matrix
/// gives only its translation.
pub(super) fn decompose(m: DMat4, center: DVec3) -> Parts {
    let linear = DMat3::from_mat4(m);
    let translation = m.w_axis.truncate() - center + linear * center;
    let identity = Parts {
        translation,
        rotation: DQuat::IDENTITY,
        scale: DVec3::ONE,
        scale_orientation: DQuat::IDENTITY,
    };
    let Some(turn) = nearest_turn(linear) else {
        return identity;
    };
    let mirrored = turn.determinant() < 0.0;
    let turn = if mirrored { -turn } else { turn };
    let stretch = turn.transpose() * linear;
    let (scale, axes) = diagonal(stretch);
    Parts {
        rotation: quaternion(turn),
        scale,
        scale_orientation: quaternion(axes),
        ..identity
    }
}

/// Returns the orthogonal matrix nearest to a matrix, by Newton's iteration (Higham, Computing the
/// Polar Decomposition, 1986), or `None` for a singular matrix.
fn nearest_turn(m: DMat3) -> Option<DMat3> {
    let mut q = m;
    for _ in 0..64 {
        if !(q.determinant().abs() > 1e-300) {
            return None;
        }
        let next = 0.5 * (q + q.inverse().transpose());
        let change = (next - q)
            .to_cols_array()
            .iter()
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        q = next;
        if !(change > 1e-15) {
            break;
        }
    }
    q.is_finite().then_some(q)
}

/// Returns the unit quaternion of a rotation matrix.
pub(super) fn quaternion(turn: DMat3) -> DQuat {
    DQuat::from_mat3(&turn).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decomposing_a_composed_matrix_returns_its_parts() {
        let parts = Parts {
            translation: DVec3::new(1.0, -2.0, 3.0),
            rotation: DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 1.1),
            scale: DVec3::new(2.0, 0.5, 3.0),
            scale_orientation: DQuat::from_axis_angle(DVec3::Y, 0.4),
        };
        let center = DVec3::new(0.3, 0.0, -1.0);
        let m = compose(&parts, center);
        let apart = decompose(m, center);
        assert!((apart.translation - parts.translation).length() < 1e-12);
        assert!(apart.rotation.dot(parts.rotation).abs() > 1.0 - 1e-12);
        assert!(compose(&apart, center).abs_diff_eq(m, 1e-6));
    }

    #[test]
    fn mirrors_and_flat_matrices_do_not_break() {
        let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        assert!(compose(&decompose(mirror, DVec3::ZERO), DVec3::ZERO).abs_diff_eq(mirror, 1e-9));
        for bad in [
            DMat4::ZERO,
            DMat4::NAN,
            DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)),
        ] {
            assert!(decompose(bad, DVec3::ZERO).rotation.is_finite());
        }
    }
}
