//! Crosses conics and cylinders, with all lanes at once.

use glam::DVec3;
use ivcam_base::math::lanes::Lane;

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::step::{LaneHit, LaneStep};

/// Crosses the quadric c (w.x x² + w.y y² + w.z z²) = 2 z, where c is the curvature.
/// `cos` receives the cosines of the angles of incidence.
#[inline(always)]
pub(super) fn quadric<const STOPS: bool>(
    step: &LaneStep<'_>,
    w: DVec3,
    b: &mut Bundle,
    cos: &mut Lane,
) {
    let (c, sign) = (step.element.curvature, step.sign);
    for (i, cos) in cos.iter_mut().enumerate() {
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
        let r2 = px * px + py * py;
        let hit = LaneHit {
            is_hit: (discriminant >= 0.0) & (gz > 0.0) & (r2 + pz * pz < f64::INFINITY),
            point: [px, py, pz],
            normal: [gx / length, gy / length, gz / length],
            cos: s.abs() / length,
        };
        *cos = hit.cos;
        step.cross::<STOPS>(b, i, hit);
    }
}
