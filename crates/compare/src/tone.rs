//! Matches the tones of one picture to another's: gain, offset and gamma.
//!
//! How an archival picture was scanned, printed and converted is unknown. Its levels are assumed to
//! follow `offset + gain·levelᵞ` of the correct ones.

use serde::Serialize;

use crate::metric::Mask;
use crate::plane::{Plane, Plate};

/// The tone curve `offset + gain·levelᵞ`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tone {
    /// The factor on the level.
    pub gain: f64,
    /// The level that black becomes.
    pub offset: f64,
    /// The exponent of the level.
    pub gamma: f64,
}

/// The number of tone curves that are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Matching {
    /// Tones are not matched.
    None,
    /// One curve for the whole picture.
    Picture,
    /// One curve for each of red, green and blue.
    Channel,
}

impl Tone {
    /// The curve that changes nothing.
    pub const IDENTITY: Self = Self {
        gain: 1.0,
        offset: 0.0,
        gamma: 1.0,
    };

    /// Returns the level that a level becomes.
    pub(crate) fn apply(self, level: f32) -> f32 {
        if self == Self::IDENTITY {
            return level;
        }
        let curved = libm::pow(f64::from(level.max(0.0)), self.gamma);
        (self.offset + self.gain * curved) as f32
    }
}

/// Fits the curves, one per channel, that make `old` most like `new`.
pub(crate) fn fit(new: &Plate, old: &Plate, mask: &Mask, matching: Matching) -> [Tone; 3] {
    let pairs = |c: usize| Pairs::of(&new.channels[c], &old.channels[c], mask);
    match matching {
        Matching::None => [Tone::IDENTITY; 3],
        Matching::Picture => {
            let mut all = pairs(0);
            all.0.extend(pairs(1).0);
            all.0.extend(pairs(2).0);
            [all.fit(); 3]
        }
        Matching::Channel => [0, 1, 2].map(|c| pairs(c).fit()),
    }
}

/// Pairs of levels (old, new) of the same pixels.
struct Pairs(Vec<(f64, f64)>);

/// A least-squares line through pairs of levels, and its sum of squared residuals.
struct ToneLine {
    gain: f64,
    offset: f64,
    error: f64,
}

impl Pairs {
    /// Collects the pixels that count. Pixels that are clipped in either picture carry no
    /// information on the curve, and are omitted if more than a quarter of the pixels remain.
    fn of(new: &Plane, old: &Plane, mask: &Mask) -> Self {
        let all = mask
            .kept(old)
            .map(f64::from)
            .zip(mask.kept(new).map(f64::from));
        let all: Vec<(f64, f64)> = all.collect();
        let clipped = |v: f64| !(0.6 / 255.0..=254.4 / 255.0).contains(&v);
        let inside: Vec<(f64, f64)> = all
            .iter()
            .copied()
            .filter(|(a, b)| !clipped(*a) && !clipped(*b))
            .collect();
        Self(if 4 * inside.len() > all.len() {
            inside
        } else {
            all
        })
    }

    /// Fits a curve by iteratively reweighted least squares, with a search for gamma.
    fn fit(&self) -> Tone {
        let values: Vec<f64> = self.0.iter().map(|p| p.0.max(0.0)).collect();
        let spread = values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - values.iter().copied().fold(f64::INFINITY, f64::min);
        if !(spread > 1e-3) {
            return Tone::IDENTITY; // A flat picture does not determine a curve.
        }
        if self.0.iter().all(|(x, y)| x == y) {
            return Tone::IDENTITY; // A fit would leave a rounding error.
        }
        let mut weights = vec![1.0; self.0.len()];
        let mut tone = Tone::IDENTITY;
        for _ in 0..3 {
            let at = |ln_gamma: f64| self.line(libm::exp(ln_gamma), &weights);
            let ln_gamma = golden(-1.6, 1.6, |g| at(g).error);
            let line = at(ln_gamma);
            tone = Tone {
                gain: line.gain,
                offset: line.offset,
                gamma: libm::exp(ln_gamma),
            };
            self.reweigh(tone, &mut weights);
        }
        // A curve that makes a negative is rejected.
        if tone.gain > 0.0 {
            tone
        } else {
            Tone::IDENTITY
        }
    }

    /// Returns the weighted least-squares line of new levels on oldᵞ.
    fn line(&self, gamma: f64, weights: &[f64]) -> ToneLine {
        let mut s = [0.0; 6]; // w, x, y, xx, xy, yy
        for (&(x, y), w) in self.0.iter().zip(weights) {
            let x = libm::pow(x.max(0.0), gamma);
            let terms = [1.0, x, y, x * x, x * y, y * y];
            s.iter_mut().zip(terms).for_each(|(s, t)| *s += w * t);
        }
        let [n, x, y, xx, xy, yy] = s;
        let (vx, vy, c) = (xx - x * x / n, yy - y * y / n, xy - x * y / n);
        let gain = if vx > 0.0 { c / vx } else { 0.0 };
        ToneLine {
            gain,
            offset: (y - gain * x) / n,
            error: vy - gain * c,
        }
    }

    /// Computes Tukey's biweights (4.685 standard deviations), so that pixels that show something
    /// else do not affect the next fit.
    fn reweigh(&self, tone: Tone, weights: &mut [f64]) {
        let off = |&(x, y): &(f64, f64)| {
            let curved = libm::pow(x.max(0.0), tone.gamma);
            (tone.offset + tone.gain * curved - y).abs()
        };
        let offs: Vec<f64> = self.0.iter().map(off).collect();
        let mut sorted = offs.clone();
        sorted.sort_by(f64::total_cmp);
        let scale = 1.4826 * sorted[sorted.len() / 2];
        let width = 4.685 * scale.max(1e-4);
        for (w, r) in weights.iter_mut().zip(offs) {
            let t = r / width;
            *w = if t < 1.0 {
                (1.0 - t * t) * (1.0 - t * t)
            } else {
                0.0
            };
        }
    }
}

/// Returns the minimum of a unimodal function by golden-section search.
fn golden(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let mut inner = [high - RATIO * (high - low), low + RATIO * (high - low)];
    let mut at = inner.map(&f);
    while high - low > 1e-5 {
        if at[0] < at[1] {
            high = inner[1];
            inner = [high - RATIO * (high - low), inner[0]];
            at = [f(inner[0]), at[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + RATIO * (high - low)];
            at = [at[1], f(inner[1])];
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_curve_is_found_although_a_tenth_of_the_picture_shows_something_else() {
        let truth = Tone {
            gain: 0.85,
            offset: 0.04,
            gamma: 1.8,
        };
        let old = Plane::from_fn(60, 40, |x, y| ((x * 37 + y * 101) % 97) as f32 / 97.0);
        let new = Plane::from_fn(60, 40, |x, y| {
            if x < 6 {
                0.9
            } else {
                truth.apply(old.at(x, y))
            }
        });
        let plates = [new, old].map(|p| Plate::from_planes([p.clone(), p.clone(), p]));
        let mask = Mask::all(60, 40);
        let tone = fit(&plates[0], &plates[1], &mask, Matching::Channel)[1];
        assert!((tone.gain - truth.gain).abs() < 1e-3, "{tone:?}");
        assert!((tone.offset - truth.offset).abs() < 1e-3, "{tone:?}");
        assert!((tone.gamma - truth.gamma).abs() < 3e-3, "{tone:?}");
    }

    #[test]
    fn a_flat_picture_is_not_changed() {
        let flat = Plane::from_fn(8, 8, |_, _| 0.5);
        let plate = Plate::from_planes([flat.clone(), flat.clone(), flat]);
        let tones = fit(&plate, &plate, &Mask::all(8, 8), Matching::Picture);
        assert_eq!(tones, [Tone::IDENTITY; 3]);
    }
}
