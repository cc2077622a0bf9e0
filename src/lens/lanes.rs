//! Traces many rays at once: the arithmetic of `trace`, a lane a ray.
//!
//! The arithmetic is that of `trace` in fewer steps: the cosine comes from the discriminant, and
//! products are summed in one step where the processor can. A lane's ray is that of
//! [`Lens::trace_from_film`] to 1e-13 of the lens's size, away from grazing
//! (docs/decisions/0002-fused-arithmetic.md).

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::math::lanes::{Lane, Lanewise, fused, widely};

use super::Lens;
use super::trace::{
    Bend, Course, Element, Form, LensRay, Loss, LossKind, Profile, Toward, refract,
};

pub use crate::math::lanes::{LANES, Width};

/// A bundle of rays, component by component. Directions must be of unit length.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Bundle {
    pub x: Lane,
    pub y: Lane,
    pub z: Lane,
    pub dx: Lane,
    pub dy: Lane,
    pub dz: Lane,
    /// 0 for a ray that is on its way or through; else what became of it, see [`Bundle::loss`].
    /// (As a number among numbers, which every width of vectors can compare.)
    lost: Lane,
    /// Without apertures: the square of the largest share of a semi-diameter used so far, and
    /// the surface it is used at.
    fill: Lane,
    limit: [u64; LANES],
}

impl Default for Bundle {
    /// All lanes empty: rays already lost.
    fn default() -> Self {
        let zero = [0.0; LANES];
        Self {
            x: zero,
            y: zero,
            z: zero,
            dx: zero,
            dy: zero,
            dz: [1.0; LANES],
            lost: [EMPTY; LANES],
            fill: zero,
            limit: [0; LANES],
        }
    }
}

/// How much of the tightest semi-diameter rays use, and a number for the surface or edge.
pub(super) struct Fills {
    pub fill: Lane,
    pub limit: [u64; LANES],
}

const MISSED: u64 = 1;
const BLOCKED: u64 = 2;
const REFLECTED: u64 = 3;
/// A lane that never held a ray.
const EMPTY: f64 = -1.0;

impl Bundle {
    /// Puts a ray, with a direction of unit length, into a lane.
    pub fn set(&mut self, lane: usize, ray: &LensRay) {
        self.put(lane, ray);
        self.lost[lane] = 0.0;
        self.fill[lane] = 0.0;
    }

    /// Of a bundle traced without apertures: how much of the tightest semi-diameter each ray
    /// uses, and where; infinite for a ray lost for another reason.
    fn fills(&self) -> Fills {
        let lost = |lane: usize| self.lost[lane] != 0.0;
        let by = |lane: usize| {
            if lost(lane) {
                self.lost[lane] as u64
            } else {
                self.limit[lane]
            }
        };
        Fills {
            fill: std::array::from_fn(|lane| match lost(lane) {
                true => f64::INFINITY,
                false => self.fill[lane].sqrt(),
            }),
            limit: std::array::from_fn(|lane| by(lane) >> 2),
        }
    }

    /// Takes the lanes' rays, with directions of unit length, to be on their way.
    #[inline(always)]
    pub fn start(&mut self) {
        self.lost = [0.0; LANES];
        self.fill = [0.0; LANES];
    }

    fn put(&mut self, lane: usize, ray: &LensRay) {
        [self.x[lane], self.y[lane], self.z[lane]] = ray.origin.to_array();
        [self.dx[lane], self.dy[lane], self.dz[lane]] = ray.direction.to_array();
    }

    /// Keeps the largest fill of a lane that is on its way.
    #[inline(always)]
    fn note_fill(&mut self, lane: usize, fill: f64, number: u64) {
        let more = (fill > self.fill[lane]) & (self.lost[lane] == 0.0);
        self.fill[lane] = if more { fill } else { self.fill[lane] };
        self.limit[lane] = if more { number } else { self.limit[lane] };
    }

    /// Takes a ray out: its lane is empty from now on.
    pub fn clear(&mut self, lane: usize) {
        self.lost[lane] = EMPTY;
    }

    pub fn ray(&self, lane: usize) -> LensRay {
        LensRay {
            origin: DVec3::new(self.x[lane], self.y[lane], self.z[lane]),
            direction: DVec3::new(self.dx[lane], self.dy[lane], self.dz[lane]),
        }
    }

    /// The lanes that hold a ray that was not lost: bits.
    pub fn through(&self) -> u32 {
        let lanes = self.lost.iter().enumerate();
        lanes.fold(0, |all, (lane, lost)| all | u32::from(*lost == 0.0) << lane)
    }

    /// Whether the lane holds a ray that was not lost.
    pub fn passed(&self, lane: usize) -> bool {
        self.lost[lane] == 0.0
    }

    /// Why the lane's ray was lost; none if it was not, or if the lane is empty.
    pub fn loss(&self, lane: usize) -> Option<Loss> {
        if self.lost[lane] == EMPTY {
            return None;
        }
        let code = self.lost[lane] as u64;
        let kind = match code & 3 {
            MISSED => LossKind::Missed,
            BLOCKED => LossKind::Blocked,
            REFLECTED => LossKind::TotalReflection,
            _ => return None,
        };
        Some(Loss {
            kind,
            surface: (code >> 2) as usize,
        })
    }
}

/// What every lane does at one surface.
struct Step<'a> {
    element: &'a Element,
    number: u64,
    /// Along z, from the last vertex to this one.
    shift: f64,
    bend: Bend,
    sign: f64,
}

impl Step<'_> {
    /// What becomes of a ray that was on its way: see [`Bundle::loss`].
    #[inline(always)]
    fn outcome(&self, met: bool, clear: bool, bends: bool) -> f64 {
        let of = |kind: u64| (self.number | kind) as f64;
        let code = if bends { 0.0 } else { of(REFLECTED) };
        let code = if clear { code } else { of(BLOCKED) };
        if met { code } else { of(MISSED) }
    }
}

impl Lens {
    /// Traces a bundle from the film side into the scene. Rays that get through end on the front
    /// surface; of the others only [`Bundle::loss`] means anything.
    pub fn trace_bundle_from_film(&self, bundle: &mut Bundle) {
        self.trace_bundle(bundle, Toward::Scene, Width::detect());
    }

    /// Traces a bundle from the scene to the film side.
    pub fn trace_bundle_from_scene(&self, bundle: &mut Bundle) {
        self.trace_bundle(bundle, Toward::Film, Width::detect());
    }

    /// Traces with vectors of a given width, for measuring.
    pub fn trace_bundle(&self, bundle: &mut Bundle, toward: Toward, width: Width) {
        let course = &self.course(toward, true);
        width.run(Follow { course, bundle });
    }

    /// Traces from a film point to points of the rear vertex plane and on, without blocking.
    pub(super) fn fills(&self, film: DVec3, x: &Lane, y: &Lane) -> Fills {
        let course = &self.course(Toward::Scene, false);
        let toward = self.length();
        widely(FromFilm {
            course,
            film,
            toward,
            x,
            y,
        })
    }

    /// The fill of aims of a film point, as long as it is no more than `most` at the surface that is
    /// met first and at all others; infinite for the others, which are dropped on their way as soon
    /// as that is known.
    pub(super) fn fills_up_to(&self, most: [f64; 2], film: DVec3, aims: &[DVec2]) -> Vec<f64> {
        let course = &self.course(Toward::Scene, false);
        let toward = self.length();
        let mut all = vec![f64::INFINITY; aims.len()];
        // So many at once as stay in the processor's nearest memory.
        const ROOM: usize = 16 * LANES;
        for (aims, fills) in aims.chunks(ROOM).zip(all.chunks_mut(ROOM)) {
            widely(UpTo {
                course,
                film,
                toward,
                most,
                aims,
                fills,
            });
        }
        all
    }

    /// Traces a bundle from the film side without blocking; a lane without a ray is lost.
    pub(super) fn fills_of(&self, bundle: &mut Bundle) -> Lane {
        let course = &self.course(Toward::Scene, false);
        widely(Follow { course, bundle });
        bundle.fills().fill
    }
}

/// Rays of one film point.
struct FromFilm<'a> {
    course: &'a Course<'a>,
    film: DVec3,
    /// The z of the plane that is aimed at.
    toward: f64,
    x: &'a Lane,
    y: &'a Lane,
}

impl Lanewise for FromFilm<'_> {
    type Output = Fills;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Fills {
        let mut bundle = Bundle::default();
        aim_at(self.film, self.toward, self.x, self.y, &mut bundle);
        follow::<false, FUSED>(self.course, &mut bundle);
        bundle.fills()
    }
}

/// Sets rays of a film point on their way to places of the plane at `toward`.
#[inline(always)]
fn aim_at(film: DVec3, toward: f64, x: &Lane, y: &Lane, bundle: &mut Bundle) {
    let dz = toward - film.z;
    for i in 0..LANES {
        let (dx, dy) = (x[i] - film.x, y[i] - film.y);
        let scale = 1.0 / (dx * dx + dy * dy + dz * dz).sqrt();
        (bundle.x[i], bundle.y[i], bundle.z[i]) = (film.x, film.y, film.z);
        (bundle.dx[i], bundle.dy[i], bundle.dz[i]) = (scale * dx, scale * dy, scale * dz);
    }
    bundle.start();
}

/// Many rays of one film point, of which only those of little fill matter.
struct UpTo<'a> {
    course: &'a Course<'a>,
    film: DVec3,
    toward: f64,
    most: [f64; 2],
    aims: &'a [DVec2],
    /// Infinite to begin with.
    fills: &'a mut [f64],
}

impl Lanewise for UpTo<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        /// Surfaces after which rays are looked at again.
        const STRETCH: usize = 3;
        let mut bundles = vec![Bundle::default(); self.aims.len().div_ceil(LANES)];
        let mut numbers: Vec<u32> = (0..self.aims.len() as u32).collect();
        for (bundle, aims) in bundles.iter_mut().zip(self.aims.chunks(LANES)) {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            for (i, aim) in aims.iter().enumerate() {
                [x[i], y[i]] = aim.to_array();
            }
            aim_at(self.film, self.toward, &x, &y, bundle);
            bundle.lost[aims.len()..].fill(EMPTY);
        }
        let count = self.course.elements.len();
        let mut from = 0;
        while from < count {
            // Much is beside the surface that is met first.
            let (to, most) = match from {
                0 => (1, self.most[0]),
                _ => (count.min(from + STRETCH), self.most[1]),
            };
            for bundle in &mut bundles {
                stretch::<false, FUSED>(self.course, bundle, from..to);
                for i in 0..LANES {
                    let past = (bundle.lost[i] == 0.0) & !(bundle.fill[i] <= most * most);
                    bundle.lost[i] = if past { EMPTY } else { bundle.lost[i] };
                }
            }
            gather(&mut bundles, &mut numbers);
            from = to;
        }
        for (bundle, numbers) in bundles.iter().zip(numbers.chunks(LANES)) {
            for (i, number) in numbers.iter().enumerate() {
                if bundle.lost[i] == 0.0 {
                    self.fills[*number as usize] = bundle.fill[i].sqrt();
                }
            }
        }
    }
}

/// Puts the rays that are on their way into as few bundles as hold them, where that is fewer.
/// `numbers` go with them.
fn gather(bundles: &mut Vec<Bundle>, numbers: &mut Vec<u32>) {
    let left: u32 = bundles.iter().map(|b| b.through().count_ones()).sum();
    let enough = (left as usize).div_ceil(LANES);
    if enough == bundles.len() {
        return;
    }
    let mut to = 0;
    for from in 0..numbers.len() {
        let (bundle, lane) = (from / LANES, from % LANES);
        if bundles[bundle].lost[lane] != 0.0 {
            continue;
        }
        if to < from {
            let (ray, fill) = (bundles[bundle].ray(lane), bundles[bundle].fill[lane]);
            let (other, lane) = (&mut bundles[to / LANES], to % LANES);
            other.set(lane, &ray);
            other.fill[lane] = fill;
            numbers[to] = numbers[from];
        }
        to += 1;
    }
    numbers.truncate(to);
    bundles.truncate(enough);
    if let Some(last) = bundles.last_mut() {
        let used = to - (enough - 1) * LANES;
        last.lost[used..].fill(EMPTY);
    }
}

/// A bundle on its way through a lens.
struct Follow<'a, 'b> {
    course: &'a Course<'a>,
    bundle: &'b mut Bundle,
}

impl Lanewise for Follow<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        if self.course.apertures {
            follow::<true, FUSED>(self.course, self.bundle);
        } else {
            follow::<false, FUSED>(self.course, self.bundle);
        }
    }
}

#[inline(always)]
fn follow<const STOPS: bool, const FUSED: bool>(course: &Course<'_>, bundle: &mut Bundle) {
    let vertex_z = stretch::<STOPS, FUSED>(course, bundle, 0..course.elements.len());
    for z in &mut bundle.z {
        *z += vertex_z;
    }
}

/// Follows rays over some of the surfaces, counted as they are met. Before the first and behind
/// the last their places are from the last vertex that they met, whose z comes back.
#[inline(always)]
fn stretch<const STOPS: bool, const FUSED: bool>(
    course: &Course<'_>,
    bundle: &mut Bundle,
    surfaces: Range<usize>,
) -> f64 {
    let count = course.elements.len();
    let sign = if course.toward == Toward::Film {
        1.0
    } else {
        -1.0
    };
    let mut vertex_z = 0.0;
    let zero = [0.0; LANES];
    let before = &mut Before {
        f: zero,
        g: zero,
        discriminant: zero,
        cos: zero,
    };
    for i in surfaces {
        let surface = if course.toward == Toward::Film {
            i
        } else {
            count - 1 - i
        };
        let element = &course.elements[surface];
        vertex_z = element.vertex_z;
        let shift = match course.toward {
            _ if i == 0 => -vertex_z,
            Toward::Film => -course.elements[surface - 1].gap,
            Toward::Scene => element.gap,
        };
        let bend = element.bend(course.toward);
        let step = Step {
            element,
            number: (surface as u64) << 2,
            shift,
            bend,
            sign,
        };
        match &element.form {
            Form::Sphere => {
                // From far away a ray is first followed to where it is near the vertex.
                if i == 0 || (element.curvature * shift).abs() > 4.0 {
                    approach::<FUSED>(&step, bundle);
                } else {
                    bundle.z.iter_mut().for_each(|z| *z += shift);
                }
                match kind_of(bend) {
                    NO_BEND => sphere::<NO_BEND, STOPS, FUSED>(&step, bundle, before),
                    SLIGHT_BEND => sphere::<SLIGHT_BEND, STOPS, FUSED>(&step, bundle, before),
                    _ => sphere::<BEND, STOPS, FUSED>(&step, bundle, before),
                }
            }
            Form::Conic { k } => quadric::<STOPS>(&step, DVec3::new(1.0, 1.0, 1.0 + k), bundle),
            Form::Cylinder { x, y } => quadric::<STOPS>(&step, DVec3::new(*x, *y, 1.0), bundle),
            Form::Asphere(profile) => asphere::<STOPS, FUSED>(&step, profile, bundle),
            Form::Toroid { .. } => one_by_one::<STOPS>(&step, bundle),
        }
        if STOPS && element.hole.is_some() {
            iris(&step, bundle);
        } else if !STOPS && !element.edges.is_empty() {
            iris_fill(&step, bundle);
        }
    }
    vertex_z
}

/// The medium goes on; the index changes slightly; it changes. See [`refract`].
const NO_BEND: u8 = 0;
const SLIGHT_BEND: u8 = 1;
const BEND: u8 = 2;

fn kind_of(bend: Bend) -> u8 {
    match bend.step {
        0.0 => NO_BEND,
        _ if bend.is_slight() => SLIGHT_BEND,
        _ => BEND,
    }
}

/// Follows rays to where they are nearest to the vertex, so that origins 1e12 mm away are good to
/// their own rounding. Within a lens they are near enough.
#[inline(always)]
fn approach<const FUSED: bool>(step: &Step<'_>, b: &mut Bundle) {
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (x, y, z) = (b.x[i], b.y[i], b.z[i] + step.shift);
        let nearest = -fused::<FUSED>(x, dx, fused::<FUSED>(y, dy, z * dz));
        b.x[i] = fused::<FUSED>(nearest, dx, x);
        b.y[i] = fused::<FUSED>(nearest, dy, y);
        b.z[i] = fused::<FUSED>(nearest, dz, z);
    }
}

/// What is known of rays before they meet a sphere: the parts of the quadratic equation, and the
/// cosine of incidence.
struct Before {
    f: Lane,
    g: Lane,
    discriminant: Lane,
    cos: Lane,
}

/// Spheres and planes, from points counted from the vertex: see [`super::trace::meet_sphere`].
/// The cosine of incidence is the root of the discriminant, and k that of refraction squared.
///
/// It is three loops, for a ray's roots and quotients wait for each other: in one loop a processor
/// holds too few rays at once to do others meanwhile (SSE2 and AVX2 take 1.4 times as long).
#[inline(always)]
fn sphere<const KIND: u8, const STOPS: bool, const FUSED: bool>(
    step: &Step<'_>,
    b: &mut Bundle,
    before: &mut Before,
) {
    let (c, clear, sign) = (step.element.curvature, step.element.clear, step.sign);
    let (mu, bend) = (step.bend.mu, step.bend.step);
    let mu_squared = mu * mu;
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (x, y, z) = (b.x[i], b.y[i], b.z[i]);
        let square = fused::<FUSED>(x, x, fused::<FUSED>(y, y, z * z));
        let along = fused::<FUSED>(x, dx, fused::<FUSED>(y, dy, z * dz));
        let f = fused::<FUSED>(c, square, -2.0 * z);
        let g = fused::<FUSED>(-c, along, dz);
        let discriminant = fused::<FUSED>(g, g, -c * f);
        (before.f[i], before.g[i]) = (f, g);
        (before.discriminant[i], before.cos[i]) = (discriminant, discriminant.sqrt());
    }
    // Nearly always all rays meet the near side.
    let signs = before.g.iter().fold(0, |all, g| all | (sign * g).to_bits());
    if signs >> 63 == 0 {
        advance::<true, FUSED>(c, sign, b, before);
    } else {
        advance::<false, FUSED>(c, sign, b, before);
    }
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (px, py, pz) = (b.x[i], b.y[i], b.z[i]);
        let r2 = fused::<FUSED>(px, px, py * py);
        let up = fused::<FUSED>(-c, pz, 1.0);
        // What met nothing is not a number here, or infinite.
        let met = (up > 0.0) & (fused::<FUSED>(pz, pz, r2) < f64::INFINITY);
        if !STOPS {
            b.note_fill(i, r2 / clear, step.number);
        }
        let mut bends = true;
        if KIND != NO_BEND {
            let cos = before.cos[i];
            let k = fused::<FUSED>(mu_squared, before.discriminant[i], bend);
            let turn = if KIND == SLIGHT_BEND {
                sign * bend / fused::<FUSED>(mu, cos, k.sqrt())
            } else {
                sign * fused::<FUSED>(-mu, cos, k.sqrt())
            };
            bends = k >= 0.0;
            let across = -c * turn;
            b.dx[i] = fused::<FUSED>(mu, dx, across * px);
            b.dy[i] = fused::<FUSED>(mu, dy, across * py);
            b.dz[i] = fused::<FUSED>(mu, dz, turn * up);
        }
        let code = step.outcome(met, !STOPS | (r2 <= clear), bends);
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
    }
}

/// Takes rays to where they meet a sphere: on its near side, or whichever it is.
#[inline(always)]
fn advance<const NEAR: bool, const FUSED: bool>(c: f64, sign: f64, b: &mut Bundle, of: &Before) {
    for i in 0..LANES {
        let (f, g, s) = (of.f[i], of.g[i], sign * of.cos[i]);
        let ahead = NEAR || sign * g >= 0.0;
        let t = (if ahead { f } else { g - s }) / (if ahead { g + s } else { c });
        b.x[i] = fused::<FUSED>(t, b.dx[i], b.x[i]);
        b.y[i] = fused::<FUSED>(t, b.dy[i], b.y[i]);
        b.z[i] = fused::<FUSED>(t, b.dz[i], b.z[i]);
    }
}

/// Conics and cylinders: c (w.x x² + w.y y² + w.z z²) = 2 z.
#[inline(always)]
fn quadric<const STOPS: bool>(step: &Step<'_>, w: DVec3, b: &mut Bundle) {
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

/// The sag of a profile and its slope over the radius, at the squared radii `r2`; `inside` is
/// not positive beyond the conic: [`Profile::sag`].
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

/// Newton's iteration in all lanes at once, until the last has stopped; see `trace`.
#[inline(always)]
fn asphere<const STOPS: bool, const FUSED: bool>(
    step: &Step<'_>,
    profile: &Profile,
    b: &mut Bundle,
) {
    let (c, k, sign) = (profile.c, profile.k, step.sign);
    let (mut qx, mut qy, mut qz) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let (dx, dy, dz) = (b.dx[i], b.dy[i], b.dz[i]);
        let (px, py, pz) = (b.x[i], b.y[i], b.z[i] + step.shift);
        let along = px * dx + py * dy + pz * dz;
        // The start: the conic below the polynomial, or the vertex plane where that is missed.
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
        let met = (discriminant >= 0.0) & (up > 0.0) & (size < f64::INFINITY);
        let flat = if dz != 0.0 { pz / dz } else { along };
        qx[i] = if met { hx } else { px - flat * dx };
        qy[i] = if met { hy } else { py - flat * dy };
        qz[i] = if met { hz } else { pz - flat * dz };
    }
    let mut best = [f64::INFINITY; LANES];
    let mut last = [0.0; LANES];
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let (mut gx, mut gy, mut rate) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let (mut r2, mut sag, mut slope, mut inside) =
        ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
    // 1 while a lane goes on, 0 when it has stopped; a number, so that it stays in vectors.
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
            let settled = known & !better & (square <= 1e-26 * size);
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
                // A few roundings from the surface, or no nearer than before.
                settled | near | !(full.abs() < f64::INFINITY)
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
        // By bits: a sum of these would have to be made in order.
        if going.iter().fold(0, |all, on| all | on.to_bits()) == 0 {
            break;
        }
    }
    let (mu, bend, clear) = (step.bend.mu, step.bend.step, step.element.clear);
    let kind = kind_of(step.bend);
    for i in 0..LANES {
        let size = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
        let near = best[i] <= 1e-11 * (size.sqrt() + best[i]);
        let length = (gx[i] * gx[i] + gy[i] * gy[i] + 1.0).sqrt();
        let (nx, ny, nz) = (gx[i] / length, gy[i] / length, 1.0 / length);
        let cos = sign * rate[i] / length;
        let met = near & (size < f64::INFINITY) & (cos > 0.0);
        let r2 = x[i] * x[i] + y[i] * y[i];
        let k = 1.0 - mu * mu * (1.0 - cos * cos);
        let turn = match kind {
            NO_BEND => 0.0,
            SLIGHT_BEND => sign * bend / (k.sqrt() + mu * cos),
            _ => sign * (k.sqrt() - mu * cos),
        };
        if !STOPS {
            b.note_fill(i, r2 / clear, step.number);
        }
        let code = step.outcome(met, !STOPS | (r2 <= clear), (k >= 0.0) | (kind == NO_BEND));
        b.lost[i] = if b.lost[i] == 0.0 { code } else { b.lost[i] };
        b.dx[i] = mu * b.dx[i] + turn * nx;
        b.dy[i] = mu * b.dy[i] + turn * ny;
        b.dz[i] = mu * b.dz[i] + turn * nz;
        (b.x[i], b.y[i], b.z[i]) = (x[i], y[i], z[i]);
    }
}

/// A hole that is not round, ray by ray.
fn iris(step: &Step<'_>, b: &mut Bundle) {
    for i in 0..LANES {
        if b.lost[i] == 0.0 && !step.element.is_open_at(DVec3::new(b.x[i], b.y[i], b.z[i])) {
            b.lost[i] = step.outcome(true, false, true);
        }
    }
}

/// How much of a hole that is not round each ray uses; every edge is a limit of its own.
fn iris_fill(step: &Step<'_>, b: &mut Bundle) {
    for i in 0..LANES {
        for (edge, number) in step.element.edges.iter().zip(1u64..) {
            let share = (edge.x * b.x[i] + edge.y * b.y[i]).max(0.0);
            b.note_fill(i, share * share, step.number | number << 32);
        }
    }
}

/// Toroids, ray by ray.
#[inline(always)]
fn one_by_one<const STOPS: bool>(step: &Step<'_>, b: &mut Bundle) {
    for i in 0..LANES {
        if b.lost[i] != 0.0 {
            continue;
        }
        let mut ray = b.ray(i);
        ray.origin.z += step.shift;
        b.lost[i] = match step.element.meet(ray.origin, ray.direction, step.sign) {
            None => step.outcome(false, true, true),
            Some(hit) => {
                ray.origin = hit.point;
                let r2 = hit.point.x * hit.point.x + hit.point.y * hit.point.y;
                if !STOPS {
                    b.note_fill(i, r2 / step.element.clear, step.number);
                }
                match refract(ray.direction, &hit, step.bend, step.sign) {
                    _ if STOPS && !(r2 <= step.element.clear) => step.outcome(true, false, true),
                    None => step.outcome(true, true, false),
                    Some(direction) => {
                        ray.direction = direction;
                        b.put(i, &ray);
                        0.0
                    }
                }
            }
        };
    }
}
