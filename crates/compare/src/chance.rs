//! Computes how likely the agreement of two aligned pictures is by chance.
//!
//! The statistic is the correlation of the directions of brightness gradients where the aligned
//! pictures overlap. Pixels near each other agree together, so they are not independent
//! observations. The number of independent ones follows from the autocorrelations of the two
//! fields, as in the modified t-test of Clifford, Richardson and Hémon (Biometrics 45, 1989) and
//! Dutilleul (Biometrics 49, 1993). A long straight edge or a smooth ramp counts as few of them.
//!
//! The alignment was searched for, and the best of many warps agrees better than one. A weighted
//! Bonferroni bound takes account of that (Genovese, Roeder and Wasserman, Biometrika 93, 2006):
//! the probability of one warp is divided by the warp's weight, and the weights of all warps that
//! were searched add up to one. Warps that leave the picture where it is have larger weights than
//! turned, scaled and shifted ones, so a picture that needs no alignment has to show less detail.

use std::cmp::Ordering;

use glam::DVec2;
use ivcam_base::math::fourier::{times, transform_square};

use crate::plane::Plane;
use crate::warp::{Warp, half, is_inside, reduced};

/// The largest probability at which two pictures are taken to show the same scene. About one
/// unrelated picture in a thousand would be accepted if the bound were exact.
pub const LIMIT: f64 = 1e-3;

/// The longer sides of the new picture, in pixels, at which the test is made. The search uses the
/// first; noise of a scan favors it, and small detail favors the second.
pub(super) const LEVELS: [f64; 2] = [48.0, 96.0];
/// The side of the square for autocorrelations. Lags up to half a picture of the second level need
/// 144 pixels.
const SIDE: usize = 256;
/// The number of standard errors of a difference within which two agreements are equal.
const AS_GOOD: f64 = 2.0;
/// The share of the weight that mirrored pictures have. They are rarer.
const MIRRORED_SHARE: f64 = 0.01;

/// The warps that are searched, as numbers of steps.
pub(super) struct Searched {
    /// Rotations in a full turn.
    pub rotations: i32,
    /// Scales to either side of the one at which both pictures are equally large.
    pub scales: i32,
    /// Scales in a factor of two.
    pub per_octave: f64,
    /// Shifts along each axis, in pixels of the first level.
    pub shifts: i32,
}

/// How strongly two aligned pictures agree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// The logarithm of a bound on the probability that an unrelated picture agrees as well.
    pub ln_chance: f64,
    /// Fisher's transform of the correlation. Its variance is one over `independent`.
    pub fisher: f64,
    /// The number of independent observations.
    pub independent: f64,
    /// The logarithm of the warp's weight, which is larger the less the warp changes the picture.
    pub ln_weight: f64,
}

impl Evidence {
    /// Orders by the chance, the least likely first.
    pub(super) fn compare(&self, other: &Self) -> Ordering {
        self.ln_chance.total_cmp(&other.ln_chance)
    }

    /// Returns whether this is beyond chance, and its correlation within [`AS_GOOD`] standard
    /// errors of a better one.
    pub(super) fn is_as_good_as(&self, best: &Self) -> bool {
        let error = (1.0 / self.independent + 1.0 / best.independent).sqrt();
        let is_best = self.ln_chance <= best.ln_chance;
        let is_beyond_chance = self.ln_chance <= libm::log(LIMIT);
        is_best || is_beyond_chance && best.fisher - self.fisher <= AS_GOOD * error
    }
}

/// A field of two-dimensional vectors over the pixels of a picture.
struct NoiseField {
    width: usize,
    height: usize,
    values: Vec<DVec2>,
}

impl Searched {
    /// Returns whether a warp's scale is one of those that are searched, or within half a step of
    /// one.
    pub(super) fn contains(&self, new: &Plane, old: &Plane, warp: Warp) -> bool {
        self.steps_of_scale(new, old, warp).abs() <= f64::from(self.scales) + 0.5
    }

    /// Returns how strongly the old picture, the second, agrees with the new one. `warp` maps the
    /// new picture to the old one. `counts` is 0 at pixels of the new one that are left out.
    pub(super) fn evidence(
        &self,
        [new, old]: [&Plane; 2],
        warp: Warp,
        mirrored: bool,
        counts: Option<&Plane>,
    ) -> Evidence {
        let levels = LEVELS.map(|level| {
            let ratio = (new.longer_side() / level).max(1.0);
            let (r, independent) = correlation(&directions([new, old], warp, ratio, counts));
            (ln_tail(r, independent), r, independent)
        });
        let [first, second] = levels;
        let (tail, r, independent) = if first.0 < second.0 { first } else { second };
        let ln_weight = libm::log(self.weight(new, old, warp, mirrored));
        Evidence {
            ln_chance: tail + libm::log(LEVELS.len() as f64) - ln_weight,
            fisher: libm::atanh(r.clamp(-1.0 + 1e-9, 1.0 - 1e-9)),
            independent,
            ln_weight,
        }
    }

    /// Returns a bound on the probability that an unrelated picture agrees as well with a rendering
    /// that lies on it. `moves` are the distances that the fit moved each parameter, in those that
    /// move a picture of the first level by a pixel; the farther, the more was tried. `counts` is 0
    /// at pixels of the rendering that are left out.
    pub(super) fn chance_of_fit(
        &self,
        [new, old]: [&Plane; 2],
        moves: &[f64],
        counts: Option<&Plane>,
    ) -> f64 {
        let still = Warp {
            turn: DVec2::X * old.longer_side() / new.longer_side(),
            shift: DVec2::ZERO,
        };
        let evidence = self.evidence([new, old], still, false, counts);
        let share = |steps: &f64| {
            let one = |steps: f64| 1.0 / (1.0 + 2.0 * steps);
            let reach = self.shifts / 2;
            let whole: f64 = (-reach..=reach).map(|i| one(f64::from(i.abs()))).sum();
            libm::log(one(steps.abs().round()) / whole)
        };
        let tried: f64 = moves.iter().map(share).sum();
        libm::exp((evidence.ln_chance + evidence.ln_weight - tried).min(0.0))
    }

    /// Returns the steps of scale from the one at which both pictures are equally large.
    fn steps_of_scale(&self, new: &Plane, old: &Plane, warp: Warp) -> f64 {
        self.per_octave * libm::log2(warp.scale() * new.longer_side() / old.longer_side())
    }

    /// Returns the weight of a warp: smaller the farther the warp is from leaving the old picture
    /// on the new one's frame. The weights of all warps add up to one.
    fn weight(&self, new: &Plane, old: &Plane, warp: Warp, mirrored: bool) -> f64 {
        let turns = libm::atan2(warp.turn.y, warp.turn.x) / std::f64::consts::TAU;
        let steps = self.steps_of_scale(new, old, warp);
        let small = LEVELS[0] / old.longer_side().max(LEVELS[0]);
        let off = (warp.shift * small).round();
        let one = |i: f64| 1.0 / (1.0 + 2.0 * i.abs().round());
        let disc = |x: f64, y: f64| 1.0 / (1.0 + std::f64::consts::PI * (x * x + y * y));
        let whole = |n: i32| -> f64 { (-n..=n).map(|i| one(f64::from(i))).sum() };
        let reach = self.shifts / 2;
        let row = |y: i32| -> f64 {
            let columns = -reach..reach;
            columns.map(|x| disc(f64::from(x), f64::from(y))).sum()
        };
        let shifts: f64 = (-reach..reach).map(row).sum();
        let side = if mirrored {
            MIRRORED_SHARE
        } else {
            1.0 - MIRRORED_SHARE
        };
        side * one(turns * f64::from(self.rotations)) / whole(self.rotations / 2) * one(steps)
            / whole(self.scales)
            * disc(off.x, off.y)
            / shifts
    }
}

/// Returns the gradient's direction, as a vector of length up to 1, of the new picture reduced by
/// `ratio` and of the old one on its pixels. Both are zero where the pictures do not overlap, and
/// within three pixels of those that do not count.
fn directions(
    [new, old]: [&Plane; 2],
    warp: Warp,
    ratio: f64,
    counts: Option<&Plane>,
) -> [NoiseField; 2] {
    let counts = counts.map(|c| reduced(c, ratio).blurred(1.0));
    let old_ratio = (ratio * warp.scale()).max(1.0);
    let (new, old) = (reduced(new, ratio), reduced(old, old_ratio));
    let warp = warp.between(ratio, old_ratio);
    let place = |x: usize, y: usize| warp.apply(DVec2::new(x as f64, y as f64) + 0.5 - half(&new));
    let (width, height) = (new.width, new.height);
    let onto = Plane::from_fn(width, height, |x, y| {
        let at = place(x, y) + half(&old);
        old.sample(at.x, at.y)
    });
    let inside = |i: usize| {
        is_inside(&old, place(i % width, i / width), 1.5)
            && counts.as_ref().is_none_or(|c| c.values[i] > 0.99)
    };
    let inside: Vec<bool> = (0..width * height).map(inside).collect();
    [&new, &onto].map(|picture| {
        let [gx, gy] = picture.blurred(1.0).gradients();
        let gradient = |i: usize| DVec2::new(f64::from(gx.values[i]), f64::from(gy.values[i]));
        let kept = || (0..inside.len()).filter(|i| inside[*i]);
        let sum: f64 = kept().map(|i| gradient(i).length()).sum();
        let mean = sum / kept().count().max(1) as f64;
        let mut values = vec![DVec2::ZERO; inside.len()];
        for i in kept() {
            // A gradient far below the mean is noise; 1e-6 keeps a flat picture at zero.
            values[i] = gradient(i) / (gradient(i).length() + mean + 1e-6);
        }
        NoiseField {
            width,
            height,
            values,
        }
    })
}

/// Returns the correlation of two fields, and the number of independent observations that it is
/// worth: one over its variance if the fields were unrelated.
fn correlation([a, b]: &[NoiseField; 2]) -> (f64, f64) {
    let squares = |f: &NoiseField| -> f64 { f.values.iter().map(|v| v.length_squared()).sum() };
    let (aa, bb) = (squares(a), squares(b));
    // A field shorter than this everywhere is rounding.
    if !(aa > 1e-6 && bb > 1e-6) {
        return (0.0, 1.0);
    }
    let ab: f64 = a.values.iter().zip(&b.values).map(|(a, b)| a.dot(*b)).sum();
    let covered = |a: &DVec2, b: &DVec2| *a != DVec2::ZERO || *b != DVec2::ZERO;
    let cover = a
        .values
        .iter()
        .zip(&b.values)
        .map(|(a, b)| if covered(a, b) { DVec2::X } else { DVec2::ZERO });
    let cover = NoiseField {
        values: cover.collect(),
        ..*a
    };
    let pixels = cover.values.iter().filter(|v| v.x > 0.0).count() as f64;
    let [(ga, pa), (gb, pb), (pairs, _)] = [a, b, &cover].map(autocorrelation);
    let lag = |i: usize| i.min(SIDE - i);
    let mut variance = 0.0;
    for i in 0..SIDE * SIDE {
        let near = 2 * lag(i % SIDE) <= a.width && 2 * lag(i / SIDE) <= a.height;
        if near && pairs[i].x > 0.5 {
            variance += 0.5 * (ga[i].dot(gb[i]) + pa[i].dot(pb[i])) / pairs[i].x;
        }
    }
    // A vector is two observations, and the estimate cannot make more of them than there are.
    let independent = (aa * bb / variance.max(1e-300)).clamp(1.0, 2.0 * pixels);
    (ab / (aa * bb).sqrt(), independent)
}

/// Returns the sums of v(p)·v(p + d)* and of v(p)·v(p + d), with vectors as complex numbers, for
/// each lag d. Both are needed because directions of gradients prefer some axes.
fn autocorrelation(field: &NoiseField) -> (Vec<DVec2>, Vec<DVec2>) {
    let mut values = vec![DVec2::ZERO; SIDE * SIDE];
    for (y, row) in field.values.chunks(field.width).enumerate() {
        values[y * SIDE..y * SIDE + field.width].copy_from_slice(row);
    }
    transform_square(&mut values, SIDE, -1.0);
    let opposite = |i: usize| {
        let (x, y) = (i % SIDE, i / SIDE);
        values[(SIDE - y) % SIDE * SIDE + (SIDE - x) % SIDE]
    };
    let scale = 1.0 / (SIDE * SIDE) as f64;
    let power = |v: &DVec2| DVec2::new(scale * v.length_squared(), 0.0);
    let mut with_conjugate: Vec<DVec2> = values.iter().map(power).collect();
    let product = |(i, v): (usize, &DVec2)| scale * times(*v, opposite(i));
    let mut plain: Vec<DVec2> = values.iter().enumerate().map(product).collect();
    transform_square(&mut with_conjugate, SIDE, 1.0);
    transform_square(&mut plain, SIDE, 1.0);
    (with_conjugate, plain)
}

/// Returns the logarithm of a bound on the probability that `n` independent pairs of normally
/// distributed numbers with known means correlate by `r` or more.
///
/// The density is proportional to (1 − x²)^((n−3)/2). The integral of (x/r)·density, which is never
/// smaller than that of the density, has a closed form; it is too large by a factor of at most
/// 1 + 1/((n−1)·r²).
fn ln_tail(r: f64, n: f64) -> f64 {
    if r <= 0.0 || n <= 2.0 {
        return 0.0; // Two pairs or fewer prove nothing.
    }
    let m = 0.5 * (n - 1.0);
    let factor = libm::lgamma(0.5 * n) - libm::lgamma(m) - 0.5 * libm::log(std::f64::consts::PI);
    // Rounding leaves a correlation of 1 uncertain by about 1e-16.
    let open = (1.0 - r * r).max(1e-16);
    (factor + m * libm::log(open) - libm::log(2.0 * m * r)).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::SEARCHED;

    /// Returns reproducible numbers of mean 0 and variance 1, nearly normally distributed.
    fn normal_numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            let uniform = |_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as f64 / (1_u64 << 24) as f64
            };
            (0..12).map(uniform).sum::<f64>() - 6.0
        }
    }

    #[test]
    fn the_tail_is_that_of_random_pairs() {
        // For n = 3 the density is constant, ½ from −1 to 1. The integral of x/r from r = ½ to 1,
        // times ½, is 0.375.
        assert!((libm::exp(ln_tail(0.5, 3.0)) - 0.375).abs() < 1e-12);
        // 20 pairs: Student's t of 19 degrees of freedom, r = 0.5614 is t = 2.9568: P = 0.00405.
        let bound = libm::exp(ln_tail(0.5614, 20.0));
        assert!((0.004..0.005).contains(&bound), "{bound}");
    }

    #[test]
    fn unrelated_smooth_fields_correlate_as_their_number_of_observations_says() {
        let mut number = normal_numbers(3);
        let mut smooth = || {
            let plane = Plane {
                width: 48,
                height: 32,
                values: (0..48 * 32).map(|_| number() as f32).collect(),
            };
            plane.blurred(2.0)
        };
        let mut field = || {
            let (x, y) = (smooth(), smooth());
            let both = x.values.iter().zip(&y.values);
            NoiseField {
                width: 48,
                height: 32,
                values: both
                    .map(|(x, y)| DVec2::new(f64::from(*x), f64::from(*y)))
                    .collect(),
            }
        };
        let runs = 60;
        let (mut squares, mut expected) = (0.0, 0.0);
        for _ in 0..runs {
            let (r, n) = correlation(&[field(), field()]);
            squares += r * r / f64::from(runs);
            expected += 1.0 / n / f64::from(runs);
        }
        // The mean of 60 squares has a standard error of 0.18; these are three.
        let ratio = squares / expected;
        assert!((0.45..1.55).contains(&ratio), "{ratio}");
    }

    #[test]
    fn the_weights_of_all_warps_add_up_to_one() {
        let picture = Plane::from_fn(48, 32, |_, _| 0.0);
        let weight = |turn: i32, step: i32, x: i32, y: i32, mirrored: bool| {
            let angle = f64::from(turn) / 48.0 * std::f64::consts::TAU;
            let scale = libm::exp2(f64::from(step) / 4.0);
            let warp = Warp {
                turn: scale * DVec2::new(libm::cos(angle), libm::sin(angle)),
                shift: DVec2::new(f64::from(x), f64::from(y)),
            };
            SEARCHED.weight(&picture, &picture, warp, mirrored)
        };
        // The weight is a product, so that each factor can be added up by itself.
        let one = weight(0, 0, 0, 0, false);
        let turns: f64 = (-23..=24).map(|i| weight(i, 0, 0, 0, false) / one).sum();
        let scales: f64 = (-4..=4).map(|i| weight(0, i, 0, 0, false) / one).sum();
        let row = |y: i32| -> f64 {
            let shifts = -64..64;
            shifts.map(|x| weight(0, 0, x, y, false) / one).sum()
        };
        let shifts: f64 = (-64..64).map(row).sum();
        let sum = (one + weight(0, 0, 0, 0, true)) * turns * scales * shifts;
        // The rotation by −180 degrees is counted in the normalization, and is the one by 180.
        assert!((0.99..=1.0 + 1e-9).contains(&sum), "{sum}");
    }
}
