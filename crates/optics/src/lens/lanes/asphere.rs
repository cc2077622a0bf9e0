//! Crosses polynomial aspheres, with all lanes at once.

use ivcam_base::math::lanes::{LANES, Lane, fused};

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::sphere::CrossingTerms;
use crate::lens::lanes::step::{LaneHit, LaneStep};
use crate::lens::trace::profile::Profile;

/// Computes what [`Profile::sag`] computes, for all lanes: the sag of a profile and its slope over
/// the radius, at the squared radii `r2`. `inside` is not positive beyond the edge of the conic.
#[inline(always)]
fn sags<const FUSED: bool>(
    profile: &Profile,
    r2: &Lane,
    sag: &mut Lane,
    slope: &mut Lane,
    inside: &mut Lane,
) {
    let (c, k) = (profile.c, profile.k);
    let (mut p, mut dp, mut r) = ([0.0; LANES], [0.0; LANES], *r2);
    if !profile.even {
        for i in 0..LANES {
            r[i] = r2[i].sqrt();
        }
    }
    for &a in profile.terms.iter().rev() {
        for i in 0..LANES {
            dp[i] = fused::<FUSED>(dp[i], r[i], p[i]);
            p[i] = fused::<FUSED>(p[i], r[i], a);
        }
    }
    if profile.along_normal {
        for i in 0..LANES {
            let inside = 1.0 - (1.0 + k) * c * c * r2[i];
            [p[i], dp[i]] = profile.along_axis([p[i], dp[i]], r2[i], inside);
        }
    }
    for i in 0..LANES {
        inside[i] = 1.0 - (1.0 + k) * c * c * r2[i];
        let root = inside[i].sqrt();
        // One quotient for c r²/(1 + root) and c/root.
        let over = c / (root * (1.0 + root));
        sag[i] = fused::<FUSED>(r2[i] * root, over, p[i]);
        let more = if profile.even {
            2.0 * dp[i]
        } else if r[i] > 0.0 {
            dp[i] / r[i]
        } else {
            0.0
        };
        slope[i] = fused::<FUSED>(1.0 + root, over, more);
    }
}

/// Crosses an asphere by the Newton iteration of
/// [`intersect_profile`](crate::lens::trace::intersect). All lanes iterate until the last one has
/// stopped. The cosines of the angles of incidence are then those of
/// [`CrossingTerms::divide_cosines`].
#[inline(always)]
pub(super) fn asphere<const STOPS: bool, const FUSED: bool>(
    step: &LaneStep<'_>,
    profile: &Profile,
    b: &mut Bundle,
    terms: &mut CrossingTerms,
) {
    let found = newton::<FUSED>(profile, b, start(step, profile, b));
    let FoundRoot {
        x,
        y,
        z,
        gx,
        gy,
        rate,
        error,
    } = &found;
    for i in 0..LANES {
        let size = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
        let near = error[i] <= 1e-11 * (size.sqrt() + error[i]);
        let square = gx[i] * gx[i] + gy[i] * gy[i] + 1.0;
        let along = step.sign * rate[i];
        (terms.f[i], terms.cos[i]) = (square, along);
        let hit = LaneHit {
            is_hit: near & (size < f64::INFINITY) & (along > 0.0),
            point: [x[i], y[i], z[i]],
            gradient: [gx[i], gy[i], 1.0],
            square,
            along,
        };
        step.cross::<STOPS>(b, i, hit);
    }
}

/// The points at which the iteration starts: where the ray hits the conic below the polynomial, or
/// the vertex plane if it misses the conic.
#[inline(always)]
fn start(step: &LaneStep<'_>, profile: &Profile, b: &Bundle) -> [Lane; 3] {
    let (c, k, sign) = (profile.c, profile.k, step.sign);
    let (mut qx, mut qy, mut qz) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (px, py, pz) = (b.x[i], b.y[i], b.z[i] + step.shift);
        let along = px * dx + py * dy + pz * dz;
        let (sx, sy, sz) = (px + -along * dx, py + -along * dy, pz + -along * dz);
        let wz = (1.0 + k) * sz;
        let f = c * (sx * sx + sy * sy + wz * sz) - 2.0 * sz;
        let g = dz - c * (sx * dx + sy * dy + wz * dz);
        let a = c * (dx * dx + dy * dy + (1.0 + k) * dz * dz);
        let discriminant = g * g - a * f;
        let s = sign * discriminant.sqrt();
        let ahead = sign * g >= 0.0;
        let t = (if ahead { f } else { g - s }) / (if ahead { g + s } else { a });
        let (hx, hy, hz) = (sx + t * dx, sy + t * dy, sz + t * dz);
        let up = 1.0 - c * ((1.0 + k) * hz);
        let size = hx * hx + hy * hy + hz * hz;
        let hits = (discriminant >= 0.0) & (up > 0.0) & (size < f64::INFINITY);
        let flat = if dz != 0.0 { pz / dz } else { along };
        qx[i] = if hits { hx } else { px - flat * dx };
        qy[i] = if hits { hy } else { py - flat * dy };
        qz[i] = if hits { hz } else { pz - flat * dz };
    }
    [qx, qy, qz]
}

/// The points at which rays hit a surface. Lengths are in millimeters.
struct FoundRoot {
    x: Lane,
    y: Lane,
    z: Lane,
    /// The x component of the gradient of the height over the surface; the z component is 1.
    gx: Lane,
    /// The y component of the gradient.
    gy: Lane,
    /// The derivative of the height along the ray.
    rate: Lane,
    /// The height that remains after the last step.
    error: Lane,
}

/// Iterates from the points `q`.
#[inline(always)]
fn newton<const FUSED: bool>(profile: &Profile, b: &Bundle, q: [Lane; 3]) -> FoundRoot {
    let [mut qx, mut qy, mut qz] = q;
    let mut best = [f64::INFINITY; LANES];
    let mut last = [0.0; LANES];
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let (mut gx, mut gy, mut rate) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let (mut r2, mut sag, mut slope, mut inside) =
        ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
    // 1 while a lane iterates, 0 when it has stopped; a number, so that it stays in vectors.
    let mut going: Lane = b.lost.map(|lost| if lost == 0.0 { 1.0 } else { 0.0 });
    for _ in 0..60 {
        for i in 0..LANES {
            r2[i] = qx[i] * qx[i] + qy[i] * qy[i];
        }
        sags::<FUSED>(profile, &r2, &mut sag, &mut slope, &mut inside);
        for i in 0..LANES {
            let on = going[i] > 0.0;
            let known = inside[i] > 0.0;
            let height = qz[i] - sag[i];
            let (nx, ny) = (-slope[i] * qx[i], -slope[i] * qy[i]);
            let toward = nx * b.dx[i] + ny * b.dy[i] + b.dz[i];
            let better = on & known & (height.abs() < best[i]);
            let (square, size) = (best[i] * best[i], r2[i] + qz[i] * qz[i]);
            let converged = known & !better & (square <= 1e-26 * size);
            best[i] = if better { height.abs() } else { best[i] };
            (x[i], y[i], z[i]) = if better {
                (qx[i], qy[i], qz[i])
            } else {
                (x[i], y[i], z[i])
            };
            (gx[i], gy[i]) = if better { (nx, ny) } else { (gx[i], gy[i]) };
            rate[i] = if better { toward } else { rate[i] };
            let near = best[i] * best[i] <= 4e-30 * size;
            let full = -height / toward;
            let back = 0.5 * last[i];
            let ends = if known {
                // Within a few rounding errors of the surface, or no nearer than before.
                converged | near | !(full.abs() < f64::INFINITY)
            } else {
                back == 0.0
            };
            let on = on & !ends;
            last[i] = if known { full } else { back };
            let go = if !on {
                0.0
            } else if known {
                full
            } else {
                -back
            };
            qx[i] += go * b.dx[i];
            qy[i] += go * b.dy[i];
            qz[i] += go * b.dz[i];
            going[i] = if on { 1.0 } else { 0.0 };
        }
        // Bits may be combined in any order, so the compiler can use vectors. A sum would have to
        // keep its order.
        if going.iter().fold(0, |all, on| all | on.to_bits()) == 0 {
            break;
        }
    }
    FoundRoot {
        x,
        y,
        z,
        gx,
        gy,
        rate,
        error: best,
    }
}
