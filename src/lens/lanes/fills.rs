//! The fill of rays: traced without blocking, the largest share of a semi-diameter that each uses.

use glam::{DVec2, DVec3};

use crate::lens::lanes::bundle::{Bundle, EMPTY, Fills};
use crate::lens::lanes::follow::{Follow, follow, stretch};
use crate::lens::lens::Lens;
use crate::lens::trace::ray::Toward;
use crate::lens::trace::tracer::Tracer;
use crate::math::lanes::{LANES, Lane, SimdKernel, dispatch};

impl Lens {
    /// The fills of rays from a film point through points of the rear vertex plane.
    pub(crate) fn fills(&self, film: DVec3, x: &Lane, y: &Lane) -> Fills {
        let tracer = &self.tracer(Toward::Scene, false);
        let toward = self.length();
        dispatch(FromFilm {
            tracer,
            film,
            toward,
            x,
            y,
        })
    }

    /// The fills of rays from a film point, if they are no more than `most` at the surface that is met
    /// first and at all others. The fills of the other rays are infinite; those are dropped as soon as
    /// that is known.
    pub(crate) fn fills_up_to(&self, most: [f64; 2], film: DVec3, aims: &[DVec2]) -> Vec<f64> {
        let tracer = &self.tracer(Toward::Scene, false);
        let toward = self.length();
        let mut all = vec![f64::INFINITY; aims.len()];
        // As many at once as stay in the processor's first-level cache.
        const ROOM: usize = 16 * LANES;
        for (aims, fills) in aims.chunks(ROOM).zip(all.chunks_mut(ROOM)) {
            dispatch(UpTo {
                tracer,
                film,
                toward,
                most,
                aims,
                fills,
            });
        }
        all
    }

    /// The fills of a bundle from the film side; infinite for a lane without a ray.
    pub(crate) fn fills_of(&self, bundle: &mut Bundle) -> Lane {
        let tracer = &self.tracer(Toward::Scene, false);
        dispatch(Follow { tracer, bundle });
        bundle.fills().fill
    }
}

/// Rays of one film point.
struct FromFilm<'a> {
    tracer: &'a Tracer<'a>,
    film: DVec3,
    /// The z of the plane that is aimed at.
    toward: f64,
    x: &'a Lane,
    y: &'a Lane,
}

impl SimdKernel for FromFilm<'_> {
    type Output = Fills;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Fills {
        let mut bundle = Bundle::default();
        aim_at(self.film, self.toward, self.x, self.y, &mut bundle);
        follow::<false, FUSED>(self.tracer, &mut bundle);
        bundle.fills()
    }
}

/// Starts rays from a film point toward points of the plane at `toward`.
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

/// Many rays of one film point, of which only those of a small fill matter.
struct UpTo<'a> {
    tracer: &'a Tracer<'a>,
    film: DVec3,
    toward: f64,
    most: [f64; 2],
    aims: &'a [DVec2],
    /// Infinite at the start.
    fills: &'a mut [f64],
}

impl SimdKernel for UpTo<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        /// After this many surfaces, rays are tested again.
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
        let count = self.tracer.elements.len();
        let mut from = 0;
        while from < count {
            // Many rays miss the surface that is met first.
            let (to, most) = match from {
                0 => (1, self.most[0]),
                _ => (count.min(from + STRETCH), self.most[1]),
            };
            for bundle in &mut bundles {
                stretch::<false, FUSED>(self.tracer, bundle, from..to);
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

/// Compacts the rays that are not lost into as few bundles as hold them. Their `numbers` move with
/// them.
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
