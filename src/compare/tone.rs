//! Matches the tones of one picture to another's: gain, offset and gamma.
//!
//! An archival picture was scanned, printed or converted by unknown hands; its levels are taken
//! to be `offset + gain·levelᵞ` of what they should be.

use serde::Serialize;

use super::metric::Mask;
use super::plane::{Plane, Plate};

/// `offset + gain·levelᵞ`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tone {
    pub gain: f64,
    pub offset: f64,
    pub gamma: f64,
}

/// Whether to match tones, and in how many curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matching {
    None,
    /// One curve for the picture.
    Picture,
    /// One curve for each of red, green and blue.
    Channel,
}

impl Tone {
    pub const IDENTITY: Self = Self {
        gain: 1.0,
        offset: 0.0,
        gamma: 1.0,
    };

    pub(crate) fn apply(self, level: f32) -> f32 {
        if self == Self::IDENTITY {
            return level;
        }
        let curved = libm::pow(f64::from(level.max(0.0)), self.gamma);
        (self.offset + self.gain * curved) as f32
    }
}

/// The curves that bring `old` nearest to `new`, one for each channel.
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

/// Levels of the same pixels, (old, new).
struct Pairs(Vec<(f64, f64)>);

/// The plain least-squares line of a set of pairs, and what it leaves.
struct Line {
    gain: f64,
    offset: f64,
    error: f64,
}

impl Pairs {
    /// Pixels clipped in either picture say nothing about the curve, and are left out while
    /// enough others are there.
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

    fn fit(&self) -> Tone {
        let values: Vec<f64> = self.0.iter().map(|p| p.0.max(0.0)).collect();
        let spread = values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - values.iter().copied().fold(f64::INFINITY, f64::min);
        if !(spread > 1e-3) {
            return Tone::IDENTITY; // a flat picture has no curve
        }
        if self.0.iter().all(|(x, y)| x == y) {
            return Tone::IDENTITY; // exactly, where a fit would leave a rounding error
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
        // A picture turned to its negative is not the same picture.
        if tone.gain > 0.0 {
            tone
        } else {
            Tone::IDENTITY
        }
    }

    /// Least squares of new on oldᵞ.
    fn line(&self, gamma: f64, weights: &[f64]) -> Line {
        let mut s = [0.0; 6]; // w, x, y, xx, xy, yy
        for (&(x, y), w) in self.0.iter().zip(weights) {
            let x = libm::pow(x.max(0.0), gamma);
            let terms = [1.0, x, y, x * x, x * y, y * y];
            s.iter_mut().zip(terms).for_each(|(s, t)| *s += w * t);
        }
        let [n, x, y, xx, xy, yy] = s;
        let (vx, vy, c) = (xx - x * x / n, yy - y * y / n, xy - x * y / n);
        let gain = if vx > 0.0 { c / vx } else { 0.0 };
        Line {
            gain,
            offset: (y - gain * x) / n,
            error: vy - gain * c,
        }
    }

    /// Tukey's weights: pixels that show something else are left out of the next fit.
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

/// The least point of a function with one valley, by golden sections.
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
    fn a_known_curve_comes_back_although_a_tenth_of_the_picture_shows_something_else() {
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
    fn a_flat_picture_is_left_as_it_is() {
        let flat = Plane::from_fn(8, 8, |_, _| 0.5);
        let plate = Plate::from_planes([flat.clone(), flat.clone(), flat]);
        let tones = fit(&plate, &plate, &Mask::all(8, 8), Matching::Picture);
        assert_eq!(tones, [Tone::IDENTITY; 3]);
    }
}
