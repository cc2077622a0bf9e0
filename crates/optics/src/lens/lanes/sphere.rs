//! Crosses spheres and planes, with all lanes at once.

use ivcam_base::math::lanes::{LANES, Lane, fused};

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::step::{LaneStep, SAME_INDEX, SLIGHT_STEP};

/// Moves the origins of rays to their points nearest the vertex, so that an origin 1e12 mm away
/// adds no more error than its own rounding. Within a lens the origins are near enough.
#[inline(always)]
pub(super) fn approach<const FUSED: bool>(step: &LaneStep<'_>, b: &mut Bundle) {
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (x, y, z) = (b.x[i], b.y[i], b.z[i] + step.shift);
        let nearest = -fused::<FUSED>(x, dx, fused::<FUSED>(y, dy, z * dz));
        b.x[i] = fused::<FUSED>(nearest, dx, x);
        b.y[i] = fused::<FUSED>(nearest, dy, y);
        b.z[i] = fused::<FUSED>(nearest, dz, z);
    }
}

/// The terms of the quadratic equation a t² − 2 g t + f = 0 for the distance t at which a ray hits
/// a quadric, and the cosine of incidence. For a sphere a is its curvature.
pub(super) struct CrossingTerms {
    /// After a surface other than a sphere, the square of the length of its gradient.
    pub f: Lane,
    pub g: Lane,
    /// g² − a f.
    pub discriminant: Lane,
    /// The root of the discriminant. It is the cosine of the angle of incidence, for a surface
    /// other than a sphere times the length of its gradient.
    pub cos: Lane,
}

impl CrossingTerms {
    #[inline(always)]
    pub(super) fn zero() -> Self {
        Self {
            f: [0.0; LANES],
            g: [0.0; LANES],
            discriminant: [0.0; LANES],
            cos: [0.0; LANES],
        }
    }

    /// Divides the cosines by the lengths of the gradients of a surface other than a sphere.
    #[inline(always)]
    pub(super) fn divide_cosines(&mut self) {
        for (cos, square) in self.cos.iter_mut().zip(&self.f) {
            *cos /= square.sqrt();
        }
    }
}

/// Crosses a sphere or a plane, from positions relative to the vertex. The mathematics is that of
/// [`intersect_sphere`](crate::lens::trace::intersect::intersect_sphere). k is the square of the
/// cosine of refraction.
///
/// The work is divided into three loops because the roots and quotients of one ray depend on each
/// other. In one loop the processor holds too few rays at once to hide their latency: with SSE2 and
/// AVX2 one loop takes 1.4 times as long.
#[inline(always)]
pub(super) fn sphere<const KIND: u8, const STOPS: bool, const FUSED: bool>(
    step: &LaneStep<'_>,
    b: &mut Bundle,
    terms: &mut CrossingTerms,
) {
    let (c, clear, sign) = (step.element.curvature, step.element.clear, step.sign);
    let (mu, index_step) = (step.refraction.mu, step.refraction.step);
    let mu_squared = mu * mu;
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (x, y, z) = (b.x[i], b.y[i], b.z[i]);
        let square = fused::<FUSED>(x, x, fused::<FUSED>(y, y, z * z));
        let along = fused::<FUSED>(x, dx, fused::<FUSED>(y, dy, z * dz));
        let f = fused::<FUSED>(c, square, -2.0 * z);
        let g = fused::<FUSED>(-c, along, dz);
        let discriminant = fused::<FUSED>(g, g, -c * f);
        (terms.f[i], terms.g[i]) = (f, g);
        (terms.discriminant[i], terms.cos[i]) = (discriminant, discriminant.sqrt());
    }
    advance::<FUSED>(sign, b, terms, |_| c);
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (px, py, pz) = (b.x[i], b.y[i], b.z[i]);
        let r2 = fused::<FUSED>(px, px, py * py);
        let up = fused::<FUSED>(-c, pz, 1.0);
        // A ray that misses the sphere has a NaN or an infinity here.
        let hits = (up > 0.0) & (fused::<FUSED>(pz, pz, r2) < f64::INFINITY);
        if !STOPS {
            b.note_fill(i, r2 * step.per_clear, step.number);
        }
        let mut refracts = true;
        if KIND != SAME_INDEX {
            let cos = terms.cos[i];
            let k = fused::<FUSED>(mu_squared, terms.discriminant[i], index_step);
            let turn = if KIND == SLIGHT_STEP {
                sign * index_step / fused::<FUSED>(mu, cos, k.sqrt())
            } else {
                sign * fused::<FUSED>(-mu, cos, k.sqrt())
            };
            refracts = k >= 0.0;
            let across = -c * turn;
            b.dx[i] = fused::<FUSED>(mu, dx, across * px);
            b.dy[i] = fused::<FUSED>(mu, dy, across * py);
            b.dz[i] = fused::<FUSED>(mu, dz, turn * up);
        }
        let code = step.outcome(hits, !STOPS | (r2 <= clear), refracts);
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
    }
}

/// Moves rays to where they hit a quadric. `square` returns the factor of t² in the equation of a
/// lane.
#[inline(always)]
pub(super) fn advance<const FUSED: bool>(
    sign: f64,
    b: &mut Bundle,
    terms: &CrossingTerms,
    square: impl Fn(usize) -> f64,
) {
    // Nearly always all rays hit the near side.
    let signs = terms.g.iter().fold(0, |all, g| all | (sign * g).to_bits());
    if signs >> 63 == 0 {
        advance_to::<true, FUSED>(sign, b, terms, square);
    } else {
        advance_to::<false, FUSED>(sign, b, terms, square);
    }
}

/// Moves rays as [`advance`] does; with `NEAR`, all of them hit the near side.
#[inline(always)]
fn advance_to<const NEAR: bool, const FUSED: bool>(
    sign: f64,
    b: &mut Bundle,
    terms: &CrossingTerms,
    square: impl Fn(usize) -> f64,
) {
    for i in 0..LANES {
        let (f, g, s) = (terms.f[i], terms.g[i], sign * terms.cos[i]);
        let ahead = NEAR || sign * g >= 0.0;
        let t = (if ahead { f } else { g - s }) / (if ahead { g + s } else { square(i) });
        b.x[i] = fused::<FUSED>(t, b.dx[i], b.x[i]);
        b.y[i] = fused::<FUSED>(t, b.dy[i], b.y[i]);
        b.z[i] = fused::<FUSED>(t, b.dz[i], b.z[i]);
    }
}
