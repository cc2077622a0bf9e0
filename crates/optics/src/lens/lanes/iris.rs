//! Holes of the iris that are not round, and surfaces whose middle is closed.

use ivcam_base::math::lanes::LANES;

use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::step::LaneStep;
use crate::lens::trace::element::{edges_of, is_left_of};

/// Blocks the rays that hit the closed middle of a surface.
#[inline(always)]
pub(super) fn block_at_obstruction(step: &LaneStep<'_>, b: &mut Bundle) {
    if step.element.obstruction > 0.0 {
        block_inside(step, b);
    }
}

/// Blocks the rays in the closed middle of a surface. It is no part of the kernel, because few
/// lenses have one.
#[cold]
#[inline(never)]
fn block_inside(step: &LaneStep<'_>, b: &mut Bundle) {
    let obstruction = step.element.obstruction;
    let blocked = step.outcome(true, false, true);
    for i in 0..LANES {
        let inside = b.x[i] * b.x[i] + b.y[i] * b.y[i] < obstruction;
        let is_blocked = (b.lost[i] == 0.0) & inside;
        b.lost[i] = if is_blocked { blocked } else { b.lost[i] };
    }
}

/// Blocks the rays that are outside a hole that is not round.
#[inline(always)]
pub(super) fn block_at_iris(step: &LaneStep<'_>, b: &mut Bundle) {
    let Some(corners) = &step.element.hole else {
        return;
    };
    let mut inside = [false; LANES];
    for edge in edges_of(corners) {
        for (i, inside) in inside.iter_mut().enumerate() {
            *inside ^= is_left_of(edge, [b.x[i], b.y[i]]);
        }
    }
    let blocked = step.outcome(true, false, true);
    for (lost, inside) in b.lost.iter_mut().zip(inside) {
        let is_blocked = (*lost == 0.0) & !inside;
        *lost = if is_blocked { blocked } else { *lost };
    }
}

/// Notes the fill at a hole that is not round. Every edge has a number of its own.
#[inline(always)]
pub(super) fn note_iris_fill(step: &LaneStep<'_>, b: &mut Bundle) {
    for (edge, number) in step.element.edges.iter().zip(1u64..) {
        for i in 0..LANES {
            let share = (edge.x * b.x[i] + edge.y * b.y[i]).max(0.0);
            b.note_fill(i, share * share, step.number | number << 32);
        }
    }
}
