//! Where a ray meets a surface, from the vertex of the surface.

use glam::DVec3;

use crate::lens::trace::profile::Profile;

/// A point of a surface, from its vertex.
pub(crate) struct Hit {
    pub point: DVec3,
    /// Unit normal toward the film.
    pub normal: DVec3,
    /// The cosine of the angle of incidence, never negative.
    pub cos: f64,
}

/// Where a ray meets a sphere or a plane.
///
/// With the curvature c = 1/R and the larger denominator it holds from a ball lens to a plane
/// (c = 0), and the sag is right to 2e-13 mm at R = 3e15 mm, where the center-and-radius form is
/// 0.4 mm off. The shift to the point nearest the vertex keeps origins 1e12 mm away good to
/// their own rounding.
pub(crate) fn meet_sphere(c: f64, p: DVec3, d: DVec3, sign: f64) -> Option<Hit> {
    let nearest = -p.dot(d);
    let q = p + nearest * d;
    let f = c * q.dot(q) - 2.0 * q.z;
    let g = d.z - c * q.dot(d);
    let discriminant = g * g - c * f;
    if !(discriminant >= 0.0) {
        return None;
    }
    let cos = discriminant.sqrt();
    let s = sign * cos;
    let step = if sign * g >= 0.0 {
        f / (g + s)
    } else {
        (g - s) / c
    };
    let point = q + step * d;
    let normal = DVec3::new(-c * point.x, -c * point.y, 1.0 - c * point.z);
    // On the sphere but past its equator, or nowhere: an infinite step makes a NaN or fails too.
    (normal.z > 0.0 && point.is_finite()).then_some(Hit { point, normal, cos })
}

/// Where a ray meets the quadric c (w.x x² + w.y y² + w.z z²) = 2 z, on the side of its vertex.
pub(super) fn meet_quadric(c: f64, w: DVec3, p: DVec3, d: DVec3, sign: f64) -> Option<Hit> {
    let nearest = -p.dot(d);
    let q = p + nearest * d;
    let (wq, wd) = (w * q, w * d);
    let f = c * wq.dot(q) - 2.0 * q.z;
    let g = d.z - c * wq.dot(d);
    let a = c * wd.dot(d);
    let discriminant = g * g - a * f;
    if !(discriminant >= 0.0) {
        return None;
    }
    let s = sign * discriminant.sqrt();
    let step = if sign * g >= 0.0 {
        f / (g + s)
    } else {
        (g - s) / a
    };
    let point = q + step * d;
    let gradient = DVec3::Z - c * (w * point);
    let length = gradient.length();
    let hit = Hit {
        point,
        normal: gradient / length,
        cos: s.abs() / length,
    };
    (gradient.z > 0.0 && point.is_finite()).then_some(hit)
}

/// Where a ray meets a surface known by its height: Newton's iteration from a nearby quadric.
///
/// `surface` gives how far a point is above the surface, along the axis, and the gradient of
/// that. The iteration stops where it no longer improves, which is rounding itself; a ray that
/// has not converged to 1e-11 of its own size misses.
pub(super) fn meet_profile(
    start: Option<Hit>,
    p: DVec3,
    d: DVec3,
    sign: f64,
    surface: impl Fn(DVec3) -> Option<(f64, DVec3)>,
) -> Option<Hit> {
    // Counted from a point near the surface, so that a far origin costs no digits.
    let mut q = match start {
        Some(hit) => hit.point,
        None if d.z != 0.0 => p - p.z / d.z * d,
        None => p - p.dot(d) * d,
    };
    let mut best = f64::INFINITY;
    let mut found = None;
    let mut last_step = 0.0;
    for _ in 0..60 {
        let Some((height, gradient)) = surface(q) else {
            // Outside the conic: half of the last step back.
            last_step *= 0.5;
            q -= last_step * d;
            if last_step == 0.0 {
                break;
            }
            continue;
        };
        let rate = gradient.dot(d);
        if height.abs() < best {
            best = height.abs();
            found = Some((q, gradient));
        } else if best <= 1e-13 * q.length() {
            break;
        }
        if height == 0.0 {
            break;
        }
        last_step = -height / rate;
        if !last_step.is_finite() {
            break;
        }
        q += last_step * d;
    }
    let (point, gradient) = found?;
    if !(best <= 1e-11 * (point.length() + best)) || !point.is_finite() {
        return None;
    }
    let length = gradient.length();
    let cos = sign * gradient.dot(d) / length;
    (cos > 0.0).then_some(Hit {
        point,
        normal: gradient / length,
        cos,
    })
}

/// Height over a toroid and its gradient. The profile in y is turned about an axis parallel to
/// y at the distance 1/`across`; across = 0 is a cylinder with any profile.
pub(super) fn toroid(profile: &Profile, across: f64, q: DVec3) -> Option<(f64, DVec3)> {
    let (sag, slope) = profile.sag(q.y * q.y)?;
    // In the turned plane: z − g − ½ c (x² + (z−g)²) … solved for the height along the axis.
    let inside = 1.0 - across * sag;
    let radial = inside * inside - across * across * q.x * q.x;
    if !(radial > 0.0) || !(inside > 0.0) {
        return None;
    }
    let root = radial.sqrt();
    // z(x, y) = (1 − √((1 − cg)² − c²x²))/c, without the division by c.
    let z = (sag * (2.0 - across * sag) + across * q.x * q.x) / (1.0 + root);
    let gradient = DVec3::new(-across * q.x / root, -slope * q.y * inside / root, 1.0);
    Some((q.z - z, gradient))
}
