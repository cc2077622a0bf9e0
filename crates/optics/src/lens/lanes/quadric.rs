//! Crosses conics and cylinders, with all lanes at once.

use glam::DVec3;
use ivcam_base::math::lanes::{LANES, fused};

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::sphere::{CrossingTerms, advance};
use crate::lens::lanes::step::{LaneHit, LaneStep};

/// Crosses the quadric c (w.x x² + w.y y² + w.z z²) = 2 z, where c is the curvature, from positions
/// relative to the vertex. The mathematics is that of
/// [`intersect_quadric`](crate::lens::trace::intersect). The work is divided as in
/// [`sphere`](super::sphere::sphere). The cosines of the angles of incidence are then those of
/// [`CrossingTerms::divide_cosines`].
#[inline(always)]
pub(super) fn quadric<const STOPS: bool, const FUSED: bool>(
    step: &LaneStep<'_>,
    w: DVec3,
    b: &mut Bundle,
    terms: &mut CrossingTerms,
) {
    let (c, sign) = (step.element.curvature, step.sign);
    let weighted = |x: f64, y: f64, z: f64, [px, py, pz]: [f64; 3]| {
        fused::<FUSED>(w.x * x, px, fused::<FUSED>(w.y * y, py, (w.z * z) * pz))
    };
    let mut square = [0.0; LANES];
    for (i, square) in square.iter_mut().enumerate() {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (x, y, z) = (b.x[i], b.y[i], b.z[i]);
        let f = fused::<FUSED>(c, weighted(x, y, z, [x, y, z]), -2.0 * z);
        let g = fused::<FUSED>(-c, weighted(x, y, z, [dx, dy, dz]), dz);
        *square = c * weighted(dx, dy, dz, [dx, dy, dz]);
        let discriminant = fused::<FUSED>(g, g, -*square * f);
        (terms.f[i], terms.g[i]) = (f, g);
        (terms.discriminant[i], terms.cos[i]) = (discriminant, discriminant.sqrt());
    }
    advance::<FUSED>(sign, b, terms, |i| square[i]);
    for i in 0..LANES {
        let (x, y, z) = (b.x[i], b.y[i], b.z[i]);
        let (gx, gy) = (-c * (w.x * x), -c * (w.y * y));
        let gz = fused::<FUSED>(-c, w.z * z, 1.0);
        let size = fused::<FUSED>(x, x, fused::<FUSED>(y, y, z * z));
        let square = fused::<FUSED>(gx, gx, fused::<FUSED>(gy, gy, gz * gz));
        terms.f[i] = square;
        let hit = LaneHit {
            // A ray that misses the quadric has a NaN or an infinity here.
            is_hit: (gz > 0.0) & (size < f64::INFINITY),
            point: [x, y, z],
            gradient: [gx, gy, gz],
            square,
            along: terms.cos[i],
        };
        step.cross::<STOPS>(b, i, hit);
    }
}
