//! Finds the shift, scale and rotation that align an old picture with a new one.
//!
//! Paper, mats and scanner beds around the old picture are left out. A search on small pictures
//! finds its place, and a Gauss-Newton refinement from coarse to fine on the local contrast then
//! reaches a few hundredths of a pixel.
//!
//! Positions are in pixels from the center of their picture, x right and y down.

use glam::{DMat2, DVec2};
use ivcam_base::diag::{Diagnostic, Result};
use serde::Serialize;

use crate::chance;
use crate::frame::{self, PhotographFrame};
use crate::plane::{Plane, Plate};
use crate::refine::{Errors, refine_at, refine_tones};
use crate::search::{self, PlaceCandidate, SEARCHED};
use crate::tone::{self, Matching};
use crate::warp::{Warp, half, is_inside, resample};

/// The standard deviation of the blur before tones are matched, in pixels.
const CALM: f64 = 2.0;
/// The agreement above which the mirrored picture is not searched: it could hardly agree better.
const CLEAR_AGREEMENT: f64 = 0.97;
/// The displacement of corners, in pixels, that nonlinear tones and resampling cause. It bounds the
/// errors from below. The largest that the tests of this file find is 0.02.
const SYSTEMATIC: f64 = 0.02;
/// The number of standard errors within which a scale is 1, a rotation a multiple of 90 degrees,
/// and a shift one of whole pixels.
const WITHIN: f64 = 3.0;

/// The position of the old picture on the new one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
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
    /// The pixels of the old picture that are compared, if it has a border of paper, mat or
    /// scanner bed, which is left out.
    pub photograph: Option<PhotographFrame>,
    /// Other places where the old picture agrees as well within the error of the agreement. The
    /// place that changes it least was taken.
    pub alternatives: Vec<Alternative>,
}

/// A place where the old picture agrees nearly as well as at the one that was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Alternative {
    /// Pixels of the new picture in one of the old.
    pub scale: f64,
    /// The clockwise rotation of the old picture, in degrees.
    pub rotation: f64,
    /// Whether the old picture is mirrored, left to right, before it is rotated.
    pub mirrored: bool,
}

/// The old picture within its border, mirrored if that aligns it, with its warp.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Aligned {
    /// The part of the old picture within its border, mirrored if that aligns it.
    pub old: Plate,
    /// The map from the new picture to `old`.
    pub warp: Warp,
    /// The place of the old picture, with its errors.
    pub alignment: Alignment,
}

/// A frame of the old picture, and the places that were found for it.
struct Framed {
    frame: PhotographFrame,
    /// The brightness within the frame, and the same mirrored.
    sides: [Plane; 2],
    /// The one that is taken comes first, then those that agree as well.
    candidates: Vec<PlaceCandidate>,
}

/// Finds the warp from the new picture to the old one.
///
/// # Errors
/// Fails if the pictures agree no better than unrelated ones may, or if the place of the small
/// pictures is none of the large ones.
pub fn align(new: &Plate, old: &Plate) -> Result<Aligned> {
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
    if found.alignment.shift_error.is_infinite() {
        return Err(Diagnostic::error(
            "the pictures can't be aligned: at full size they agree nowhere, though small ones do",
        )
        .with_help("check that both show the same scene; `--resize` only stretches the old one"));
    }
    Ok(found)
}

/// Finds the best warp from the new picture to the old one, however good it is: whoever calls this
/// looks at its chance. `None` if nothing in them matches.
pub fn best(new: &Plate, old: &Plate) -> Option<Aligned> {
    let new = new.luma();
    let luma = old.luma();
    let frames = frame::frames(old);
    let framed: Vec<Framed> = frames
        .iter()
        .filter_map(|frame| Framed::search(&new, &luma, *frame))
        .collect();
    let likeliest = framed
        .iter()
        .min_by(|a, b| a.chosen().evidence.compare(&b.chosen().evidence))?;
    // A border that lies beside the new picture says nothing about the place of the photograph, and
    // disturbs it.
    let same_place = |f: &&Framed| f.covers(&new) && f.is_near(likeliest, &new, &luma);
    let taken = framed.iter().rev().find(same_place).unwrap_or(likeliest);
    taken.finish(&new, old, frames.len())
}

impl Framed {
    /// Searches for the places of the old picture within a frame.
    fn search(new: &Plane, old: &Plane, frame: PhotographFrame) -> Option<Self> {
        let same = frame.cut(old);
        let reverse = same.mirrored();
        let mut candidates = search::candidates(new, &same, false);
        let is_clear = |c: &PlaceCandidate| {
            c.agreement >= CLEAR_AGREEMENT && c.evidence.ln_chance <= libm::log(chance::LIMIT)
        };
        if !candidates.iter().any(is_clear) {
            candidates.extend(search::candidates(new, &reverse, true));
        }
        candidates.sort_by(|a, b| a.evidence.compare(&b.evidence));
        let best = *candidates.first()?;
        candidates.retain(|c| c.evidence.is_as_good_as(&best.evidence));
        candidates.sort_by(|a, b| b.evidence.ln_weight.total_cmp(&a.evidence.ln_weight));
        Some(Self {
            frame,
            sides: [same, reverse],
            candidates,
        })
    }

    fn chosen(&self) -> &PlaceCandidate {
        &self.candidates[0]
    }

    /// Returns a warp to the photograph as one to the whole old picture, which is mirrored too.
    fn to_whole(&self, warp: Warp, old: &Plane) -> Warp {
        let mut offset = self.frame.center() - half(old);
        if self.chosen().mirrored {
            offset.x = -offset.x;
        }
        Warp {
            shift: warp.shift + offset,
            ..warp
        }
    }

    /// Returns whether another frame was put at the same place, within 2% of the new picture.
    fn is_near(&self, other: &Self, new: &Plane, old: &Plane) -> bool {
        let [a, b] = [self, other].map(|f| f.to_whole(f.chosen().warp, old));
        self.chosen().mirrored == other.chosen().mirrored
            && a.distance(b, new) / a.scale() < 0.02 * new.longer_side()
    }

    /// Returns whether the photograph within the frame covers at least nine tenths of the new
    /// picture.
    fn covers(&self, new: &Plane) -> bool {
        let warp = self.chosen().warp;
        let place = |i: usize| (f64::from(i as u8) + 0.5) / 10.0 - 0.5;
        let at = |i: usize| 2.0 * half(new) * DVec2::new(place(i % 10), place(i / 10));
        let covered = (0..100).filter(|i| is_inside(&self.sides[0], warp.apply(at(*i)), 0.0));
        covered.count() >= 90
    }

    /// Refines the chosen place at full size. `tried` is the number of frames that were tried.
    fn finish(&self, new: &Plane, old: &Plate, tried: usize) -> Option<Aligned> {
        let PlaceCandidate {
            mirrored,
            warp,
            agreement,
            ..
        } = *self.chosen();
        let luma = &self.sides[usize::from(mirrored)];
        let ratio = (new.longer_side() / search::SMALL).max(1.0);
        let (warp, errors) = refine_fully(new, luma, warp, ratio);
        let warp = errors.map_or(warp, |errors| rounded(new, luma, warp, errors));
        if !SEARCHED.contains(new, luma, warp) {
            return None;
        }
        let evidence = SEARCHED.evidence([new, luma], warp, mirrored, None);
        let is_whole = self.frame == PhotographFrame::whole(old);
        let alternative = |c: &PlaceCandidate| Alternative {
            scale: 1.0 / c.warp.scale(),
            rotation: rotation(c.warp),
            mirrored: c.mirrored,
        };
        let alignment = Alignment {
            agreement,
            mirrored,
            chance: libm::exp((evidence.ln_chance + libm::log(tried as f64)).min(0.0)),
            photograph: (!is_whole).then_some(self.frame),
            alternatives: self.candidates[1..].iter().map(alternative).collect(),
            ..describe(self.to_whole(warp, &old.channels[0]), errors)
        };
        let within = old.map(|p| self.frame.cut(p));
        Some(Aligned {
            old: if mirrored {
                within.map(Plane::mirrored)
            } else {
                within
            },
            warp,
            alignment,
        })
    }
}

/// Returns whether a picture has the same level everywhere, to half a level of 8 bits.
fn is_flat(picture: &Plane) -> bool {
    let values = || picture.values.iter().copied();
    values().fold(f32::MIN, f32::max) - values().fold(f32::MAX, f32::min) < 0.5 / 255.0
}

/// Returns the clockwise rotation of the old picture that a warp undoes, in degrees.
fn rotation(warp: Warp) -> f64 {
    0.0 - libm::atan2(warp.turn.y, warp.turn.x).to_degrees()
}

/// Describes a warp to the whole old picture as seen from the new one.
fn describe(warp: Warp, errors: Option<Errors>) -> Alignment {
    let inverse = DMat2::from_cols(warp.turn, warp.turn.perp()).inverse();
    let center = -(inverse * warp.shift);
    let scale = 1.0 / warp.scale();
    let error = |of: fn(Errors) -> f64| errors.map_or(f64::INFINITY, of);
    Alignment {
        shift: (center + 0.0).to_array(), // Adding zero turns −0 into 0.
        scale,
        rotation: rotation(warp),
        mirrored: false,
        shift_error: scale * error(|e| e.shift),
        scale_error: scale * error(|e| e.scale),
        rotation_error: error(|e| e.rotation).to_degrees(),
        agreement: 1.0,
        chance: 0.0,
        photograph: None,
        alternatives: Vec::new(),
    }
}

/// Refines a warp from the small pictures to full size, with the errors at full size.
fn refine_fully(new: &Plane, old: &Plane, warp: Warp, ratio: f64) -> (Warp, Option<Errors>) {
    let (mut warp, mut ratio) = (warp, ratio);
    while ratio > 1.0 {
        ratio = (0.5 * ratio).max(1.0);
        (warp, _) = refine_at(new, old, warp, ratio);
    }
    // A nonlinear tone curve moves the middle of a soft edge, so tones are matched: the old
    // picture's to the new one's, which is right for blur before the curve (a lens), and the new
    // one's to the old one's, right for blur after it (a scanner). The mean is taken; half of the
    // difference is an error.
    let gray = |p: &Plane| Plate::from_planes([p.clone(), p.clone(), p.clone()]);
    let (onto, shared) = resample(&gray(old), warp, new.width, new.height);
    // Noise of the levels that a curve is fitted to would flatten it.
    let [calm, calm_onto] = [&gray(new), &onto].map(|p| p.map(|p| p.blurred(CALM)));
    let curve = |to: &Plate, from: &Plate| tone::fit(to, from, &shared, Matching::Channel)[0];
    let (to_new, to_old) = (curve(&calm, &calm_onto), curve(&calm_onto, &calm));
    let (first, errors) = refine_tones(new, &old.map(|v| to_new.apply(v)), warp);
    let (second, other_errors) = refine_tones(&new.map(|v| to_old.apply(v)), old, warp);
    let warp = first.middle(second);
    let off = (first.turn - second.turn) / (2.0 * warp.scale());
    let along = warp.turn.normalize();
    let corner = half(new).length();
    let whole =
        |own: [f64; 2], between: f64, least: f64| own[0].max(own[1]).hypot(between).hypot(least);
    let errors = errors.zip(other_errors).map(|(a, b)| Errors {
        scale: whole([a.scale, b.scale], off.dot(along), SYSTEMATIC / corner),
        rotation: whole(
            [a.rotation, b.rotation],
            off.perp_dot(along),
            SYSTEMATIC / corner,
        ),
        shift: whole(
            [a.shift, b.shift],
            0.5 * first.shift.distance(second.shift),
            SYSTEMATIC * warp.scale(),
        ),
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

/// Returns a probability as text of one or two digits.
pub fn probability(value: f64) -> String {
    if value == 0.0 {
        "1e-307".to_owned() // The smallest normal number is 2e-308.
    } else if value < 0.01 {
        format!("{value:.0e}")
    } else {
        format!("{value:.2}")
    }
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
    fn paper_around_a_turned_photograph_is_left_out() {
        let new = photograph(180, 120, SAME, |v| v);
        let truth = degrees(1.3, 0.8, (3.0, -2.0));
        let inside = view_of_old(truth);
        let scan = photograph(190, 140, inside, |v| v);
        let paper = |plane: &Plane| {
            Plane::from_fn(190, 140, |x, y| {
                let p = DVec2::new(x as f64, y as f64) + 0.5 - half(plane);
                if is_inside(&new.channels[0], inside.apply(p), 0.0) {
                    plane.at(x, y)
                } else {
                    0.93
                }
            })
        };
        let found = align(&new, &scan.map(paper)).unwrap();
        let frame = found.alignment.photograph.unwrap();
        assert!(frame.width < 150 && frame.height < 102, "{frame:?}");
        assert!(
            (found.alignment.scale - 1.25).abs() < 0.003,
            "{:?}",
            found.alignment
        );
        assert!(
            (found.alignment.rotation + 1.3).abs() < 0.1,
            "{:?}",
            found.alignment
        );
        // The old picture's center is that of the scan and not that of the photograph in it.
        let center = inside.apply(DVec2::ZERO);
        let shift = DVec2::from(found.alignment.shift);
        assert!(shift.distance(center) < 0.2, "{shift} {center}");
    }

    /// Returns a bright star with a hole on black, with pixels that are bright or black.
    fn star(width: usize, height: usize, view: Warp) -> Plane {
        let center = 0.5 * DVec2::new(width as f64, height as f64);
        Plane::from_fn(width, height, |x, y| {
            let p = view.apply(DVec2::new(x as f64, y as f64) + 0.5 - center);
            let around = libm::atan2(p.y, p.x);
            let rim = 38.0 + 9.0 * libm::sin(5.0 * around) + 4.0 * libm::sin(11.0 * around + 1.0);
            if (12.0..rim).contains(&p.length()) {
                0.8
            } else {
                0.0
            }
        })
    }

    /// The curve makes the soft edges of the old picture wider. Without a place for that in the fit
    /// the scale is 1.2449 ± 0.0006.
    #[test]
    fn a_tone_curve_after_the_blur_moves_edges_and_does_not_change_the_scale() {
        let plate = |p: Plane| Plate::from_planes([p.clone(), p.clone(), p]);
        let view = degrees(1.3, 1.25, (0.0, 0.0));
        let fine = Warp {
            turn: view.turn / 4.0,
            ..view
        };
        let curve = |v: f32| 0.04 + 0.9 * libm::powf(v.max(0.0), 0.6);
        let fine = star(640, 440, fine);
        let old = Plane::from_fn(160, 110, |x, y| {
            let square = (0..16).map(|i| fine.at(4 * x + i % 4, 4 * y + i / 4));
            curve(square.sum::<f32>() / 16.0)
        });
        let found = align(&plate(star(180, 120, SAME)), &plate(old)).unwrap();
        let found = found.alignment;
        let off = (found.scale - 1.25) / found.scale_error;
        assert!(off.abs() < 3.0, "{off} standard errors, {found:?}");
    }

    #[test]
    fn of_places_that_agree_alike_the_nearest_is_taken_and_the_others_are_told() {
        let wheel = |turn: f64| {
            let plane = Plane::from_fn(120, 120, |x, y| {
                let p = DVec2::new(x as f64, y as f64) + 0.5 - 60.0;
                let spokes = libm::cos(4.0 * (libm::atan2(p.y, p.x) - turn));
                let rim = 0.5 - 0.5 * libm::tanh((p.length() - 45.0) / 2.0);
                (0.3 + (0.2 + 0.15 * spokes + 0.1 * libm::sin(0.4 * p.length())) * rim) as f32
            });
            Plate::from_planes([plane.clone(), plane.clone(), plane])
        };
        let found = align(&wheel(0.0), &wheel(0.03)).unwrap().alignment;
        assert!(found.rotation.abs() < 3.0 && !found.mirrored, "{found:?}");
        let turned = |a: &Alternative| (a.rotation.abs() - 90.0).abs() < 5.0;
        assert!(found.alternatives.iter().any(turned), "{found:?}");
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
        let report = |warp| describe(warp, None);
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
