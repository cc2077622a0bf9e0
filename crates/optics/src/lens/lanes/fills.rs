//! The fill of rays: the largest ratio of a ray's height at a surface to the semi-diameter, if it
//! is traced without blocking.

use glam::{DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel, dispatch};
use ivcam_base::work;

use crate::lens::lanes::bundle::{Bundle, EMPTY, Fills};
use crate::lens::lanes::follow::{Follow, follow, stretch};
use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Toward};
use crate::lens::trace::tracer::Tracer;

/// The steps of work that a bundle of rays takes at a surface.
pub(super) const SURFACE_STEPS: u64 = 32;

impl Lens {
    /// The fills of rays from a film point through points of the rear vertex plane. If the account
    /// of the scene is used up, all rays are lost; the caller that searches for a pupil checks the
    /// account afterwards.
    pub(crate) fn fills(&self, film: DVec3, x: &Lane, y: &Lane) -> Fills {
        let tracer = &self.tracer(Toward::Scene, false);
        let toward = self.length();
        if work::spend(SURFACE_STEPS * tracer.elements.len() as u64).is_err() {
            return Fills::LOST;
        }
        dispatch(FromFilm {
            tracer,
            film,
            toward,
            x,
            y,
        })
    }

    /// The fills of rays from a film point to aims on the rear vertex plane. A ray is dropped, and
    /// its fill is infinite, if it exceeds `max_fills[0]` at the rear surface or `max_fills[1]` at
    /// another.
    pub(crate) fn fills_up_to(&self, max_fills: [f64; 2], film: DVec3, aims: &[DVec2]) -> Vec<f64> {
        let tracer = &self.tracer(Toward::Scene, false);
        let toward = self.length();
        let mut all = vec![f64::INFINITY; aims.len()];
        // This number of rays stays in the processor's first-level cache.
        const CHUNK: usize = 16 * LANES;
        for (aims, fills) in aims.chunks(CHUNK).zip(all.chunks_mut(CHUNK)) {
            let bundles = aims.len().div_ceil(LANES) * tracer.elements.len();
            if work::spend(SURFACE_STEPS * bundles as u64).is_err() {
                return all;
            }
            dispatch(FillsUpTo {
                tracer,
                film,
                toward,
                max_fills,
                aims,
                fills,
            });
        }
        all
    }

    /// The fills of up to one bundle of rays from the scene. If the account of this thread is used
    /// up, all rays are lost.
    pub(crate) fn fills_toward_film(&self, rays: &[LensRay]) -> Fills {
        let tracer = &self.tracer(Toward::Film, false);
        if work::spend(SURFACE_STEPS * tracer.elements.len() as u64).is_err() {
            return Fills::LOST;
        }
        let bundle = &mut Bundle::default();
        bundle.set_all(rays);
        dispatch(Follow {
            tracer,
            bundle,
            transmittances: None,
        });
        bundle.fills()
    }

    /// The fills of a bundle from the film side. The fill of a lane without a ray is infinite.
    pub(crate) fn fills_of(&self, bundle: &mut Bundle) -> Lane {
        let tracer = &self.tracer(Toward::Scene, false);
        dispatch(Follow {
            tracer,
            bundle,
            transmittances: None,
        });
        bundle.fills().fill
    }
}

/// The kernel of [`Lens::fills`].
struct FromFilm<'a> {
    tracer: &'a Tracer<'a>,
    film: DVec3,
    /// The z of the plane at which the rays are aimed.
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
        follow::<false, FUSED>(self.tracer, &mut bundle, None);
        bundle.fills()
    }
}

/// Starts rays from a film point toward points of the plane z = `toward`.
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

/// The kernel of [`Lens::fills_up_to`].
struct FillsUpTo<'a> {
    tracer: &'a Tracer<'a>,
    film: DVec3,
    /// The z of the plane at which the rays are aimed.
    toward: f64,
    max_fills: [f64; 2],
    aims: &'a [DVec2],
    /// The result, which must be infinite at the start.
    fills: &'a mut [f64],
}

impl SimdKernel for FillsUpTo<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        /// The number of surfaces after which rays are tested again.
        const SURFACES: usize = 3;
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
            // Many rays miss the rear surface, so it is tested by itself.
            let (to, max_fill) = match from {
                0 => (1, self.max_fills[0]),
                _ => (count.min(from + SURFACES), self.max_fills[1]),
            };
            for bundle in &mut bundles {
                stretch::<false, FUSED>(self.tracer, bundle, from..to, None);
                for i in 0..LANES {
                    let exceeds =
                        (bundle.lost[i] == 0.0) & !(bundle.fill[i] <= max_fill * max_fill);
                    bundle.lost[i] = if exceeds { EMPTY } else { bundle.lost[i] };
                }
            }
            compact(&mut bundles, &mut numbers);
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

/// Moves the rays that are not lost into as few bundles as possible. Their `numbers` move with
/// them.
fn compact(bundles: &mut Vec<Bundle>, numbers: &mut Vec<u32>) {
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
