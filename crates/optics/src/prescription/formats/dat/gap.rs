//! Decides what the second column of a table means.
//!
//! pbrt's files have the distance to the next vertex there, the older files of Kolb and CS348b the
//! distance from the vertex before, and both may call it `axpos`. Other tables have the position of
//! the vertex on the axis. A wrong reading is still a lens, of another focal length, so the word in
//! the heading decides nothing alone: every reading is made and gets points for what speaks for it.
//!
//! | evidence | points |
//! |---|---|
//! | two surfaces cross where light passes, or a glass has no thickness | −3 each |
//! | a glass thicker than three times its diameter | −1 each |
//! | next: the last number is 0 and the first is not | +3 |
//! | next: the last number is the back focus, within 5% of the focal length | +3 |
//! | previous: the first number, of glass, is 0 and the last is not | +3 |
//! | previous: the first number, which nothing then uses, is not 0 | −2 |
//! | position: six or more numbers that all increase (four or five: +1) | +6 |
//! | the focal length is the one that the file states, within 2% | +3 |
//! | the word in the heading | +1 |
//!
//! The reading with the most points is taken, the first in the order next, previous, position if
//! two have the same. [`MARGIN`] points or more ahead of the others it is certain; otherwise a
//! warning names both.

use crate::prescription::formats::reading::Gap;
use crate::prescription::glass::D_LINE;
use crate::prescription::prescription::{Prescription, crossings};

/// The lead in points from which a reading is certain: one piece of evidence that counts, where
/// nothing speaks against it.
pub(super) const MARGIN: i32 = 2;

/// A reading of the second column, and the lens that it gives.
pub(super) struct Candidate {
    pub(super) gap: Gap,
    pub(super) lens: Prescription,
}

/// What a file says beside its numbers.
#[derive(Clone, Copy, Default)]
pub(super) struct Stated {
    /// The meaning of the word in the heading.
    pub(super) heading: Option<Gap>,
    /// The focal length, in the unit of the table.
    pub(super) focal_length: Option<f64>,
}

/// The decision: the reading that is taken, and the one that may be meant instead if the evidence
/// is thin.
pub(super) struct Decision {
    pub(super) taken: Candidate,
    pub(super) rival: Option<Candidate>,
}

/// The thicknesses that the numbers of the second column give.
pub(super) fn thicknesses(column: &[f64], gap: Gap) -> Vec<f64> {
    let next = |i: usize| column.get(i + 1);
    (0..column.len())
        .map(|i| match gap {
            Gap::Next => column[i],
            Gap::Previous => next(i).copied().unwrap_or(0.0),
            Gap::Position => next(i).map_or(0.0, |next| next - column[i]),
        })
        .collect()
}

/// The readings that are possible: positions increase.
pub(super) fn possible(column: &[f64]) -> Vec<Gap> {
    let increases = column.len() >= 4 && column.windows(2).all(|pair| pair[0] < pair[1]);
    match (column.len(), increases) {
        (0 | 1, _) => vec![Gap::Next],
        (_, false) => vec![Gap::Next, Gap::Previous],
        (_, true) => vec![Gap::Next, Gap::Previous, Gap::Position],
    }
}

/// Weighs the readings. There is at least one.
pub(super) fn decide(candidates: Vec<Candidate>, column: &[f64], stated: Stated) -> Decision {
    let scored = candidates.into_iter().map(|candidate| {
        let points = points(&candidate, column, stated);
        (points, candidate)
    });
    let mut scored: Vec<(i32, Candidate)> = scored.collect();
    // The sort is stable.
    scored.sort_by_key(|(points, _)| -points);
    let mut rest = scored.split_off(1);
    let (points, taken) = scored.remove(0);
    let rival = rest.drain(..).next();
    let same = |a: &Candidate, b: &Candidate| {
        let pairs = a.lens.surfaces.iter().zip(&b.lens.surfaces);
        let inner = a.lens.surfaces.len().saturating_sub(1);
        pairs.take(inner).all(|(a, b)| a.thickness == b.thickness)
    };
    let rival = rival.filter(|(other, rival)| points - other < MARGIN && !same(&taken, rival));
    Decision {
        rival: rival.map(|(_, rival)| rival),
        taken,
    }
}

fn points(candidate: &Candidate, column: &[f64], stated: Stated) -> i32 {
    let Candidate { gap, lens } = candidate;
    let (first, last) = (column[0], column[column.len() - 1]);
    let focal = lens.first_order(D_LINE).focal;
    let mut points = -3 * crossings(lens) as i32 - thick_glasses(lens);
    let from_glass = lens.surfaces.first().is_some_and(|s| s.medium.n_d > 1.2);
    points += match gap {
        Gap::Next if last == 0.0 && first != 0.0 => 3,
        Gap::Next => {
            let at_focus = |f: f64, bfl: f64| last != 0.0 && (last - bfl).abs() < 0.05 * f.abs();
            3 * i32::from(focal.is_some_and(|f| at_focus(f.efl, f.bfl)))
        }
        Gap::Previous if first == 0.0 && last != 0.0 && from_glass => 3,
        Gap::Previous if first != 0.0 => -2,
        Gap::Previous => 0,
        Gap::Position if column.len() >= 6 => 6,
        Gap::Position => 1,
    };
    if let (Some(focal), Some(stated)) = (focal, stated.focal_length) {
        points += 3 * i32::from((focal.efl / stated - 1.0).abs() < 0.02);
    }
    points + i32::from(stated.heading == Some(*gap))
}

fn thick_glasses(lens: &Prescription) -> i32 {
    let pairs = lens.surfaces.iter().zip(lens.surfaces.iter().skip(1));
    let thick = pairs.filter(|(front, rear)| {
        let narrow = front.semi_diameter.min(rear.semi_diameter);
        front.medium.n_d > 1.2 && front.thickness > 6.0 * narrow
    });
    thick.count() as i32
}
