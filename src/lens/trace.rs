//! Traces a ray through a prescription, surface by surface, in lens space.
//!
//! Lens space is millimeters. Light travels toward +z, the first vertex is the origin, the film
//! is at positive z. Nothing here knows about scenes or pixels; `camera` does the crossing.
//!
//! Between two surfaces a ray may run backwards (t < 0): thin edges and zero gaps make surfaces
//! cross outside their rims, and the ray is still right. There is no epsilon anywhere, so a lens
//! scaled by a power of two gives the same directions to the last bit.

use glam::{DVec2, DVec3};

use super::coating::Coating;
use super::surface::{Shape, Surface};

/// A ray in lens space. The direction need not be of unit length; what comes back from a trace is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensRay {
    pub origin: DVec3,
    pub direction: DVec3,
}

impl LensRay {
    /// Where it crosses a plane across the axis.
    pub fn at_z(&self, z: f64) -> DVec3 {
        self.origin + (z - self.origin.z) / self.direction.z * self.direction
    }
}

/// Why a ray did not get through. That is not an error: vignetting is made of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    pub kind: LossKind,
    /// The surface, counted from 0 at the front, the stop included.
    pub surface: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossKind {
    /// It passed beside the surface, or met only the other half of its sphere.
    Missed,
    /// It met the surface outside its semi-diameter.
    Blocked,
    /// It could not leave the glass.
    TotalReflection,
}

/// Which way a ray goes through the lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toward {
    Film,
    Scene,
}

/// How a surface bends a ray that crosses it one way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend {
    /// Index before over index behind.
    pub mu: f64,
    /// 1 − µ², from the difference of the indices: a step of 2^-40 keeps its digits.
    pub step: f64,
}

impl Bend {
    fn new(before: f64, behind: f64) -> Self {
        let step = (behind - before) * (behind + before) / (behind * behind);
        Self {
            mu: before / behind,
            step,
        }
    }

    /// Indices so nearly equal that the difference of cosines would lose digits that matter.
    pub fn is_slight(self) -> bool {
        self.step.abs() < 0.01
    }
}

/// A surface made ready for tracing at one wavelength.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub curvature: f64,
    pub form: Form,
    /// The vertex, from the front vertex.
    pub vertex_z: f64,
    /// The distance to the next vertex, as given: a sum of gaps taken apart again would not be.
    pub gap: f64,
    /// The square of the semi-diameter.
    pub clear: f64,
    pub to_film: Bend,
    pub to_scene: Bend,
    /// The index in front and the one behind.
    pub indices: [f64; 2],
    pub coating: Coating,
    /// The corners of a hole that is not round; it is inside the semi-diameter.
    pub hole: Option<Box<[DVec2]>>,
    /// The edges of the convex figure around that hole: the way to each over the square of its
    /// distance, so that a place inside is less than 1 along all. None where it is not around
    /// the axis.
    pub edges: Box<[DVec2]>,
}

/// The shapes as the tracer meets them. The first three are quadrics, met in closed form.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    Sphere,
    Conic {
        k: f64,
    },
    /// Weights of x and y in the sum of squares: 0 along the cylinder's axis.
    Cylinder {
        x: f64,
        y: f64,
    },
    Asphere(Profile),
    Toroid {
        profile: Profile,
        across: f64,
    },
}

/// A conic and a polynomial, as a height over the square of the radius.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    pub c: f64,
    pub k: f64,
    /// Coefficients of r^0, r^1, …; or of r^0, r^2, … where all are even.
    pub terms: Vec<f64>,
    pub even: bool,
}

impl Profile {
    fn new(c: f64, k: f64, terms: &[f64]) -> Self {
        let used = terms
            .iter()
            .rposition(|t| *t != 0.0)
            .map_or(0, |last| last + 1);
        let terms = &terms[..used];
        let even = terms.iter().skip(1).step_by(2).all(|t| *t == 0.0);
        let terms = terms
            .iter()
            .step_by(if even { 2 } else { 1 })
            .copied()
            .collect();
        Self { c, k, terms, even }
    }

    /// Sag and slope over radius at a squared radius; none outside the conic.
    pub fn sag(&self, r2: f64) -> Option<(f64, f64)> {
        let inside = 1.0 - (1.0 + self.k) * self.c * self.c * r2;
        if !(inside > 0.0) {
            return None;
        }
        let root = inside.sqrt();
        let (mut sag, mut slope) = (self.c * r2 / (1.0 + root), self.c / root);
        if self.even {
            // Horner in r²: value and derivative together.
            let (mut p, mut dp) = (0.0, 0.0);
            for &a in self.terms.iter().rev() {
                dp = dp * r2 + p;
                p = p * r2 + a;
            }
            sag += p;
            slope += 2.0 * dp;
        } else {
            let r = r2.sqrt();
            let (mut p, mut dp) = (0.0, 0.0);
            for &a in self.terms.iter().rev() {
                dp = dp * r + p;
                p = p * r + a;
            }
            sag += p;
            if r > 0.0 {
                slope += dp / r;
            }
        }
        Some((sag, slope))
    }
}

impl Element {
    pub fn new(surface: &Surface, vertex_z: f64, before: f64, behind: f64) -> Self {
        let curvature = surface.curvature.per_mm();
        let form = match &surface.shape {
            Shape::Sphere => Form::Sphere,
            Shape::Conic { k } if *k == 0.0 => Form::Sphere,
            Shape::Conic { k } => Form::Conic { k: *k },
            Shape::CylinderX => Form::Cylinder { x: 0.0, y: 1.0 },
            Shape::CylinderY => Form::Cylinder { x: 1.0, y: 0.0 },
            Shape::Asphere { k, terms } => {
                let profile = Profile::new(curvature, *k, &terms[..]);
                match profile.terms.is_empty() {
                    true if *k == 0.0 => Form::Sphere,
                    true => Form::Conic { k: *k },
                    false => Form::Asphere(profile),
                }
            }
            Shape::Toroid { across, k, terms } => Form::Toroid {
                profile: Profile::new(curvature, *k, &terms[..]),
                across: across.per_mm(),
            },
        };
        Self {
            curvature,
            form,
            vertex_z,
            gap: surface.thickness,
            clear: surface.semi_diameter * surface.semi_diameter,
            to_film: Bend::new(before, behind),
            to_scene: Bend::new(behind, before),
            indices: [before, behind],
            coating: surface.coating,
            hole: None,
            edges: Box::default(),
        }
    }

    /// Gives the surface a hole with these corners.
    pub fn set_hole(&mut self, corners: Option<Box<[DVec2]>>) {
        self.edges = corners.as_deref().map(edges_around).unwrap_or_default();
        self.hole = corners;
    }

    /// Whether a hit is inside the hole of the iris; always, if that is round.
    pub fn is_open_at(&self, hit: DVec3) -> bool {
        self.hole
            .as_deref()
            .is_none_or(|corners| is_inside(corners, hit.truncate()))
    }

    pub fn bend(&self, toward: Toward) -> Bend {
        match toward {
            Toward::Film => self.to_film,
            Toward::Scene => self.to_scene,
        }
    }

    /// The hit, from the vertex, and the normal there, turned to the film. `sign` is +1 toward
    /// the film and −1 toward the scene. None where the ray misses.
    pub(super) fn meet(&self, p: DVec3, d: DVec3, sign: f64) -> Option<Hit> {
        match &self.form {
            Form::Sphere => meet_sphere(self.curvature, p, d, sign),
            Form::Conic { k } => {
                meet_quadric(self.curvature, DVec3::new(1.0, 1.0, 1.0 + k), p, d, sign)
            }
            Form::Cylinder { x, y } => {
                meet_quadric(self.curvature, DVec3::new(*x, *y, 1.0), p, d, sign)
            }
            Form::Asphere(profile) => {
                let start =
                    meet_quadric(profile.c, DVec3::new(1.0, 1.0, 1.0 + profile.k), p, d, sign);
                meet_profile(start, p, d, sign, |q| {
                    let (sag, slope) = profile.sag(q.x * q.x + q.y * q.y)?;
                    Some((q.z - sag, DVec3::new(-slope * q.x, -slope * q.y, 1.0)))
                })
            }
            Form::Toroid { profile, across } => {
                let start = meet_sphere(self.curvature, p, d, sign);
                meet_profile(start, p, d, sign, |q| toroid(profile, *across, q))
            }
        }
    }
}

/// The edges of the convex hull of a few corners, each as the foot of the perpendicular on it over
/// the square of its length.
fn edges_around(corners: &[DVec2]) -> Box<[DVec2]> {
    let size = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
    let is_edge = |a: DVec2, b: DVec2| {
        let side = |c: &DVec2| (b - a).perp_dot(*c - a) >= -1e-9 * size * (b - a).length();
        (b - a).length() > 1e-9 * size && corners.iter().all(side)
    };
    let pairs = corners
        .iter()
        .flat_map(|a| corners.iter().map(|b| (*a, *b)));
    let hull = pairs.filter(|(a, b)| is_edge(*a, *b));
    let edges: Vec<(DVec2, f64)> = hull
        .map(|(a, b)| {
            let outward = -(b - a).perp().normalize();
            (outward, outward.dot(a))
        })
        .collect();
    if edges.iter().any(|(_, distance)| *distance <= 1e-3 * size) {
        return Box::default();
    }
    edges
        .iter()
        .map(|(way, distance)| *way / *distance)
        .collect()
}

/// Whether a point is inside a polygon, by counting the edges to its right.
fn is_inside(corners: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    let mut a = corners[corners.len() - 1];
    for &b in corners {
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
        a = b;
    }
    inside
}

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
pub(super) fn meet_sphere(c: f64, p: DVec3, d: DVec3, sign: f64) -> Option<Hit> {
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
fn meet_quadric(c: f64, w: DVec3, p: DVec3, d: DVec3, sign: f64) -> Option<Hit> {
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
fn meet_profile(
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
fn toroid(profile: &Profile, across: f64, q: DVec3) -> Option<(f64, DVec3)> {
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

/// The direction behind a surface; none at total reflection.
///
/// d' = µ d ± (√k − µ cos) N. Where the indices are nearly equal the difference of the roots is
/// taken as 1 − µ² over their sum: a step of the index of 2^-40 bends by 4e-13, and that comes
/// out with four digits. Elsewhere the plain difference errs no more than its roots do, and
/// saves one division in four.
pub(super) fn refract(d: DVec3, hit: &Hit, bend: Bend, sign: f64) -> Option<DVec3> {
    if bend.step == 0.0 {
        return Some(d);
    }
    let k = 1.0 - bend.mu * bend.mu * (1.0 - hit.cos * hit.cos);
    if !(k >= 0.0) {
        return None;
    }
    let turn = if bend.is_slight() {
        sign * bend.step / (k.sqrt() + bend.mu * hit.cos)
    } else {
        sign * (k.sqrt() - bend.mu * hit.cos)
    };
    Some(bend.mu * d + turn * hit.normal)
}

/// A direction of unit length, whatever its length was: 1e-150 and 1e150 neither underflow nor
/// overflow. One that is of unit length to rounding stays as it is, to the bit. None for zero
/// and for anything not finite.
pub fn unit(d: DVec3) -> Option<DVec3> {
    let square = d.length_squared();
    if (square - 1.0).abs() <= 8.0 * f64::EPSILON {
        return Some(d);
    }
    let largest = d.abs().max_element();
    if !(largest > 0.0 && largest.is_finite() && d.is_finite()) {
        return None;
    }
    let d = if (1e-100..1e100).contains(&largest) {
        d
    } else {
        d / largest
    };
    Some(d / d.length())
}

/// What a trace does beside giving the ray.
pub(crate) struct Course<'a> {
    pub elements: &'a [Element],
    pub toward: Toward,
    /// Semi-diameters block; without, only the surfaces themselves end a ray.
    pub apertures: bool,
}

impl Course<'_> {
    /// Follows a ray from surface to surface; `at_hit` hears of every hit, the lost one included.
    pub fn follow(
        &self,
        ray: LensRay,
        mut at_hit: impl FnMut(usize, DVec3),
    ) -> Result<LensRay, Loss> {
        self.walk(ray, |surface, vertex_z, hit| {
            at_hit(surface, hit.point + vertex_z * DVec3::Z);
        })
    }

    /// The same, hearing of the hit from its vertex, the vertex's z, and the angle.
    pub fn walk(
        &self,
        ray: LensRay,
        mut at_hit: impl FnMut(usize, f64, &Hit),
    ) -> Result<LensRay, Loss> {
        let count = self.elements.len();
        let first = if self.toward == Toward::Film {
            0
        } else {
            count.saturating_sub(1)
        };
        let missed = Loss {
            kind: LossKind::Missed,
            surface: first,
        };
        let mut d = unit(ray.direction).ok_or(missed)?;
        if !ray.origin.is_finite() {
            return Err(missed);
        }
        let sign = if self.toward == Toward::Film {
            1.0
        } else {
            -1.0
        };
        // `p` is from the vertex of the surface, so positions keep their digits behind a long gap.
        let mut p = ray.origin;
        let mut vertex_z = 0.0;
        for i in 0..count {
            let surface = if self.toward == Toward::Film {
                i
            } else {
                count - 1 - i
            };
            let element = &self.elements[surface];
            vertex_z = element.vertex_z;
            p.z += match self.toward {
                _ if i == 0 => -vertex_z,
                Toward::Film => -self.elements[surface - 1].gap,
                Toward::Scene => element.gap,
            };
            let lost = |kind| Loss { kind, surface };
            let hit = element.meet(p, d, sign).ok_or(lost(LossKind::Missed))?;
            p = hit.point;
            at_hit(surface, vertex_z, &hit);
            let r2 = p.x * p.x + p.y * p.y;
            if self.apertures && !(r2 <= element.clear && element.is_open_at(p)) {
                return Err(lost(LossKind::Blocked));
            }
            d = refract(d, &hit, element.bend(self.toward), sign)
                .ok_or(lost(LossKind::TotalReflection))?;
        }
        Ok(LensRay {
            origin: p + vertex_z * DVec3::Z,
            direction: d,
        })
    }
}
