//! Searches over all rotations and scales on small pictures for the places of an old picture.
//!
//! The directions of gradients are correlated, which gain and gamma do not change. The best places
//! are refined, and judged by how likely their agreement is by chance.

use glam::DVec2;
use ivcam_base::math::fourier::FourierSpectrum;
use rayon::prelude::*;

use crate::chance::{self, Evidence, Searched};
use crate::contrast::contrast;
use crate::plane::Plane;
use crate::refine::refine;
use crate::refine::refine_at;
use crate::warp::{Warp, half, is_inside, reduced};

/// The longer side of the small pictures, in pixels.
pub(super) const SMALL: f64 = 48.0;
/// The side of the square that they are correlated in, in pixels.
const SQUARE: usize = 128;
/// The standard deviation of the blur before contrast is computed, in pixels, for the search.
const COARSE: f64 = 0.3;
/// The number of candidates of the search that are refined. More cost time in proportion. With it
/// 58 of 60 scans are recognized, and none of 274 unrelated pairs (docs/guide/compare.md).
const CANDIDATES: usize = 24;
/// The number of different places whose evidence is computed.
const PLACES: usize = 4;
/// The difference of agreement from the best place below which a place is not judged.
const WORSE: f64 = 0.15;
/// The difference of places, in parts of the picture, up to which they are one.
const SAME_PLACE: f64 = 0.06;
/// The warps of the search: every 7.5 degrees, and scales from half to double.
pub(super) const SEARCHED: Searched = Searched {
    rotations: 48,
    scales: 4,
    per_octave: 4.0,
    shifts: SQUARE as i32,
};
/// A warp from the new picture to the old one within a frame, with how well it agrees.
#[derive(Clone, Copy)]
pub(super) struct PlaceCandidate {
    pub mirrored: bool,
    pub warp: Warp,
    /// The correlation of local contrast on small pictures.
    pub agreement: f64,
    pub evidence: Evidence,
}

/// Returns the best places of the old picture. `mirrored` says whether it was mirrored before.
pub(super) fn candidates(new: &Plane, old: &Plane, mirrored: bool) -> Vec<PlaceCandidate> {
    let new_ratio = (new.longer_side() / SMALL).max(1.0);
    let old_ratio = (old.longer_side() / SMALL).max(1.0);
    let small = reduced(new, new_ratio);
    let mut found: Vec<(Warp, f64)> = Vec::new();
    // The scales of the search are reduced from a picture that is still larger than they are.
    let base_ratio = (0.25 * old_ratio).max(1.0);
    let base = reduced(old, base_ratio);
    for (warp, agreement) in search(&small, &base, old_ratio / base_ratio) {
        let warp = warp.between(1.0 / new_ratio, 1.0 / old_ratio);
        if found.first().is_some_and(|best| agreement < best.1 - WORSE) {
            break;
        }
        let is_same = |other: &(Warp, f64)| {
            warp.distance(other.0, new) / warp.scale() < SAME_PLACE * new.longer_side()
        };
        if found.len() < PLACES && !found.iter().any(is_same) && SEARCHED.contains(new, old, warp) {
            found.push((warp, agreement));
        }
    }
    let judged = found.into_par_iter().map(|(warp, agreement)| {
        let ratio = (new.longer_side() / chance::LEVELS[1]).max(1.0);
        let (refined, _) = refine_at(new, old, warp, ratio);
        let warp = if SEARCHED.contains(new, old, refined) {
            refined
        } else {
            warp
        };
        PlaceCandidate {
            mirrored,
            warp,
            agreement,
            evidence: SEARCHED.evidence([new, old], warp, mirrored, None),
        }
    });
    judged.collect()
}

/// Returns warps between small pictures with their agreement, the best first. `old_ratio` is the
/// ratio that the old picture is reduced by.
fn search(new: &Plane, old: &Plane, old_ratio: f64) -> Vec<(Warp, f64)> {
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
            (0..SEARCHED.rotations / 2).flat_map(move |i| {
                let angle = f64::from(i) * std::f64::consts::TAU / f64::from(SEARCHED.rotations);
                let spectrum = directions(&same, angle);
                let turn = DVec2::new(libm::cos(angle), libm::sin(angle)) * ratio / old_ratio;
                let opposite = (spectrum.half_turned(), -turn);
                [(spectrum, turn), opposite].map(|(spectrum, turn)| {
                    let (shift, peak) = spectrum.best_shift(new_spectrum);
                    let shift = turn.rotate(DVec2::new(shift[0] as f64, shift[1] as f64));
                    (peak, Warp { turn, shift })
                })
            })
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(CANDIDATES);
    let new = contrast(new, COARSE, None);
    let mut refined: Vec<(Warp, f64)> = found
        .par_iter()
        .map(|&(_, warp)| {
            let ratio = (old_ratio * warp.scale()).max(1.0);
            let old = contrast(&reduced(old, ratio), COARSE, None);
            let (warp, _) = refine(&new, &old, warp.between(1.0, ratio / old_ratio));
            let agreement = agreement(&new, &old, warp);
            (warp.between(1.0, old_ratio / ratio), agreement)
        })
        .collect();
    refined.sort_by(|a, b| b.1.total_cmp(&a.1));
    refined
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
