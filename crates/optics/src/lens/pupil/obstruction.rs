//! The part of a pupil that closed middles of surfaces take.
//!
//! The search for a pupil leaves them out: it finds the outline, inside which some rays are lost.

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Toward};

impl Lens {
    /// The parts of a line on the rear vertex plane, from a center to a point `across` it, whose
    /// rays from a film point hit the closed middle of a surface, from 0 at the center to 1. Found
    /// are those that contain a point of a row of 25.
    pub(crate) fn closed_parts(&self, film: DVec3, center: DVec2, across: DVec2) -> Vec<[f64; 2]> {
        let aim = |t: f64| (center + t * across).extend(self.length());
        self.closed_parts_of(|t| LensRay::new(film, aim(t) - film), Toward::Scene)
    }

    /// The parts of the rays from 0 to 1 that hit the closed middle of a surface. Found are those
    /// that contain one of 25 rays.
    pub(crate) fn closed_parts_of(
        &self,
        ray: impl Fn(f64) -> LensRay,
        toward: Toward,
    ) -> Vec<[f64; 2]> {
        const STEPS: u32 = 24;
        let is_closed = |t: f64| self.is_obstructed_to(ray(t), toward);
        let mut parts = Vec::new();
        let mut start = is_closed(0.0).then_some(0.0);
        for i in 1..=STEPS {
            let [mut low, mut high] = [i - 1, i].map(|i| f64::from(i) / f64::from(STEPS));
            let was_closed = start.is_some();
            if is_closed(high) == was_closed {
                continue;
            }
            for _ in 0..30 {
                let middle = 0.5 * (low + high);
                match is_closed(middle) == was_closed {
                    true => low = middle,
                    false => high = middle,
                }
            }
            match start.take() {
                Some(from) => parts.push([from, high]),
                None => start = Some(high),
            }
        }
        parts.extend(start.map(|from| [from, 1.0]));
        parts
    }

    /// Whether a ray hits the closed middle of a surface. A ray that misses a surface before it is
    /// outside the pupil and counts as open.
    fn is_obstructed_to(&self, ray: LensRay, toward: Toward) -> bool {
        let mut is_closed = false;
        let tracer = self.tracer(toward, false);
        let _ = tracer.walk(ray, |surface, _, hit| {
            let r2 = hit.point.truncate().length_squared();
            is_closed |= r2 < self.elements()[surface].obstruction;
        });
        is_closed
    }
}
