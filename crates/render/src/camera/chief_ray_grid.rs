//! Where a camera sees a point: the inverse of its chief rays.

use glam::DVec3;

use super::kinds::Camera;

/// The number of cells of the grid along each axis. No search is recorded: the error of a place
/// falls with its square, and motion is a difference of two places in one cell or in neighbors.
const CELLS: usize = 64;
/// The least cosine of a ray to the middle one for rays to be scaled to the same depth.
const LEAST_COSINE: f64 = 0.2;
/// The largest number of steps of Newton's method.
const STEPS: usize = 12;
/// The distance beyond the picture's edges, in pictures, within which places are found.
const MARGIN: f64 = 0.5;

/// A point and a direction, in meters from the scene's origin.
type ChiefRayLine = (DVec3, DVec3);

/// The chief rays of a camera at the corners of a grid over the picture, between which they are
/// interpolated.
#[derive(PartialEq)]
pub(crate) struct ChiefRayGrid {
    /// The rays, row by row; none where no light passes.
    rays: Vec<Option<ChiefRayLine>>,
}

impl ChiefRayGrid {
    /// Traces the rays of a camera.
    pub(crate) fn new(camera: &Camera) -> Self {
        let at = |i: usize| (i % (CELLS + 1), i / (CELLS + 1));
        let place = |i: usize| i as f64 / CELLS as f64;
        let ray = |(x, y)| {
            let ray = camera.chief_ray(place(x), place(y))?;
            Some((ray.origin, ray.direction.normalize_or_zero()))
        };
        let count = (CELLS + 1) * (CELLS + 1);
        let mut rays: Vec<_> = (0..count).map(|i| ray(at(i))).collect();
        let middle = rays[count / 2];
        let cosine = |(_, d): &ChiefRayLine| middle.map_or(0.0, |(_, m)| m.dot(*d));
        // Directions of the same depth are linear in the place for a lens without distortion.
        if rays.iter().flatten().all(|ray| cosine(ray) > LEAST_COSINE) {
            rays.iter_mut()
                .flatten()
                .for_each(|ray| ray.1 /= cosine(ray));
        }
        Self { rays }
    }

    /// The ray at a place of the picture, from 0 to 1. Beyond the edges the last cell continues.
    fn ray(&self, [x, y]: [f64; 2]) -> Option<ChiefRayLine> {
        let cell = |p: f64| (p * CELLS as f64).floor().clamp(0.0, (CELLS - 1) as f64);
        let (column, row) = (cell(x), cell(y));
        let (u, v) = (x * CELLS as f64 - column, y * CELLS as f64 - row);
        let first = row as usize * (CELLS + 1) + column as usize;
        let corner = |dx: usize, dy: usize| self.rays[first + dx + dy * (CELLS + 1)];
        let ([a, b], [c, d]) = (
            [corner(0, 0)?, corner(1, 0)?],
            [corner(0, 1)?, corner(1, 1)?],
        );
        let mix = |of: fn(&ChiefRayLine) -> DVec3| {
            let (above, below) = (of(&a).lerp(of(&b), u), of(&c).lerp(of(&d), u));
            above.lerp(below, v)
        };
        Some((mix(|ray| ray.0), mix(|ray| ray.1)))
    }

    /// The vector from the chief ray of a place to a point, at a right angle to the ray, over the
    /// point's distance.
    fn miss(&self, point: DVec3, place: [f64; 2]) -> Option<DVec3> {
        let (origin, direction) = self.ray(place)?;
        let to = point - origin;
        Some((to - to.project_onto(direction)) / to.length().max(f64::MIN_POSITIVE))
    }

    /// Returns the place of the picture at which the camera sees a point, which is in meters from
    /// the scene's origin, by Newton's method from a place near it. Returns `None` if it is too far
    /// beyond the edges, or where no light passes.
    pub(crate) fn place(&self, point: DVec3, near: [f64; 2]) -> Option<[f64; 2]> {
        const STEP: f64 = 1e-4;
        let mut place = near;
        for _ in 0..STEPS {
            let [x, y] = place;
            let miss = self.miss(point, place)?;
            let across = (self.miss(point, [x + STEP, y])? - miss) / STEP;
            let down = (self.miss(point, [x, y + STEP])? - miss) / STEP;
            // The step with the least squares of what remains.
            let (aa, ab, bb) = (across.dot(across), across.dot(down), down.dot(down));
            let (a, b) = (across.dot(miss), down.dot(miss));
            let determinant = aa * bb - ab * ab;
            let step = [
                (bb * a - ab * b) / determinant,
                (aa * b - ab * a) / determinant,
            ];
            place = [x - step[0], y - step[1]];
            let is_inside = |p: f64| (-MARGIN..=1.0 + MARGIN).contains(&p);
            if !place.into_iter().all(is_inside) {
                return None; // NaN too
            }
            if step.into_iter().all(|s| s.abs() < 1e-9) {
                break;
            }
        }
        Some(place)
    }
}
