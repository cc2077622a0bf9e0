//! Hero sets of wavelengths, and the matrices that convert colors to spectra and back.

use glam::{DMat3, DVec3};

/// The number of wavelengths of a sample.
pub const HERO: usize = 4;
/// The wavelength of a set that represents all.
pub const MAIN: usize = 2;
/// The wavelengths of a set except the main one.
pub const OTHERS: [usize; HERO - 1] = [0, 1, 3];
/// The number of hero sets. A sample uses one.
pub const SETS: usize = 8;

/// A wavelength of a hero set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralLine {
    /// The wavelength in nanometers.
    pub nm: f64,
    /// The matrix from a radiance in linear RGB to what it adds to the film at this wavelength.
    pub color: DMat3,
}

/// The first wavelength of sums over the spectrum, in nanometers.
const FIRST: i32 = 380;
/// The last wavelength of sums over the spectrum, in nanometers.
const LAST: i32 = 780;

/// The matrix from XYZ to linear sRGB (IEC 61966-2-1).
pub const RGB_FROM_XYZ: DMat3 = DMat3::from_cols_array(&[
    3.2406, -0.9689, 0.0557, -1.5372, 1.8758, -0.2040, -0.4986, 0.0415, 1.0570,
]);

/// CIE standard illuminant D65 from 380 to 780 nm, every 10 nm (CIE 15).
const D65: [f64; 41] = [
    49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81,
    109.35, 107.80, 104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60,
    87.70, 83.29, 83.70, 80.03, 80.21, 82.28, 78.28, 69.72, 71.61, 74.35, 61.60, 69.89, 75.09,
    63.59, 46.42, 66.81, 63.38,
];

/// A Gaussian with different standard deviations below and above its middle.
fn bump(nm: f64, middle: f64, below: f64, above: f64) -> f64 {
    let t = (nm - middle) / if nm < middle { below } else { above };
    libm::exp(-0.5 * t * t)
}

/// The CIE 1931 color matching functions x̄, ȳ, z̄ at a wavelength in nanometers, by the fit of
/// Wyman, Sloan and Shirley (2013).
pub(crate) fn matching(nm: f64) -> DVec3 {
    DVec3::new(
        1.056 * bump(nm, 599.8, 37.9, 31.0) + 0.362 * bump(nm, 442.0, 16.0, 26.7)
            - 0.065 * bump(nm, 501.1, 20.4, 26.2),
        0.821 * bump(nm, 568.8, 46.9, 40.5) + 0.286 * bump(nm, 530.9, 16.3, 31.1),
        1.217 * bump(nm, 437.0, 11.8, 36.0) + 0.681 * bump(nm, 459.0, 26.0, 13.8),
    )
}

/// The relative power of D65 at a wavelength in nanometers, interpolated linearly.
pub(crate) fn daylight(nm: f64) -> f64 {
    let place = ((nm - f64::from(FIRST)) / 10.0).clamp(0.0, 40.0);
    let i = (place as usize).min(39);
    D65[i] + (place - i as f64) * (D65[i + 1] - D65[i])
}

/// The shares of the red, green and blue bands at a wavelength in nanometers. Their sum is 1.
fn bands(nm: f64) -> DVec3 {
    let above = |edge: f64| 1.0 / (1.0 + libm::exp((edge - nm) / 6.0));
    let (red, blue) = (above(590.0), 1.0 - above(490.0));
    DVec3::new(red, 1.0 - red - blue, blue)
}

/// The wavelengths of sums over the spectrum, in nanometers.
fn range() -> impl Iterator<Item = f64> {
    (FIRST..=LAST).map(f64::from)
}

/// The outer product of the column `a` and the row `b`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The spectra of colors, and the response to them that returns the same colors.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// The factors that make the linear RGB of D65 exactly 1.
    white: DVec3,
    /// The matrix from bands to basis functions.
    mix: DMat3,
}

impl Default for Spectrum {
    fn default() -> Self {
        let response = |nm: f64| RGB_FROM_XYZ * matching(nm) * daylight(nm);
        let white = range().map(response).sum::<DVec3>().recip();
        let color_of_bands: DMat3 = range()
            .map(|nm| outer(response(nm) * white, bands(nm)))
            .fold(DMat3::ZERO, |sum, m| sum + m);
        Self {
            white,
            mix: color_of_bands.inverse().transpose(),
        }
    }
}

impl Spectrum {
    /// The basis functions at a wavelength: the spectra of red, green and blue of strength 1,
    /// relative to daylight.
    pub(crate) fn basis(&self, nm: f64) -> DVec3 {
        self.mix * bands(nm)
    }

    /// The linear RGB of daylight in 1 nm around a wavelength. The sum over all wavelengths is
    /// white.
    pub fn response(&self, nm: f64) -> DVec3 {
        RGB_FROM_XYZ * matching(nm) * daylight(nm) * self.white
    }

    /// The matrix from a color to what it adds to the film in 1 nm around a wavelength.
    pub fn color(&self, nm: f64) -> DMat3 {
        outer(self.response(nm), self.basis(nm))
    }

    /// The matrices of [`Self::color`] for all wavelengths, in nanometers. Their sum is the
    /// identity.
    pub fn colors(&self) -> impl Iterator<Item = (f64, DMat3)> {
        range().map(|nm| (nm, self.color(nm)))
    }

    /// The hero sets. The wavelengths of a set are a quarter of the spectrum apart, where the
    /// spectrum is measured by `weight`, and each set is shifted by a step.
    ///
    /// The difference between the identity and the sum of a set's matrices, at most 0.15 of the
    /// identity, is added to them in equal parts. The mean of that over all sets is less than
    /// 0.005, so the colors of a spectrum are those of the matching functions.
    pub fn hero_sets(&self) -> [[SpectralLine; HERO]; SETS] {
        let total: f64 = range().map(weight).sum();
        std::array::from_fn(|set| {
            let mut lines = std::array::from_fn(|i| {
                let share = (i as f64 + (set as f64 + 0.5) / SETS as f64) / HERO as f64;
                let nm = wavelength_at(share * total);
                let density = HERO as f64 * weight(nm) / total;
                SpectralLine {
                    nm,
                    color: self.color(nm) * density.recip(),
                }
            });
            let sum = lines.iter().fold(DMat3::ZERO, |sum, l| sum + l.color);
            let missing = (DMat3::IDENTITY - sum) * (HERO as f64).recip();
            lines.iter_mut().for_each(|l| l.color += missing);
            lines
        })
    }
}

/// The density with which a wavelength is sampled, not normalized. It has three peaks near the
/// largest entries of [`Spectrum::color`]. Their parameters were chosen so that the matrices of any
/// four wavelengths a quarter apart have a sum that is as near as possible to the identity.
fn weight(nm: f64) -> f64 {
    1.34 * bump(nm, 449.0, 27.0, 27.0)
        + bump(nm, 530.0, 36.0, 36.0)
        + 1.16 * bump(nm, 610.0, 37.0, 37.0)
}

/// The wavelength in nanometers below which the weights have a given sum.
fn wavelength_at(sum: f64) -> f64 {
    let mut below = 0.0;
    for nm in range() {
        let here = weight(nm);
        if below + here >= sum {
            return nm - 0.5 + (sum - below) / here;
        }
        below += here;
    }
    f64::from(LAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn farthest(m: DMat3) -> f64 {
        let off = m - DMat3::IDENTITY;
        off.to_cols_array().iter().fold(0.0, |a, b| a.max(b.abs()))
    }

    /// CIE 15: x = 0.31272, y = 0.32903 for D65.
    #[test]
    fn daylight_has_the_published_chromaticity() {
        let sum: DVec3 = range().map(|nm| matching(nm) * daylight(nm)).sum();
        let xyz = sum / sum.element_sum();
        assert!(
            (xyz.x - 0.31272).abs() < 2e-4 && (xyz.y - 0.32903).abs() < 2e-4,
            "{xyz}"
        );
    }

    /// In the tables of 1931 ȳ is 1 at 555 nm, x̄ is 1.0622 at 600 nm, and z̄ is 1.7826 at 445 nm.
    #[test]
    fn the_fit_has_the_peaks_of_the_tables() {
        for (nm, channel, tabulated) in [(600.0, 0, 1.0622), (555.0, 1, 1.0), (445.0, 2, 1.7826)] {
            let fit = matching(nm)[channel];
            assert!((fit / tabulated - 1.0).abs() < 0.02, "{nm}: {fit}");
        }
    }

    #[test]
    fn every_color_comes_back_over_the_whole_spectrum() {
        let spectrum = Spectrum::default();
        let sum = range().fold(DMat3::ZERO, |sum, nm| sum + spectrum.color(nm));
        assert!(farthest(sum) < 1e-13, "{sum}");
    }

    #[test]
    fn the_spectra_of_colors_are_not_negative_and_that_of_white_is_daylight() {
        let spectrum = Spectrum::default();
        for nm in range() {
            let basis = spectrum.basis(nm);
            assert!(basis.min_element() > -0.005, "{nm}: {basis}");
            assert!((basis.element_sum() - 1.0).abs() < 1e-12, "{nm}: {basis}");
        }
    }

    #[test]
    fn every_hero_set_by_itself_returns_every_color() {
        let sets = Spectrum::default().hero_sets();
        for lines in &sets {
            let sum = lines.iter().fold(DMat3::ZERO, |sum, l| sum + l.color);
            assert!(farthest(sum) < 1e-15, "{sum}");
            assert!(lines.is_sorted_by(|a, b| a.nm + 20.0 < b.nm));
        }
        let all = sets.iter().flatten().map(|l| l.nm);
        assert!(all.clone().all(|nm| (400.0..700.0).contains(&nm)));
    }

    /// All sets together are a quadrature of the matching functions: the corrections that make each
    /// set exact cancel.
    #[test]
    fn the_corrections_of_the_sets_are_small_and_cancel() {
        let spectrum = Spectrum::default();
        let total: f64 = range().map(weight).sum();
        let mut mean = DMat3::ZERO;
        for lines in spectrum.hero_sets() {
            let true_color =
                |l: &SpectralLine| spectrum.color(l.nm) * (total / (HERO as f64 * weight(l.nm)));
            let sum = lines.iter().fold(DMat3::ZERO, |sum, l| sum + true_color(l));
            assert!(farthest(sum) < 0.15, "{sum}");
            mean += sum * (SETS as f64).recip();
        }
        assert!(farthest(mean) < 0.005, "{mean}");
    }
}
