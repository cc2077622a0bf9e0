//! Finds the shift, scale and rotation that align an old picture with a new one.
//!
//! A search over all rotations and scales on small pictures correlates the directions of their
//! gradients, which gain and gamma do not change. A Gauss-Newton refinement from coarse to fine on
//! the local contrast then reaches a few hundredths of a pixel.
//!
//! Positions are in pixels from the center of their picture, x right and y down.

use glam::{DMat2, DVec2};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::math::fourier::FourierSpectrum;
use rayon::prelude::*;
use serde::Serialize;

use super::chance::{self, Searched};
use super::plane::{Plane, Plate};
use super::refine::{Errors, refine};
use super::tone::{self, Matching};
use super::warp::{Warp, half, is_inside, reduced, resample};

/// The longer side of the small pictures, in pixels.
const SMALL: f64 = 48.0;
/// The side of the square that they are correlated in, in pixels.
const SQUARE: usize = 128;
/// The standard deviation of the blur before contrast is computed, in pixels, for the search.
const COARSE: f64 = 0.3;
/// The standard deviation of the blur before contrast is computed, in pixels, for the refinement.
const FINE: f64 = 1.0;
/// The number of candidates of the search that are refined. More cost time in proportion. With it
/// 58 of 60 scans are recognized, and none of 274 unrelated pairs (docs/guide/compare.md).
const CANDIDATES: usize = 24;
/// The agreement above which the mirrored picture is not searched: it could hardly agree better.
const CLEAR_AGREEMENT: f64 = 0.97;
/// The warps of the search: every 7.5 degrees, and scales from half to double.
pub(super) const SEARCHED: Searched = Searched {
    rotations: 48,
    scales: 4,
    per_octave: 4.0,
    shifts: SQUARE as i32,
};
/// The displacement of corners, in pixels, that nonlinear tones and resampling cause. It bounds the
/// errors from below. The largest that the tests of this file find is 0.02.
const SYSTEMATIC: f64 = 0.02;
/// The number of standard errors within which a scale is 1, a rotation a multiple of 90 degrees,
/// and a shift one of whole pixels.
const WITHIN: f64 = 3.0;

/// The position of the old picture on the new one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Alignment {
    /// The old picture's center, in pixels of the new one from its center.
    pub shift: [f64; 2],
    /// Pixels of the new picture in one of the old.
    pub scale: f64,
    /// The clockwise rotation of the old picture that aligns it, in degrees.
    pub rotation: f64,
    /// Whether the old picture is mirrored, left to right, before it is rotated.
    pub mirrored: bool,
    /// The standard error of the shift along the worse axis, in pixels of the new picture.
    pub shift_error: f64,
    /// The standard error of the scale.
    pub scale_error: f64,
    /// The standard error of the rotation, in degrees.
    pub rotation_error: f64,
    /// The correlation of local contrast where the two overlap, on small pictures.
    pub agreement: f64,
    /// An upper bound on the probability that an unrelated picture agrees as well.
    pub chance: f64,
}

/// An old picture, mirrored if that aligns it, with its warp.
pub(crate) struct Aligned {
    pub old: Plate,
    pub warp: Warp,
    pub alignment: Alignment,
}

/// Finds the warp from the new picture to the old one.
///
/// # Errors
/// Fails if the pictures agree no better than unrelated ones may.
pub(crate) fn align(new: &Plate, old: &Plate) -> Result<Aligned> {
    for (name, picture) in [("new", new), ("old", old)] {
        if is_flat(&picture.luma()) {
            return Err(Diagnostic::error(format!(
                "the pictures can't be aligned: the {name} one has the same brightness everywhere"
            )));
        }
    }
    let found = best(new, old).ok_or_else(|| no_agreement(None))?;
    if found.alignment.chance > chance::LIMIT {
        return Err(no_agreement(Some(&found.alignment)));
    }
    Ok(found)
}

/// Finds the best warp from the new picture to the old one, however good it is.
pub(crate) fn best(new: &Plate, old: &Plate) -> Option<Aligned> {
    let sides = [old.clone(), old.map(Plane::mirrored)];
    let new = new.luma();
    let new_ratio = (new.longer_side() / SMALL).max(1.0);
    let old_ratio = (sides[0].channels[0].longer_side() / SMALL).max(1.0);
    let small = reduced(&new, new_ratio);
    let candidate = |mirrored: bool| {
        let luma = sides[usize::from(mirrored)].luma();
        let (warp, agreement) = search(&small, &luma, old_ratio)?;
        let warp = warp.between(1.0 / new_ratio, 1.0 / old_ratio);
        let chance = SEARCHED.chance(&new, &luma, warp, mirrored);
        Some((mirrored, warp, agreement, chance))
    };
    let direct = candidate(false);
    let is_clear = direct.is_some_and(|d| d.2 >= CLEAR_AGREEMENT && d.3 <= chance::LIMIT);
    let reverse = if is_clear { None } else { candidate(true) };
    let found = direct.into_iter().chain(reverse);
    let by_chance = |a: &(_, _, f64, f64), b: &(_, _, f64, f64)| {
        a.3.total_cmp(&b.3).then(b.2.total_cmp(&a.2)) // Both may be too small for a number.
    };
    let (mirrored, warp, agreement, _) = found.min_by(by_chance)?;
    let [same, reverse] = sides;
    let old = if mirrored { reverse } else { same };
    let luma = old.luma();
    let (warp, errors) = refine_fully(&new, &luma, warp, new_ratio);
    let warp = errors.map_or(warp, |errors| rounded(&new, &luma, warp, errors));
    let chance = SEARCHED.chance(&new, &luma, warp, mirrored);
    let alignment = describe(warp, errors, mirrored, agreement, chance);
    Some(Aligned {
        old,
        warp,
        alignment,
    })
}

/// Returns whether a picture has the same level everywhere, to half a level of 8 bits.
fn is_flat(picture: &Plane) -> bool {
    let values = || picture.values.iter().copied();
    values().fold(f32::MIN, f32::max) - values().fold(f32::MAX, f32::min) < 0.5 / 255.0
}

/// Describes a warp as seen from the new picture.
fn describe(
    warp: Warp,
    errors: Option<Errors>,
    mirrored: bool,
    agreement: f64,
    chance: f64,
) -> Alignment {
    let inverse = DMat2::from_cols(warp.turn, warp.turn.perp()).inverse();
    let center = -(inverse * warp.shift);
    let scale = 1.0 / warp.scale();
    let error = |of: fn(Errors) -> f64| errors.map_or(f64::INFINITY, of);
    Alignment {
        shift: (center + 0.0).to_array(), // Adding zero turns −0 into 0.
        scale,
        rotation: 0.0 - libm::atan2(warp.turn.y, warp.turn.x).to_degrees(),
        mirrored,
        shift_error: scale * error(|e| e.shift),
        scale_error: scale * error(|e| e.scale),
        rotation_error: error(|e| e.rotation).to_degrees(),
        agreement,
        chance,
    }
}

/// Refines a warp from the small pictures to full size, with the errors at full size.
fn refine_fully(new: &Plane, old: &Plane, warp: Warp, ratio: f64) -> (Warp, Option<Errors>) {
    let (mut warp, mut ratio) = (warp, ratio);
    while ratio > 1.0 {
        ratio = (0.5 * ratio).max(1.0);
        (warp, _) = refine_at(new, old, warp, ratio);
    }
    // A nonlinear tone curve moves the middle of a soft edge, so the warp is refined again with
    // matched tones.
    let gray = |p: &Plane| Plate::from_planes([p.clone(), p.clone(), p.clone()]);
    let (onto, shared) = resample(&gray(old), warp, new.width, new.height);
    let [tone, ..] = tone::fit(&gray(new), &onto, &shared, Matching::Channel);
    let (warp, errors) = refine_at(new, &old.map(|v| tone.apply(v)), warp, 1.0);
    let corner = half(new).length();
    let errors = errors.map(|e| Errors {
        scale: e.scale.hypot(SYSTEMATIC / corner),
        rotation: e.rotation.hypot(SYSTEMATIC / corner),
        shift: e.shift.hypot(SYSTEMATIC * warp.scale()),
    });
    (warp, errors)
}

/// Returns the warp with a scale of 1, a rotation by a multiple of 90 degrees and a shift of whole
/// pixels, each if it is within the error. If all three are, no pixel is interpolated.
fn rounded(new: &Plane, old: &Plane, warp: Warp, errors: Errors) -> Warp {
    let mut turn = warp.turn;
    let unit = DVec2::new(turn.x.signum(), 0.0);
    let unit = if turn.x.abs() > turn.y.abs() {
        unit
    } else {
        DVec2::new(0.0, turn.y.signum())
    };
    let is_straight = turn.angle_to(unit).abs() <= WITHIN * errors.rotation;
    let is_same_size = (turn.length() - 1.0).abs() <= WITHIN * errors.scale;
    if is_straight {
        turn = unit * turn.length();
    }
    if is_same_size {
        turn = if is_straight { unit } else { turn.normalize() };
    }
    let mut shift = warp.shift;
    if is_straight && is_same_size {
        // The old picture's pixel on which the new one's first lies.
        let corner = turn.rotate(0.5 - half(new)) + half(old) - 0.5;
        let whole = (corner + shift).round() - corner;
        if (whole - shift).abs().max_element() <= WITHIN * errors.shift {
            shift = whole;
        }
    }
    Warp { turn, shift }
}

/// Refines a warp on the new picture reduced by `ratio`, and on the old one reduced to the same
/// scale.
fn refine_at(new: &Plane, old: &Plane, warp: Warp, ratio: f64) -> (Warp, Option<Errors>) {
    let old_ratio = (ratio * warp.scale()).max(1.0);
    let new = contrast(&reduced(new, ratio), FINE);
    let old = contrast(&reduced(old, old_ratio), FINE);
    let (warp, errors) = refine(&new, &old, warp.between(ratio, old_ratio));
    let errors = errors.map(|e| Errors {
        shift: e.shift * old_ratio,
        ..e
    });
    (warp.between(1.0 / ratio, 1.0 / old_ratio), errors)
}

fn no_agreement(best: Option<&Alignment>) -> Box<Diagnostic> {
    let Some(best) = best else {
        return Diagnostic::error("the two pictures can't be aligned: nothing in them matches")
            .with_help("check that both show the same scene");
    };
    Diagnostic::error(format!(
        "the two pictures can't be aligned: unrelated pictures agree as well with a probability \
         of up to {}, and the limit is {}",
        probability(best.chance),
        chance::LIMIT
    ))
    .with_help(
        "check that both show the same scene, that neither is a negative, and that they have \
         enough detail; if only the size differs, `--resize` compares without a search",
    )
}

/// Returns a probability as text of two digits.
pub(crate) fn probability(value: f64) -> String {
    if value == 0.0 {
        "1e-307".to_owned() // The smallest normal number is 2e-308.
    } else if value < 1e-3 {
        format!("{value:.0e}")
    } else {
        format!("{value:.2}")
    }
}

/// Returns the best warp between small pictures with its agreement. `old_ratio` is the ratio that
/// the old picture is reduced by.
fn search(new: &Plane, old: &Plane, old_ratio: f64) -> Option<(Warp, f64)> {
    let new_spectrum = directions(new, 0.0);
    let per_octave = SEARCHED.per_octave;
    let scales: Vec<f64> = (-SEARCHED.scales..=SEARCHED.scales)
        .map(|i| libm::exp2(f64::from(i) / per_octave))
        .collect();
    let mut found: Vec<(f64, Warp)> = scales
        .par_iter()
        .flat_map_iter(|&scale| {
            // If the scale is right, this picture's pixels are as large as the new one's.
            let ratio = (old_ratio * scale).max(1.0);
            let same = reduced(old, ratio);
            let new_spectrum = &new_spectrum;
            (0..SEARCHED.rotations).map(move |i| {
                let angle = f64::from(i) * std::f64::consts::TAU / f64::from(SEARCHED.rotations);
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
            let (warp, _) = refine(&new, &old, warp.between(1.0, ratio / old_ratio));
            let agreement = agreement(&new, &old, warp);
            (warp.between(1.0, old_ratio / ratio), agreement)
        })
        .collect();
    refined.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the spectrum of the gradient's direction, as a complex number of length up to 1, of a
/// picture rotated about its center and placed in the middle of a square.
fn directions(picture: &Plane, angle: f64) -> FourierSpectrum {
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
    FourierSpectrum::of(SQUARE, field.collect())
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
            let found = align(&new, &old).unwrap();
            assert!(!found.alignment.mirrored && found.alignment.chance < 1e-6);
            let error = corner_error(found.warp, truth);
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
        let report = |warp| describe(warp, None, false, 1.0, 0.0);
        let turned = report(degrees(30.0, 2.0, (0.0, 0.0)));
        assert!((turned.scale - 0.5).abs() < 1e-12);
        assert!((turned.rotation + 30.0).abs() < 1e-12);
        let moved = report(degrees(0.0, 2.0, (10.0, -6.0)));
        assert!((moved.shift[0] + 5.0).abs() < 1e-12 && (moved.shift[1] - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_warp_within_its_error_of_whole_pixels_is_exact_and_one_beyond_stays() {
        let picture = Plane::from_fn(96, 64, |_, _| 0.0);
        let turned = Plane::from_fn(64, 97, |_, _| 0.0);
        let errors = Errors {
            scale: 1e-3,
            rotation: 1e-3,
            shift: 0.05,
        };
        let off = degrees(0.1, 1.002, (3.1, -0.1));
        let exact = rounded(&picture, &picture, off, errors);
        assert_eq!((exact.turn, exact.shift), (DVec2::X, DVec2::new(3.0, 0.0)));
        // 64 and 97 rows: the centers are half a pixel apart.
        let off = degrees(89.9, 0.998, (0.1, 0.45));
        let exact = rounded(&picture, &turned, off, errors);
        assert_eq!(
            (exact.turn, exact.shift),
            (DVec2::Y, DVec2::new(0.0, 0.5)),
            "{exact:?}"
        );
        let far = degrees(0.3, 1.01, (0.3, 0.0));
        assert_eq!(rounded(&picture, &picture, far, errors), far);
    }
}
