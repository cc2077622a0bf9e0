//! Refines a warp between two planes of local contrast, and estimates its error.

use std::ops::Range;

use glam::DVec2;
use ivcam_base::math::symmetric::solve;
use rayon::prelude::*;

use crate::contrast::{contrast, detail};
use crate::plane::Plane;
use crate::warp::{Warp, half, is_inside, reduced};

/// The width of the border, in pixels, where contrast depends on what lies outside the picture.
const MARGIN: f64 = 12.0;
/// The standard deviation of the blur before contrast is computed, in pixels, for the refinement.
const FINE: f64 = 1.0;
/// The side in pixels of the blocks whose residuals are taken to be independent of each other. It
/// is four times the standard deviation of the blur in local contrast.
const BLOCK: usize = 24;
/// The largest bias of least squares, in pixels at a corner, that is removed.
const MOST_BIAS: f64 = 3.0;
/// The number of unknowns of the fit: turn.x, turn.y, shift.x, shift.y, gain, offset, and the
/// factors of [`MatchedTones::aside`].
const UNKNOWNS: usize = 8;
/// The number of unknowns that are fitted without [`MatchedTones`].
const GENERAL: usize = 6;

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

/// The normal equations of one Gauss-Newton step.
struct Normal {
    matrix: [[f64; UNKNOWNS]; UNKNOWNS],
    right: [f64; UNKNOWNS],
    cost: f64,
    count: f64,
}

impl Normal {
    const ZERO: Self = Self {
        matrix: [[0.0; UNKNOWNS]; UNKNOWNS],
        right: [0.0; UNKNOWNS],
        cost: 0.0,
        count: 0.0,
    };

    fn add(&mut self, row: &[f64; UNKNOWNS], off: f64, weight: f64) {
        for i in 0..UNKNOWNS {
            for j in 0..=i {
                self.matrix[i][j] += weight * row[i] * row[j];
            }
            self.right[i] -= weight * row[i] * off;
        }
    }

    /// Returns the step of the unknowns if a part of the sum is left out, at their optimum; none if
    /// the rest does not determine them.
    fn move_without(&self, part: &Self) -> Option<Vec<f64>> {
        let mut matrix = self.matrix;
        for (row, less) in matrix.iter_mut().zip(&part.matrix) {
            row.iter_mut().zip(less).for_each(|(a, b)| *a -= b);
        }
        solve(matrix.as_flattened(), &part.right, 0.0)
    }

    fn join(mut self, other: &Self) -> Self {
        for i in 0..UNKNOWNS {
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

/// Refines a warp on the local contrast of the new picture reduced by `ratio`, and of the old one
/// reduced to the same scale.
pub(super) fn refine_at(
    new: &Plane,
    old: &Plane,
    warp: Warp,
    ratio: f64,
) -> (Warp, Option<Errors>) {
    let contrast = |p: &Plane| contrast(p, FINE, None);
    at_ratio(new, old, warp, ratio, |new, old, warp| {
        refine(&contrast(new), &contrast(old), warp)
    })
}

/// Refines a warp between pictures of matched tones at full size. Differences of detail count by
/// its standard deviation in the new picture.
///
/// A tone curve that comes after a blur, and overshoot of resampling that is cut at black or white,
/// move every edge toward its dark or its bright side, which would be taken for a change of scale.
/// To first order such a move adds a multiple of the spread of levels within the blur. A softer
/// picture has larger spots; it adds a multiple of what a blur changes. Both are fitted too.
pub(super) fn refine_tones(new: &Plane, old: &Plane, warp: Warp) -> (Warp, Option<Errors>) {
    at_ratio(new, old, warp, 1.0, |new, old, warp| {
        let (off, spread) = detail(new, FINE, None);
        let mean = spread.values.iter().sum::<f32>() / spread.values.len() as f32;
        let squares = new.map(|v| v * v).blurred(FINE);
        let smooth = new.blurred(FINE);
        let at_edges = squares.zip(&smooth, |s, m| (s - m * m).max(0.0).sqrt());
        let softer = smooth.zip(new, |s, v| s - v);
        let matched = MatchedTones {
            scale: spread.map(|s| 1.0 / (s + mean)),
            aside: [at_edges, softer].map(|p| detail(&p, FINE, None).0),
        };
        refine_matched(&off, &detail(old, FINE, None).0, &matched, warp)
    })
}

/// Refines a warp between the pictures reduced to the same scale. Both have pixels of the same size
/// in the scene, the larger ones of the two: contrast over neighborhoods of different sizes would
/// bias the scale.
fn at_ratio(
    new: &Plane,
    old: &Plane,
    warp: Warp,
    ratio: f64,
    refine: impl Fn(&Plane, &Plane, Warp) -> (Warp, Option<Errors>),
) -> (Warp, Option<Errors>) {
    let ratio = ratio.max(1.0 / warp.scale());
    let old_ratio = ratio * warp.scale();
    let (new, old) = (reduced(new, ratio), reduced(old, old_ratio));
    let (warp, errors) = refine(&new, &old, warp.between(ratio, old_ratio));
    let errors = errors.map(|e| Errors {
        shift: e.shift * old_ratio,
        ..e
    });
    (warp.between(1.0 / ratio, 1.0 / old_ratio), errors)
}

/// Refines a warp by the Levenberg-Marquardt method on the robust difference of two planes of
/// contrast. The errors are `None` if the pictures do not determine the warp.
pub(super) fn refine(new: &Plane, old: &Plane, start: Warp) -> (Warp, Option<Errors>) {
    let pair = PicturePair {
        new,
        old,
        gradients: Gradients::Old(old.gradients()),
        matched: None,
        unknowns: GENERAL,
    };
    let (state, width) = pair.descend(start);
    (warp_of(&state), pair.errors(&state, width))
}

/// Refines a warp between planes of detail with the same tones.
///
/// The least squares of the difference would move the noise of the old picture to where it counts
/// least, which biases the scale if noise differs across the picture, as where white is clipped.
/// Therefore the differences are then made uncorrelated with the derivatives of the new picture, in
/// place of the old one's (the method of instrumental variables).
pub(super) fn refine_matched(
    new: &Plane,
    old: &Plane,
    matched: &MatchedTones,
    start: Warp,
) -> (Warp, Option<Errors>) {
    let mut least = start;
    // What moves edges and what softens them may be the same in a picture of little detail.
    for unknowns in (GENERAL..=UNKNOWNS).rev() {
        let mut pair = PicturePair {
            new,
            old,
            gradients: Gradients::Old(old.gradients()),
            matched: Some(matched),
            unknowns,
        };
        let (mut state, width) = pair.descend(start);
        least = warp_of(&state);
        pair.gradients = Gradients::New(new.gradients());
        for _ in 0..20 {
            let sums = pair.normal(&state, width, warp_of(&state));
            let Some(step) = solve(sums.matrix.as_flattened(), &sums.right, 0.0) else {
                break;
            };
            (0..UNKNOWNS).for_each(|i| state[i] += step[i]);
            if move_of(&step, new) < 1e-4 {
                break;
            }
        }
        let warp = warp_of(&state);
        let errors = pair.errors(&state, width);
        if errors.is_some() && warp.distance(least, new) <= MOST_BIAS {
            return (warp, errors);
        }
    }
    (least, None)
}

fn warp_of(state: &[f64; UNKNOWNS]) -> Warp {
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

/// The gradients along x and y of one of two planes, from which the derivatives of the difference
/// are computed.
enum Gradients {
    Old([Plane; 2]),
    New([Plane; 2]),
}

/// Two planes of contrast whose difference is minimized.
struct PicturePair<'a> {
    new: &'a Plane,
    old: &'a Plane,
    gradients: Gradients,
    matched: Option<&'a MatchedTones>,
    /// The number of unknowns that are fitted; the others stay 0.
    unknowns: usize,
}

/// What is known of the new picture's pixels if the tones of both are matched.
pub(super) struct MatchedTones {
    /// The factors of the difference.
    scale: Plane,
    /// The detail of the standard deviation of levels within the blur, and of what another blur
    /// changes.
    aside: [Plane; UNKNOWNS - GENERAL],
}

impl PicturePair<'_> {
    /// Minimizes the robust difference. Returns the unknowns and Huber's threshold.
    fn descend(&self, start: Warp) -> ([f64; UNKNOWNS], f64) {
        let Warp { turn, shift } = start;
        let mut state = [turn.x, turn.y, shift.x, shift.y, 1.0, 0.0, 0.0, 0.0];
        let mut width = 1.0; // Huber's threshold, updated from the residuals.
        let mut damping = 1e-3;
        let mut sums = self.normal(&state, width, start);
        let fewest = 0.25 * sums.count.max(0.2 * self.new.values.len() as f64);
        for _ in 0..40 {
            let Some(step) = solve(sums.matrix.as_flattened(), &sums.right, damping) else {
                break;
            };
            let next: [f64; UNKNOWNS] = std::array::from_fn(|i| state[i] + step[i]);
            // Both costs are of the same pixels: a step that only leaves out bad ones is no better.
            let after = self.normal(&next, width, warp_of(&state));
            if after.cost < sums.cost {
                let spread = (after.cost / after.count).sqrt();
                width = 1.345 * spread.clamp(0.02, 1.0);
                let joined = self.normal(&next, width, warp_of(&next));
                if joined.count < fewest {
                    break;
                }
                let moved = move_of(&step, self.new);
                (state, sums, damping) = (next, joined, (0.3 * damping).max(1e-9));
                if moved < 1e-4 {
                    break;
                }
            } else {
                damping *= 8.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        (state, width)
    }

    /// Sums the normal equations over all pixels that `anchor` puts on the old picture, with
    /// Huber's weights of threshold `width`.
    fn normal(&self, state: &[f64; UNKNOWNS], width: f64, anchor: Warp) -> Normal {
        let columns = 0..self.new.width;
        let rows: Vec<Normal> = (0..self.new.height)
            .into_par_iter()
            .map(|y| self.part(columns.clone(), y..y + 1, state, width, anchor))
            .collect();
        rows.iter().fold(self.without_pixels(), Normal::join)
    }

    /// Returns the normal equations of no pixel, which keep unknowns at 0 that are not fitted.
    fn without_pixels(&self) -> Normal {
        let mut sums = Normal::ZERO;
        (self.unknowns..UNKNOWNS).for_each(|i| sums.matrix[i][i] = 1.0);
        sums
    }

    /// Sums the normal equations over the pixels of a rectangle.
    fn part(
        &self,
        columns: Range<usize>,
        rows: Range<usize>,
        state: &[f64; UNKNOWNS],
        width: f64,
        anchor: Warp,
    ) -> Normal {
        let Self {
            new,
            old,
            gradients,
            ..
        } = self;
        let warp = warp_of(state);
        let margin = MARGIN.min(new.width.min(new.height) as f64 / 12.0);
        let mut sums = Normal::ZERO;
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            let p = DVec2::new(x as f64, y as f64) + 0.5 - half(new);
            let q = warp.apply(p);
            if !is_inside(new, p, margin) || !is_inside(old, anchor.apply(p), margin) {
                continue;
            }
            let at = q + half(old);
            let (scale, [edges, softness]) = self.of_tones(x, y);
            let value = f64::from(old.sample(at.x, at.y));
            let own = f64::from(new.at(x, y));
            let added = state[5] + state[6] * edges + state[7] * softness;
            let off = scale * (state[4] * value + added - own);
            let (g, value) = match gradients {
                Gradients::Old([along_x, along_y]) => {
                    let g = [along_x, along_y].map(|p| f64::from(p.sample(at.x, at.y)));
                    (state[4] * DVec2::from(g), value)
                }
                // As functions of the place in the old picture.
                Gradients::New([along_x, along_y]) => {
                    let g = [along_x, along_y].map(|p| f64::from(p.at(x, y)));
                    let g = warp.turn.rotate(DVec2::from(g)) / warp.turn.length_squared();
                    (g, own / state[4])
                }
            };
            let (along, around) = (g.dot(p), g.dot(p.perp()));
            let row = [along, around, g.x, g.y, value, 1.0, edges, softness].map(|v| scale * v);
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

    /// Returns the factor of the difference at a pixel, and what [`MatchedTones::aside`] has there.
    fn of_tones(&self, x: usize, y: usize) -> (f64, [f64; UNKNOWNS - GENERAL]) {
        let Some(matched) = self.matched else {
            return (1.0, [0.0; UNKNOWNS - GENERAL]);
        };
        let aside = std::array::from_fn(|i| match GENERAL + i < self.unknowns {
            true => f64::from(matched.aside[i].at(x, y)),
            false => 0.0,
        });
        (f64::from(matched.scale.at(x, y)), aside)
    }

    /// Returns the standard errors of the state's warp by the jackknife: how far it moves without
    /// each of the blocks, whose residuals are taken to be independent. Blocks with most of the
    /// detail pull the warp onto themselves, so that their residuals alone would say too little.
    fn errors(&self, state: &[f64; UNKNOWNS], width: f64) -> Option<Errors> {
        let across = self.new.width.div_ceil(BLOCK);
        let blocks: Vec<Normal> = (0..across * self.new.height.div_ceil(BLOCK))
            .into_par_iter()
            .map(|i| {
                let side = |i: usize, most: usize| i * BLOCK..((i + 1) * BLOCK).min(most);
                let columns = side(i % across, self.new.width);
                let rows = side(i / across, self.new.height);
                self.part(columns, rows, state, width, warp_of(state))
            })
            .filter(|b| b.count > 0.0)
            .collect();
        let all = blocks.iter().fold(self.without_pixels(), Normal::join);
        let moves: Option<Vec<Vec<f64>>> = blocks.iter().map(|b| all.move_without(b)).collect();
        let moves = moves?;
        let share = (blocks.len() as f64 - 1.0) / blocks.len() as f64;
        let turn = DVec2::new(state[0], state[1]);
        let unit = turn.normalize();
        let (along, around) = (unit / turn.length(), unit.perp() / turn.length());
        let error = |factors: DVec2, first: usize| {
            let moved = |m: &Vec<f64>| factors.dot(DVec2::new(m[first], m[first + 1]));
            let squares = moves.iter().map(|m| moved(m) * moved(m));
            (share * squares.sum::<f64>()).sqrt()
        };
        Some(Errors {
            scale: error(along, 0),
            rotation: error(around, 0),
            shift: error(DVec2::X, 2).max(error(DVec2::Y, 2)),
        })
    }
}
