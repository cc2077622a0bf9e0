//! Finds the shift, scale and rotation that align an old picture with a new one.
//!
//! A search over all rotations and scales on small pictures correlates the directions of their
//! gradients, which gain and gamma do not change. A Gauss-Newton refinement from coarse to fine on
//! the local contrast then reaches a few hundredths of a pixel.
//!
//! Positions are in pixels from the center of their picture, x right and y down.

use glam::{DMat2, DVec2};
use rayon::prelude::*;
use serde::Serialize;

use super::metric::Mask;
use super::plane::{Plane, Plate};
use super::tone::{self, Matching};
use crate::diag::{Diagnostic, Result};
use crate::math::fourier::Spectrum;
use crate::math::symmetric::solve;

/// The longer side of the small pictures, in pixels.
const SMALL: f64 = 48.0;
/// The side of the square that they are correlated in, in pixels.
const SQUARE: usize = 128;
/// The standard deviation of the blur before contrast is computed, in pixels, for the search.
const COARSE: f64 = 0.3;
/// The standard deviation of the blur before contrast is computed, in pixels, for the refinement.
const FINE: f64 = 1.0;
/// The width of the border, in pixels, where contrast depends on what lies outside the picture.
const MARGIN: f64 = 12.0;
/// The number of candidates of the search that are refined. Chosen by trial.
const CANDIDATES: usize = 24;
/// The correlation of local contrast, on small pictures, below which they are taken to show
/// different scenes. Chosen by trial.
const LEAST_AGREEMENT: f64 = 0.3;

/// A map from points of the new picture to points of the old one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Warp {
    /// A scaled rotation: the cosine and sine, times the pixels of the old picture in one of the
    /// new.
    pub turn: DVec2,
    /// The point of the old picture at the new one's center.
    pub shift: DVec2,
}

/// The position of the old picture on the new one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Alignment {
    /// The old picture's center, in pixels of the new one from its center.
    pub shift: [f64; 2],
    /// Pixels of the new picture in one of the old.
    pub scale: f64,
    /// The clockwise rotation of the old picture that aligns it, in degrees.
    pub rotation: f64,
    /// The correlation of local contrast where the two overlap, on small pictures.
    pub agreement: f64,
}

impl Warp {
    fn apply(self, p: DVec2) -> DVec2 {
        self.turn.rotate(p) + self.shift
    }

    fn scale(self) -> f64 {
        self.turn.length()
    }

    /// Returns the same warp for the pictures reduced by these ratios.
    fn between(self, new_ratio: f64, old_ratio: f64) -> Self {
        Self {
            turn: self.turn * (new_ratio / old_ratio),
            shift: self.shift / old_ratio,
        }
    }

    /// Describes the warp as seen from the new picture.
    fn alignment(self, agreement: f64) -> Alignment {
        let inverse = DMat2::from_cols(self.turn, self.turn.perp()).inverse();
        let center = -(inverse * self.shift);
        Alignment {
            shift: center.to_array(),
            scale: 1.0 / self.scale(),
            rotation: -libm::atan2(self.turn.y, self.turn.x).to_degrees(),
            agreement,
        }
    }
}

/// Resamples the old picture on the new one's pixels; the mask has the pixels that it covers.
pub(crate) fn resample(old: &Plate, warp: Warp, width: usize, height: usize) -> (Plate, Mask) {
    let ratio = warp.scale().max(1.0);
    let reduced = old.map(|p| reduced(p, ratio));
    let warp = warp.between(1.0, ratio);
    let center = 0.5 * DVec2::new(width as f64, height as f64);
    let place = |x: usize, y: usize| warp.apply(DVec2::new(x as f64, y as f64) + 0.5 - center);
    let plate = reduced.map(|p| {
        Plane::from_fn(width, height, |x, y| {
            let at = place(x, y) + half(p);
            p.sample(at.x, at.y)
        })
    });
    let inside = |i: usize| is_inside(&reduced.channels[0], place(i % width, i / width), 0.5);
    let mask = Mask {
        width,
        height,
        counts: (0..width * height).map(inside).collect(),
    };
    (plate, mask)
}

/// Finds the warp from the new picture to the old one.
///
/// # Errors
/// Fails if the pictures do not show the same scene.
pub(crate) fn align(new: &Plate, old: &Plate) -> Result<(Warp, Alignment)> {
    let (new, old) = (new.luma(), old.luma());
    let longer = |p: &Plane| p.width.max(p.height) as f64;
    let new_ratio = (longer(&new) / SMALL).max(1.0);
    let old_ratio = (longer(&old) / SMALL).max(1.0);
    let (mut warp, agreement) = search(&reduced(&new, new_ratio), &old, old_ratio)
        .map(|(warp, a)| (warp.between(1.0 / new_ratio, 1.0 / old_ratio), a))
        .filter(|(_, a)| *a >= LEAST_AGREEMENT)
        .ok_or_else(no_agreement)?;
    let mut ratio = new_ratio;
    while ratio > 1.0 {
        ratio = (0.5 * ratio).max(1.0);
        warp = refine_at(&new, &old, warp, ratio);
    }
    // A nonlinear tone curve moves the middle of a soft edge, so the warp is refined again with
    // matched tones.
    let gray = |p: &Plane| Plate::from_planes([p.clone(), p.clone(), p.clone()]);
    let (onto, shared) = resample(&gray(&old), warp, new.width, new.height);
    let [tone, ..] = tone::fit(&gray(&new), &onto, &shared, Matching::Channel);
    warp = refine_at(&new, &old.map(|v| tone.apply(v)), warp, 1.0);
    Ok((warp, warp.alignment(agreement)))
}

/// Refines a warp on the new picture reduced by `ratio`, and on the old one reduced to the same
/// scale.
fn refine_at(new: &Plane, old: &Plane, warp: Warp, ratio: f64) -> Warp {
    let old_ratio = (ratio * warp.scale()).max(1.0);
    let new = contrast(&reduced(new, ratio), FINE);
    let old = contrast(&reduced(old, old_ratio), FINE);
    refine(&new, &old, warp.between(ratio, old_ratio)).between(1.0 / ratio, 1.0 / old_ratio)
}

fn no_agreement() -> Box<Diagnostic> {
    Diagnostic::error("the two pictures can't be aligned: nothing in them matches")
        .with_help("check that both show the same scene; `--crop x,y,w,h` can leave out a border")
}

/// Returns the best warp between small pictures with its agreement. `old_ratio` is the ratio that
/// the old picture is reduced by.
fn search(new: &Plane, old: &Plane, old_ratio: f64) -> Option<(Warp, f64)> {
    let new_spectrum = directions(new, 0.0);
    let scales: Vec<f64> = (-4..=4).map(|i| libm::exp2(0.25 * f64::from(i))).collect();
    let mut found: Vec<(f64, Warp)> = scales
        .par_iter()
        .flat_map_iter(|&scale| {
            // If the scale is right, this picture's pixels are as large as the new one's.
            let ratio = (old_ratio * scale).max(1.0);
            let same = reduced(old, ratio);
            let new_spectrum = &new_spectrum;
            (0..48).map(move |i| {
                let angle = f64::from(i) * std::f64::consts::TAU / 48.0;
                let (shift, peak) = directions(&same, angle).best_shift(new_spectrum);
                let turn = DVec2::new(libm::cos(angle), libm::sin(angle)) * ratio / old_ratio;
                let shift = turn.rotate(DVec2::new(shift[0] as f64, shift[1] as f64));
                (peak, Warp { turn, shift })
            })
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(CANDIDATES);
    let new = contrast(new, COARSE);
    let refined: Vec<(Warp, f64)> = found
        .par_iter()
        .map(|&(_, warp)| {
            let ratio = (old_ratio * warp.scale()).max(1.0);
            let old = contrast(&reduced(old, ratio), COARSE);
            let warp = refine(&new, &old, warp.between(1.0, ratio / old_ratio));
            let agreement = agreement(&new, &old, warp);
            (warp.between(1.0, old_ratio / ratio), agreement)
        })
        .collect();
    refined.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the spectrum of the gradient's direction, as a complex number of length up to 1, of a
/// picture rotated about its center and placed in the middle of a square.
fn directions(picture: &Plane, angle: f64) -> Spectrum {
    let turn = DVec2::new(libm::cos(angle), libm::sin(angle));
    let middle = 0.5 * SQUARE as f64;
    let turned = Plane::from_fn(SQUARE, SQUARE, |x, y| {
        let p = DVec2::new(x as f64, y as f64) + 0.5 - middle;
        let at = turn.rotate(p) + half(picture);
        picture.sample(at.x, at.y)
    });
    let [gx, gy] = turned.blurred(1.0).gradients();
    let mean: f32 = gx
        .values
        .iter()
        .chain(&gy.values)
        .map(|g| g.abs())
        .sum::<f32>()
        / (2 * SQUARE * SQUARE) as f32;
    let field = (0..SQUARE * SQUARE).map(|i| {
        let p = DVec2::new((i % SQUARE) as f64, (i / SQUARE) as f64) + 0.5 - middle;
        if !is_inside(picture, turn.rotate(p), 0.5) {
            return DVec2::ZERO;
        }
        let g = DVec2::new(f64::from(gx.values[i]), f64::from(gy.values[i]));
        g / (g.length() + f64::from(mean) + 1e-6)
    });
    Spectrum::of(SQUARE, field.collect())
}

/// Returns the local contrast: the difference of the brightness from its surroundings, over the
/// standard deviation there. Gain, offset, gamma and slow shading hardly change it.
pub(super) fn contrast(luma: &Plane, sigma: f64) -> Plane {
    let (off, spread) = detail(luma, sigma);
    off.zip(&spread, |v, s| v / (s + 0.02))
}

/// Returns the difference of the brightness from its surroundings, and the standard deviation
/// there.
pub(super) fn detail(luma: &Plane, sigma: f64) -> (Plane, Plane) {
    let smooth = luma.blurred(sigma);
    let around = smooth.blurred(6.0);
    let off = smooth.zip(&around, |v, a| v - a);
    let squares = off.map(|v| v * v).blurred(6.0);
    (off, squares.map(|s| s.max(0.0).sqrt()))
}

/// Returns a smaller picture with the same center, whose pixels are `ratio` old ones wide.
fn reduced(picture: &Plane, ratio: f64) -> Plane {
    if ratio <= 1.0 {
        return picture.clone();
    }
    let smooth = picture.blurred(0.4 * (ratio * ratio - 1.0).sqrt().max(0.1));
    let size = |n: usize| ((n as f64 / ratio).floor() as usize).max(1);
    let (width, height) = (size(picture.width), size(picture.height));
    let center = 0.5 * DVec2::new(width as f64, height as f64);
    Plane::from_fn(width, height, |x, y| {
        let p = DVec2::new(x as f64, y as f64) + 0.5 - center;
        let at = ratio * p + half(picture);
        smooth.sample(at.x, at.y)
    })
}

/// Returns half of the size, the position of the center from the corner.
fn half(picture: &Plane) -> DVec2 {
    0.5 * DVec2::new(picture.width as f64, picture.height as f64)
}

/// Returns whether a position is at least `margin` pixels from the border. At 0.5 it has a pixel on
/// every side.
fn is_inside(picture: &Plane, p: DVec2, margin: f64) -> bool {
    let room = half(picture) - margin + 1e-9;
    p.x.abs() <= room.x && p.y.abs() <= room.y
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
/// contrast.
fn refine(new: &Plane, old: &Plane, start: Warp) -> Warp {
    let gradients = old.gradients();
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
    let mut sums = normal(new, old, &gradients, &state, width);
    for _ in 0..40 {
        let Some(step) = solve(sums.matrix.as_flattened(), &sums.right, damping) else {
            break;
        };
        let next: [f64; 6] = std::array::from_fn(|i| state[i] + step[i]);
        let after = normal(new, old, &gradients, &next, width);
        let enough = after.count >= 0.25 * sums.count.max(0.2 * new.values.len() as f64);
        if enough && after.cost / after.count < sums.cost / sums.count {
            let moved = move_of(&step, new);
            (state, sums, damping) = (next, after, (0.3 * damping).max(1e-9));
            if moved < 1e-4 {
                break;
            }
            width = 1.345 * (sums.cost / sums.count).sqrt().clamp(0.02, 1.0);
            sums = normal(new, old, &gradients, &state, width);
        } else {
            damping *= 8.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    warp_of(&state)
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

/// Sums the normal equations over all pixels, with Huber's weights of threshold `width`.
fn normal(
    new: &Plane,
    old: &Plane,
    gradients: &[Plane; 2],
    state: &[f64; 6],
    width: f64,
) -> Normal {
    let warp = warp_of(state);
    let margin = MARGIN.min(new.width.min(new.height) as f64 / 12.0);
    let rows: Vec<Normal> = (0..new.height)
        .into_par_iter()
        .map(|y| {
            let mut sums = Normal::ZERO;
            for x in 0..new.width {
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
        })
        .collect();
    rows.iter().fold(Normal::ZERO, Normal::join)
}

/// Returns the correlation of two planes of contrast where they overlap, reduced if the overlap is
/// small.
fn agreement(new: &Plane, old: &Plane, warp: Warp) -> f64 {
    let (mut s, mut count) = ([0.0; 5], 0.0);
    for y in 0..new.height {
        for x in 0..new.width {
            let q = warp.apply(DVec2::new(x as f64, y as f64) + 0.5 - half(new));
            if is_inside(old, q, 0.5) {
                let at = q + half(old);
                let (a, b) = (f64::from(new.at(x, y)), f64::from(old.sample(at.x, at.y)));
                let terms = [a, b, a * a, b * b, a * b];
                s.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
                count += 1.0;
            }
        }
    }
    let [a, b, aa, bb, ab] = s.map(|s| s / count);
    let correlation = (ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt();
    // The correlation is reduced in proportion if less than a third of the smaller picture
    // overlaps.
    let old_area = old.values.len() as f64 / (warp.scale() * warp.scale());
    let common = 3.0 * count / old_area.min(new.values.len() as f64);
    let score = correlation * common.min(1.0);
    if score.is_finite() { score } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the brightness of a scene with detail everywhere.
    fn scene(p: DVec2) -> f32 {
        let wave = |fx: f64, fy: f64, phase: f64| libm::sin(fx * p.x + fy * p.y + phase);
        let box_ = |x: f64, y: f64, w: f64, h: f64| {
            // The edge is two pixels soft, as through a lens.
            let side = |off: f64| 0.5 - 0.5 * libm::tanh(off);
            side((p.x - x).abs() - w) * side((p.y - y).abs() - h)
        };
        let smooth = wave(0.11, 0.02, 0.3) * wave(0.03, 0.13, 1.0) + 0.5 * wave(0.21, -0.17, 2.0);
        let boxes = box_(-40.0, -20.0, 22.0, 13.0) - box_(35.0, 18.0, 30.0, 9.0)
            + box_(20.0, -35.0, 8.0, 14.0)
            + box_(-70.0, 30.0, 12.0, 20.0);
        (0.45 + 0.12 * smooth + 0.22 * boxes) as f32
    }

    /// Returns a picture of the scene; each pixel is the mean over its area.
    fn photograph(
        width: usize,
        height: usize,
        warp: Warp,
        tone: impl Fn(f32) -> f32 + Sync,
    ) -> Plate {
        let center = 0.5 * DVec2::new(width as f64, height as f64);
        let plane = Plane::from_fn(width, height, |x, y| {
            let mut sum = 0.0;
            for i in 0..16 {
                let sub = DVec2::new(f64::from(i % 4) + 0.5, f64::from(i / 4) + 0.5) / 4.0;
                let p = DVec2::new(x as f64, y as f64) + sub - center;
                sum += scene(warp.apply(p));
            }
            tone(sum / 16.0)
        });
        Plate::from_planes([plane.clone(), plane.clone(), plane])
    }

    const SAME: Warp = Warp {
        turn: DVec2::X,
        shift: DVec2::ZERO,
    };

    /// Returns the view of the old picture for which `align` has to find `truth`.
    fn view_of_old(truth: Warp) -> Warp {
        let inverse = DMat2::from_cols(truth.turn, truth.turn.perp()).inverse();
        Warp {
            turn: inverse.x_axis,
            shift: -(inverse * truth.shift),
        }
    }

    /// Returns the largest error at a corner of the new picture, in its pixels.
    fn corner_error(found: Warp, truth: Warp) -> f64 {
        let corners = [(-90.0, -60.0), (90.0, -60.0), (-90.0, 60.0), (90.0, 60.0)];
        let off = |&(x, y): &(f64, f64)| {
            let p = DVec2::new(x, y);
            (found.apply(p) - truth.apply(p)).length() / truth.scale()
        };
        corners.iter().map(off).fold(0.0, f64::max)
    }

    fn degrees(angle: f64, scale: f64, shift: (f64, f64)) -> Warp {
        let a = angle.to_radians();
        Warp {
            turn: scale * DVec2::new(libm::cos(a), libm::sin(a)),
            shift: DVec2::new(shift.0, shift.1),
        }
    }

    #[test]
    fn shift_scale_and_rotation_are_found_to_a_twentieth_of_a_pixel() {
        let new = photograph(180, 120, SAME, |v| v);
        for (angle, scale, shift) in [
            (0.0, 1.0, (0.4, -0.3)),
            (2.3, 1.04, (7.3, -4.6)),
            (-17.0, 0.8, (-5.0, 9.0)),
            (95.0, 1.0, (3.2, 1.1)),
            (181.0, 1.9, (-12.0, 20.0)),
        ] {
            let truth = degrees(angle, scale, shift);
            let side = if scale > 1.5 { (360, 240) } else { (180, 150) };
            let old = photograph(side.0, side.1, view_of_old(truth), |v| 0.1 + 0.7 * v * v);
            let (found, _) = align(&new, &old).unwrap();
            let error = corner_error(found, truth);
            assert!(error < 0.05, "{angle} degrees, {scale}: {error} pixels off");
        }
    }

    #[test]
    fn pictures_of_different_things_are_not_aligned() {
        let new = photograph(96, 64, SAME, |v| v);
        let noise = Plane::from_fn(96, 64, |x, y| {
            ((x * 7919 + y * 104_729) * (x + 31 * y + 7) % 1009) as f32 / 1009.0
        });
        let old = Plate::from_planes([noise.clone(), noise.clone(), noise]);
        assert!(align(&new, &old).is_err());
    }

    #[test]
    fn the_reported_alignment_is_the_position_of_the_old_picture() {
        let report = degrees(30.0, 2.0, (0.0, 0.0)).alignment(1.0);
        assert!((report.scale - 0.5).abs() < 1e-12);
        assert!((report.rotation + 30.0).abs() < 1e-12);
        let moved = degrees(0.0, 2.0, (10.0, -6.0)).alignment(1.0);
        assert!((moved.shift[0] + 5.0).abs() < 1e-12 && (moved.shift[1] - 3.0).abs() < 1e-12);
    }
}
