//! Mirrors and ideal lenses, whose rays are computed one after another.

use ivcam_base::math::lanes::Lane;

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::step::LaneStep;
use crate::lens::trace::ray::Toward;

/// Moves rays across a mirror of any shape or an ideal lens. `cos` receives the cosines of the
/// angles of incidence. It is no part of the kernel, because few lenses have either.
#[inline(never)]
pub(super) fn cross_singly<const STOPS: bool>(
    step: &LaneStep<'_>,
    toward: Toward,
    b: &mut Bundle,
    cos: &mut Lane,
) {
    let element = step.element;
    for (i, cos) in cos.iter_mut().enumerate() {
        if b.lost[i] != 0.0 {
            continue;
        }
        let mut ray = b.ray(i);
        ray.origin.z += step.shift;
        let origin = element.arriving(toward, ray.origin);
        let direction = element.arriving(toward, ray.direction);
        let hit = element.intersect(origin, direction, element.sign(toward));
        let bent = hit.and_then(|hit| Some((element.bend(direction, &hit, toward)?, hit)));
        let Some((direction, hit)) = bent else {
            b.lost[i] = step.outcome(false, true, true);
            continue;
        };
        *cos = hit.cos;
        let r2 = hit.point.x * hit.point.x + hit.point.y * hit.point.y;
        if !STOPS {
            b.note_fill(i, r2 * step.per_clear, step.number);
        }
        ray.origin = element.leaving(toward, hit.point);
        ray.direction = element.leaving(toward, direction);
        b.put(i, &ray);
        b.lost[i] = step.outcome(true, !STOPS | (r2 <= element.clear), true);
    }
}
