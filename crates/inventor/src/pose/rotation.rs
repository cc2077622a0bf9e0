//! Rotations in double precision: conversion from and to axis and angle, and from a matrix.

use glam::{DMat3, DMat4, DQuat, DVec3};

use crate::grammar::value::Rotation;

/// Converts a rotation of a scene to double precision. With an axis of length 0 it is the identity.
pub fn quat(rotation: Rotation) -> DQuat {
    let half = 0.5 * f64::from(rotation.angle);
    match rotation.axis.as_dvec3().try_normalize() {
        Some(axis) if half.is_finite() => {
            let v = axis * libm::sin(half);
            DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(half))
        }
        _ => DQuat::IDENTITY,
    }
}

/// Returns the unit axis and the angle in radians.
pub fn axis_angle(turn: DQuat) -> (DVec3, f64) {
    let v = DVec3::new(turn.x, turn.y, turn.z);
    let angle = 2.0 * libm::atan2(v.length(), turn.w);
    (v.try_normalize().unwrap_or(DVec3::Z), angle)
}

/// Converts a rotation to that of a scene.
pub fn rotation_value(turn: DQuat) -> Rotation {
    let (axis, angle) = axis_angle(turn);
    Rotation::new(axis.as_vec3(), angle as f32)
}

/// Returns the rotation in a matrix: its orthogonal polar factor, by Higham's iteration, which is
/// independent of scale. If the matrix contains a reflection, the negated factor is returned; if it
/// is singular, the identity.
pub fn rotation_of(matrix: DMat4) -> DQuat {
    let mut m = DMat3::from_mat4(matrix);
    if m.determinant() == 0.0 || !m.is_finite() {
        return DQuat::IDENTITY;
    }
    for _ in 0..40 {
        let next = (m + m.inverse().transpose()) * 0.5;
        let change = (next - m)
            .to_cols_array()
            .iter()
            .fold(0.0, |a: f64, c| a.max(c.abs()));
        m = next;
        if change < 1e-15 {
            break;
        }
    }
    if m.determinant() < 0.0 {
        m *= -1.0;
    }
    DQuat::from_mat3(&m).normalize()
}

/// Returns the eigenvalues and eigenvectors of a symmetric matrix, by Jacobi's method. Its
/// rotations are at most 45°, so that each eigenvalue is at the coordinate axis near its own. For a
/// diagonal matrix the eigenvectors are the coordinate axes.
pub(crate) fn diagonal(mut s: DMat3) -> (DVec3, DMat3) {
    let mut axes = DMat3::IDENTITY;
    let size = s
        .to_cols_array()
        .iter()
        .fold(0.0, |a: f64, b| a.max(b.abs()));
    for _ in 0..32 {
        let mut quiet = true;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = 0.5 * (s.col(q)[p] + s.col(p)[q]);
            if !(off.abs() > 1e-7 * size) {
                continue;
            }
            quiet = false;
            let theta = 0.5 * (s.col(q)[q] - s.col(p)[p]) / off;
            let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = c;
            turn.col_mut(q)[q] = c;
            turn.col_mut(q)[p] = t * c;
            turn.col_mut(p)[q] = -t * c;
            s = turn.transpose() * s * turn;
            axes *= turn;
        }
        if quiet {
            break;
        }
    }
    (DVec3::new(s.x_axis.x, s.y_axis.y, s.z_axis.z), axes)
}

/// Returns the rotation in the world of what has a rotation of its own in a space, such as a
/// camera. If the matrix from the space contains a reflection, the y and z axes have their
/// reflected directions, and the x axis is the one that makes it a rotation.
pub fn orientation_in(world_from_space: DMat4, own: DQuat) -> DQuat {
    let turned = rotation_of(world_from_space) * own;
    let half_turn_about_x = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    match world_from_space.determinant() < 0.0 {
        true => (turned * half_turn_about_x).normalize(),
        false => turned.normalize(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_does_not_rotate_the_camera() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let matrix = DMat4::from_quat(turn) * DMat4::from_scale(DVec3::new(2.0, 5.0, 0.1));
        assert!(rotation_of(matrix).dot(turn).abs() > 1.0 - 1e-12);
    }
}
