//! Intersects rays with surfaces. Positions are relative to the vertex of the surface.

use glam::DVec3;

use crate::lens::trace::profile::Profile;

/// The point at which a ray hits a surface.
pub(crate) struct SurfaceHit {
    /// The point relative to the vertex, in millimeters.
    pub point: DVec3,
    /// The unit normal toward the film.
    pub normal: DVec3,
    /// The cosine of the angle of incidence, never negative.
    pub cos: f64,
}

/// Intersects a sphere or a plane of curvature c with a ray, on the side of the vertex.
///
/// With the curvature c = 1/R and the larger denominator the result is accurate from a ball lens to
/// a plane (c = 0): the error of the sag is 2e-13 mm at R = 3e15 mm, where that of the
/// center-and-radius form is 0.4 mm. The origin is moved to the point nearest the vertex, so that
/// an origin 1e12 mm away adds no more error than its own rounding.
pub(crate) fn intersect_sphere(c: f64, p: DVec3, d: DVec3, sign: f64) -> Option<SurfaceHit> {
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
    // A point beyond the equator is on the other half of the sphere. An infinite step gives a NaN
    // or an infinity, and fails too.
    (normal.z > 0.0 && point.is_finite()).then_some(SurfaceHit { point, normal, cos })
}

/// Intersects the quadric c (w.x x² + w.y y² + w.z z²) = 2 z with a ray, on the side of the vertex.
pub(super) fn intersect_quadric(
    c: f64,
    w: DVec3,
    p: DVec3,
    d: DVec3,
    sign: f64,
) -> Option<SurfaceHit> {
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
    let hit = SurfaceHit {
        point,
        normal: gradient / length,
        cos: s.abs() / length,
    };
    (gradient.z > 0.0 && point.is_finite()).then_some(hit)
}

/// Intersects a surface that is given by its height with a ray, by Newton's iteration from a nearby
/// quadric.
///
/// `surface` returns the height of a point over the surface, along the axis, and its gradient. The
/// iteration stops where it no longer improves, which is at the rounding error. A ray whose height
/// has not fallen below 1e-11 of its distance from the vertex misses.
pub(super) fn intersect_profile(
    start: Option<SurfaceHit>,
    p: DVec3,
    d: DVec3,
    sign: f64,
    surface: impl Fn(DVec3) -> Option<(f64, DVec3)>,
) -> Option<SurfaceHit> {
    // Start from a point near the surface, so that a far origin costs no digits.
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
            // The point is outside the conic: go back by half of the last step.
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
    (cos > 0.0).then_some(SurfaceHit {
        point,
        normal: gradient / length,
        cos,
    })
}

/// The height over a toroid and its gradient; none beyond its edge. The profile in y is rotated
/// about an axis parallel to y at the distance 1/`across`. With across = 0 it is a cylinder with
/// any profile.
pub(super) fn toroid(profile: &Profile, across: f64, q: DVec3) -> Option<(f64, DVec3)> {
    let (sag, slope) = profile.sag(q.y * q.y)?;
    // With g the sag and c = `across`, a point of the surface is at the distance |1/c − g| from the
    // axis of rotation.
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
