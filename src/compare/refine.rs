//! Refines a warp between two planes of local contrast, and estimates its error.

use std::ops::Range;

use glam::DVec2;
use ivcam_base::math::symmetric::solve;
use rayon::prelude::*;

use super::plane::Plane;
use super::warp::{Warp, half, is_inside};

/// The width of the border, in pixels, where contrast depends on what lies outside the picture.
const MARGIN: f64 = 12.0;
/// The side in pixels of the blocks whose residuals are taken to be independent of each other. It
/// is twice the standard deviation of the blur in local contrast.
const BLOCK: usize = 12;

/// The standard errors of a warp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errors {
    /// The relative error of the scale.
    pub scale: f64,
    /// The error of the rotation, in radians.
    pub rotation: f64,
    /// The error of the shift along the worse axis, in pixels of the old picture.
    pub shift: f64,
}
/// The normal equations of one Gauss-Newton step in (turn.x, turn.y, shift.x, shift.y, gain,
/// offset).
struct Normal {
    matrix: [[f64; 6]; 6],
    right: [f64; 6],
    cost: f64,
    count: f64,
}

impl Normal {
    const ZERO: Self = Self {
        matrix: [[0.0; 6]; 6],
        right: [0.0; 6],
        cost: 0.0,
        count: 0.0,
    };

    fn add(&mut self, row: &[f64; 6], off: f64, weight: f64) {
        for i in 0..6 {
            for j in 0..=i {
                self.matrix[i][j] += weight * row[i] * row[j];
            }
            self.right[i] -= weight * row[i] * off;
        }
    }

    fn join(mut self, other: &Self) -> Self {
        for i in 0..6 {
            for j in 0..=i {
                self.matrix[i][j] += other.matrix[i][j];
            }
            self.right[i] += other.right[i];
        }
        self.cost += other.cost;
        self.count += other.count;
        self
    }
}

/// Refines a warp by the Levenberg-Marquardt method on the robust difference of two planes of
/// contrast. The errors are `None` if the pictures do not determine the warp.
pub(super) fn refine(new: &Plane, old: &Plane, start: Warp) -> (Warp, Option<Errors>) {
    let pair = PicturePair {
        new,
        old,
        gradients: old.gradients(),
    };
    let mut state = [
        start.turn.x,
        start.turn.y,
        start.shift.x,
        start.shift.y,
        1.0,
        0.0,
    ];
    let mut width = 1.0; // Huber's threshold, updated from the residuals.
    let mut damping = 1e-3;
    let mut sums = pair.normal(&state, width);
    for _ in 0..40 {
        let Some(step) = solve(sums.matrix.as_flattened(), &sums.right, damping) else {
            break;
        };
        let next: [f64; 6] = std::array::from_fn(|i| state[i] + step[i]);
        let after = pair.normal(&next, width);
        let enough = after.count >= 0.25 * sums.count.max(0.2 * new.values.len() as f64);
        if enough && after.cost / after.count < sums.cost / sums.count {
            let moved = move_of(&step, new);
            (state, sums, damping) = (next, after, (0.3 * damping).max(1e-9));
            if moved < 1e-4 {
                break;
            }
            width = 1.345 * (sums.cost / sums.count).sqrt().clamp(0.02, 1.0);
            sums = pair.normal(&state, width);
        } else {
            damping *= 8.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    (warp_of(&state), pair.errors(&state, width))
}

fn warp_of(state: &[f64; 6]) -> Warp {
    Warp {
        turn: DVec2::new(state[0], state[1]),
        shift: DVec2::new(state[2], state[3]),
    }
}

/// Returns how many pixels a step moves the corner of the picture.
fn move_of(step: &[f64], new: &Plane) -> f64 {
    DVec2::new(step[0], step[1]).length() * half(new).length()
        + DVec2::new(step[2], step[3]).length()
}

/// Two planes of contrast whose difference is minimized, with the gradients of the old one.
struct PicturePair<'a> {
    new: &'a Plane,
    old: &'a Plane,
    gradients: [Plane; 2],
}

impl PicturePair<'_> {
    /// Sums the normal equations over all pixels, with Huber's weights of threshold `width`.
    fn normal(&self, state: &[f64; 6], width: f64) -> Normal {
        let columns = 0..self.new.width;
        let rows: Vec<Normal> = (0..self.new.height)
            .into_par_iter()
            .map(|y| self.part(columns.clone(), y..y + 1, state, width))
            .collect();
        rows.iter().fold(Normal::ZERO, Normal::join)
    }

    /// Sums the normal equations over the pixels of a rectangle.
    fn part(
        &self,
        columns: Range<usize>,
        rows: Range<usize>,
        state: &[f64; 6],
        width: f64,
    ) -> Normal {
        let Self {
            new,
            old,
            gradients,
        } = self;
        let warp = warp_of(state);
        let margin = MARGIN.min(new.width.min(new.height) as f64 / 12.0);
        let mut sums = Normal::ZERO;
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            let p = DVec2::new(x as f64, y as f64) + 0.5 - half(new);
            let q = warp.apply(p);
            if !is_inside(new, p, margin) || !is_inside(old, q, margin) {
                continue;
            }
            let at = q + half(old);
            let value = f64::from(old.sample(at.x, at.y));
            let off = state[4] * value + state[5] - f64::from(new.at(x, y));
            let g = DVec2::new(
                f64::from(gradients[0].sample(at.x, at.y)),
                f64::from(gradients[1].sample(at.x, at.y)),
            ) * state[4];
            let row = [g.dot(p), g.dot(p.perp()), g.x, g.y, value, 1.0];
            let size = off.abs();
            let weight = if size <= width { 1.0 } else { width / size };
            sums.add(&row, off, weight);
            sums.cost += if size <= width {
                off * off
            } else {
                width * (2.0 * size - width)
            };
            sums.count += 1.0;
        }
        sums
    }

    /// Returns the standard errors of the state's warp: the sandwich estimate H⁻¹ S H⁻¹, where S
    /// sums the squared gradients of blocks whose residuals are taken to be independent.
    fn errors(&self, state: &[f64; 6], width: f64) -> Option<Errors> {
        let across = self.new.width.div_ceil(BLOCK);
        let blocks: Vec<Normal> = (0..across * self.new.height.div_ceil(BLOCK))
            .into_par_iter()
            .map(|i| {
                let side = |i: usize, most: usize| i * BLOCK..((i + 1) * BLOCK).min(most);
                let columns = side(i % across, self.new.width);
                self.part(columns, side(i / across, self.new.height), state, width)
            })
            .collect();
        let all = blocks.iter().fold(Normal::ZERO, Normal::join);
        let turn = DVec2::new(state[0], state[1]);
        let unit = turn.normalize();
        let (along, around) = (unit / turn.length(), unit.perp() / turn.length());
        let error = |factors: [f64; 6]| {
            let response = solve(all.matrix.as_flattened(), &factors, 0.0)?;
            let pull = |b: &Normal| -> f64 {
                let terms = b.right.iter().zip(&response);
                terms.map(|(a, b)| a * b).sum()
            };
            let sum: f64 = blocks.iter().map(|b| pull(b) * pull(b)).sum();
            let filled = blocks.iter().filter(|b| b.count > 0.0).count() as f64;
            Some((sum * filled / (filled - 6.0).max(1.0)).sqrt())
        };
        let x = error([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])?;
        let y = error([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])?;
        Some(Errors {
            scale: error([along.x, along.y, 0.0, 0.0, 0.0, 0.0])?,
            rotation: error([around.x, around.y, 0.0, 0.0, 0.0, 0.0])?,
            shift: x.max(y),
        })
    }
}
