//! Conics and cylinders, in all lanes at once.

use glam::DVec3;

use super::bundle::Bundle;
use super::step::{NO_BEND, SLIGHT_BEND, Step, kind_of};
use crate::math::lanes::LANES;

/// Conics and cylinders: c (w.x x² + w.y y² + w.z z²) = 2 z.
#[inline(always)]
pub(super) fn quadric<const STOPS: bool>(step: &Step<'_>, w: DVec3, b: &mut Bundle) {
    let (c, clear, sign) = (step.element.curvature, step.element.clear, step.sign);
    let (mu, bend) = (step.bend.mu, step.bend.step);
    let kind = kind_of(step.bend);
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let pz = b.z[i] + step.shift;
        let nearest = -(b.x[i] * dx + b.y[i] * dy + pz * dz);
        let (qx, qy, qz) = (
            b.x[i] + nearest * dx,
            b.y[i] + nearest * dy,
            pz + nearest * dz,
        );
        let (wx, wy, wz) = (w.x * qx, w.y * qy, w.z * qz);
        let f = c * (wx * qx + wy * qy + wz * qz) - 2.0 * qz;
        let g = dz - c * (wx * dx + wy * dy + wz * dz);
        let a = c * (w.x * dx * dx + w.y * dy * dy + w.z * dz * dz);
        let discriminant = g * g - a * f;
        let s = sign * discriminant.sqrt();
        let ahead = sign * g >= 0.0;
        let t = (if ahead { f } else { g - s }) / (if ahead { g + s } else { a });
        let (px, py, pz) = (qx + t * dx, qy + t * dy, qz + t * dz);
        let (gx, gy, gz) = (-c * (w.x * px), -c * (w.y * py), 1.0 - c * (w.z * pz));
        let length = (gx * gx + gy * gy + gz * gz).sqrt();
        let (nx, ny, nz) = (gx / length, gy / length, gz / length);
        let cos = s.abs() / length;
        let r2 = px * px + py * py;
        let met = (discriminant >= 0.0) & (gz > 0.0) & (r2 + pz * pz < f64::INFINITY);
        let k = 1.0 - mu * mu * (1.0 - cos * cos);
        let turn = match kind {
            NO_BEND => 0.0,
            SLIGHT_BEND => sign * bend / (k.sqrt() + mu * cos),
            _ => sign * (k.sqrt() - mu * cos),
        };
        if !STOPS {
            b.note_fill(i, r2 / clear, step.number);
        }
        let code = step.outcome(met, !STOPS | (r2 <= clear), (k >= 0.0) | (bend == 0.0));
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
        b.dx[i] = mu * dx + turn * nx;
        b.dy[i] = mu * dy + turn * ny;
        b.dz[i] = mu * dz + turn * nz;
        (b.x[i], b.y[i], b.z[i]) = (px, py, pz);
    }
}
