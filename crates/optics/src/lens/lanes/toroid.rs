//! Toroids, which are computed for one ray after another.

use ivcam_base::math::lanes::Lane;

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::step::LaneStep;
use crate::lens::trace::refraction::refract;

/// Crosses a toroid. `cos` receives the cosines of the angles of incidence.
#[inline(always)]
pub(super) fn toroid<const STOPS: bool>(step: &LaneStep<'_>, b: &mut Bundle, cos: &mut Lane) {
    for (i, cos) in cos.iter_mut().enumerate() {
        if b.lost[i] != 0.0 {
            continue;
        }
        let mut ray = b.ray(i);
        ray.origin.z += step.shift;
        b.lost[i] = match step.element.intersect(ray.origin, ray.direction, step.sign) {
            None => step.outcome(false, true, true),
            Some(hit) => {
                ray.origin = hit.point;
                *cos = hit.cos;
                let r2 = hit.point.x * hit.point.x + hit.point.y * hit.point.y;
                if !STOPS {
                    b.note_fill(i, r2 * step.per_clear, step.number);
                }
                match refract(ray.direction, &hit, step.refraction, step.sign) {
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
