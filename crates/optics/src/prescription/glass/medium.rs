//! Optical media and their refractive indices.
//!
//! Indices are relative to air, as in prescriptions and glass catalogues. Wavelengths are in
//! nanometers, except in the dispersion formulas, which use micrometers.

use ivcam_base::math::lagrange_weight;

/// The Fraunhofer F line of hydrogen, in nanometers.
pub const F_LINE: f64 = 486.1327;
/// The d line of helium, the wavelength of every `n_d`, in nanometers.
pub const D_LINE: f64 = 587.5618;
/// The Fraunhofer C line of hydrogen, in nanometers.
pub const C_LINE: f64 = 656.2725;

/// The exact wavelength of a spectral line for a rounded one: 587.6 is the d line. Other
/// wavelengths are rounded to 1e-6 nm, which takes the digits away that conversion from micrometers
/// adds.
///
/// Wavelengths with four digits are rounded by up to 0.05 nm. Within that an index differs by 1e-6,
/// which is more than the error of the other arithmetic.
pub fn named_line(wavelength_nm: f64) -> f64 {
    [F_LINE, D_LINE, C_LINE]
        .into_iter()
        .find(|line| (wavelength_nm - line).abs() < 0.05)
        .unwrap_or((1e6 * wavelength_nm).round() / 1e6)
}

/// The name of a spectral line, `d` for 587.56 nm, or the wavelength with its unit.
pub fn line_name(wavelength_nm: f64) -> String {
    let lines = [(F_LINE, "F"), (D_LINE, "d"), (C_LINE, "C")];
    match lines.iter().find(|(nm, _)| *nm == wavelength_nm) {
        Some((_, name)) => (*name).to_owned(),
        None => format!("{wavelength_nm:.0} nm"),
    }
}

/// The dependence of an index on the wavelength λ, in micrometers.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Dispersion {
    /// A constant index: only `n_d` is known.
    None,
    /// n = a + b/λ², determined by `n_d` and the Abbe number.
    Cauchy {
        /// The constant term.
        a: f64,
        /// The coefficient of 1/λ².
        b: f64,
    },
    /// n = a + b/λ² + c/λ⁴, determined by the indices at the F, d and C lines.
    ThreeLines {
        /// The index at the F line.
        n_f: f64,
        /// The index at the C line.
        n_c: f64,
        /// The constant term.
        a: f64,
        /// The coefficient of 1/λ².
        b: f64,
        /// The coefficient of 1/λ⁴.
        c: f64,
    },
    /// The indices at stated wavelengths, and a cubic between them.
    Table {
        /// The wavelengths in nanometers, the shortest first, each with its index.
        lines: Box<[(f64, f64)]>,
    },
    /// A formula of a glass catalogue.
    Catalogue {
        /// The formula.
        formula: Formula,
        /// The coefficients in the order of the catalogue.
        coefficients: [f64; 10],
    },
    /// n = n_d + s (m − m_d), where m is the index of another glass.
    Scaled {
        /// The other glass.
        glass: Box<Medium>,
        /// The factor s.
        scale: f64,
    },
}

/// The dispersion formulas of `.agf` catalogues, numbered from 1 as there.
///
/// k0, k1, … are the coefficients; the wavelength λ is in micrometers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Formula {
    /// n² = k0 + k1 λ² + k2/λ² + k3/λ⁴ + k4/λ⁶ + k5/λ⁸.
    Schott = 1,
    /// n² = 1 + k0 λ²/(λ² − k1) + …, three such terms.
    Sellmeier1,
    /// n = k0 + k1 L + k2 L² + k3 λ² + k4 λ⁴ + k5 λ⁶, where L = 1/(λ² − 0.028).
    Herzberger,
    /// n² = 1 + k0 + k1 λ²/(λ² − k2²) + k3/(λ² − k4²).
    Sellmeier2,
    /// n = k0 + k1/λ + k2/λ^3.5.
    Conrady,
    /// n² = 1 + k0 λ²/(λ² − k1) + …, four such terms.
    Sellmeier3,
    /// n² = k0 + k1/(λ² − k2) − k3 λ².
    Handbook1,
    /// n² = k0 + k1 λ²/(λ² − k2) − k3 λ².
    Handbook2,
    /// n² = k0 + k1 λ²/(λ² − k2) + k3 λ²/(λ² − k4).
    Sellmeier4,
    /// n² = k0 + k1 λ² + k2/λ² + k3/λ⁴ + … + k7/λ¹².
    Extended,
    /// n² = 1 + k0 λ²/(λ² − k1) + …, five such terms.
    Sellmeier5,
    /// n² = k0 + k1 λ² + k2/λ² + k3/λ⁴ + k4/λ⁶ + k5/λ⁸ + k6 λ⁴ + k7 λ⁶.
    Extended2,
    /// n² = k0 + k1 λ² + k2 λ⁴ + k3/λ² + k4/λ⁴ + … + k8/λ¹².
    Extended3,
}

impl Formula {
    /// The formula with a number in `.agf` catalogues.
    pub(crate) fn from_number(number: u32) -> Option<Self> {
        use Formula::*;
        [
            Schott, Sellmeier1, Herzberger, Sellmeier2, Conrady, Sellmeier3, Handbook1, Handbook2,
            Sellmeier4, Extended, Sellmeier5, Extended2, Extended3,
        ]
        .into_iter()
        .find(|f| *f as u32 == number)
    }

    /// The wavelength in nanometers of the index that a glass has as its `n_d`: the d line, or for
    /// a glass that is opaque there the first of some in the infrared at which the formula has an
    /// index.
    fn nominal_nm(self, coefficients: &[f64; 10]) -> Option<f64> {
        // Where a glass is opaque its formula may have any value.
        let index = |nm: f64| self.index(coefficients, nm * 1e-3);
        let [f, d, c] = [F_LINE, D_LINE, C_LINE].map(index);
        let is_visible = (1.0..3.0).contains(&d) && f >= d && d >= c;
        let has_index = |nm: &f64| (1.0..10.0).contains(&index(*nm));
        let infrared = || INFRARED.into_iter().find(has_index);
        is_visible.then_some(D_LINE).or_else(infrared)
    }

    /// The index at a wavelength in micrometers; NaN where the formula has no real value.
    pub(crate) fn index(self, k: &[f64; 10], um: f64) -> f64 {
        let l2 = um * um;
        let terms = |count: usize| -> f64 {
            1.0 + (0..count)
                .map(|i| k[2 * i] * l2 / (l2 - k[2 * i + 1]))
                .sum::<f64>()
        };
        // A polynomial in 1/λ² whose coefficient of λ⁻² is the first.
        let falling = |k: &[f64]| k.iter().rev().fold(0.0, |sum, &c| (sum + c) / l2);
        let squared = match self {
            Self::Schott => k[0] + k[1] * l2 + falling(&k[2..6]),
            Self::Sellmeier1 => terms(3),
            Self::Sellmeier2 => {
                1.0 + k[0] + k[1] * l2 / (l2 - k[2] * k[2]) + k[3] / (l2 - k[4] * k[4])
            }
            Self::Sellmeier3 => terms(4),
            Self::Sellmeier4 => k[0] + k[1] * l2 / (l2 - k[2]) + k[3] * l2 / (l2 - k[4]),
            Self::Sellmeier5 => terms(5),
            Self::Handbook1 => k[0] + k[1] / (l2 - k[2]) - k[3] * l2,
            Self::Handbook2 => k[0] + k[1] * l2 / (l2 - k[2]) - k[3] * l2,
            Self::Extended => k[0] + k[1] * l2 + falling(&k[2..8]),
            Self::Extended2 => k[0] + k[1] * l2 + falling(&k[2..6]) + (k[6] + k[7] * l2) * l2 * l2,
            Self::Extended3 => k[0] + (k[1] + k[2] * l2) * l2 + falling(&k[3..9]),
            Self::Herzberger => {
                let l = 1.0 / (l2 - 0.028);
                return k[0] + (k[1] + k[2] * l) * l + (k[3] + (k[4] + k[5] * l2) * l2) * l2;
            }
            Self::Conrady => return k[0] + k[1] / um + k[2] / libm::pow(um, 3.5),
        };
        squared.sqrt()
    }
}

/// The wavelengths, in nanometers, at which a glass that is opaque at the d line gets its index.
const INFRARED: [f64; 3] = [4000.0, 10_000.0, 1500.0];

/// The index at a wavelength by a table, the shortest wavelength first: the polynomial in 1/λ²
/// through the two lines on either side, or the last four at an end, or all of a shorter table.
///
/// For a flint and wavelengths that are 100 nm apart, the error of linear interpolation is 3e-4,
/// and that of the cubic is 1e-6.
pub(crate) fn tabulated(lines: &[(f64, f64)], nm: f64) -> f64 {
    let behind = lines.partition_point(|(at, _)| *at < nm);
    if let Some((_, n)) = lines.get(behind).filter(|(at, _)| *at == nm) {
        return *n;
    }
    let count = lines.len().min(4);
    let from = behind.saturating_sub(2).min(lines.len() - count);
    let near = &lines[from..from + count];
    let x = |nm: f64| 1.0 / (nm * nm);
    let mut at = [0.0; 4];
    for (at, (nm, _)) in at.iter_mut().zip(near) {
        *at = x(*nm);
    }
    let weight = |k: usize| lagrange_weight(&at[..count], k, x(nm));
    let terms = near.iter().enumerate().map(|(k, (_, n))| weight(k) * n);
    terms.sum()
}

/// A medium: its name if it has one, its index at the d line, and its dispersion.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// The name of a glass in its catalogue; empty if a file gives only numbers.
    pub name: String,
    /// The index at the d line; of a glass that is opaque there, the index in the infrared.
    pub n_d: f64,
    /// The name in the file, if the table does not have it and another glass takes its place.
    pub stands_for: Option<Box<str>>,
    /// The shortest and the longest wavelength, in nanometers, at which the index was measured that
    /// a formula has, if they are known.
    pub measured_nm: Option<[f64; 2]>,
    /// The dependence of the index on the wavelength.
    pub dispersion: Dispersion,
}

impl Medium {
    /// Air, whose index is 1.
    pub fn air() -> Self {
        Self::constant(1.0)
    }

    /// A medium of which only the index at the d line is known.
    pub fn constant(n_d: f64) -> Self {
        Self {
            name: String::new(),
            n_d,
            stands_for: None,
            measured_nm: None,
            dispersion: Dispersion::None,
        }
    }

    /// A glass by index and Abbe number, with the two-term Cauchy formula through both.
    pub fn from_abbe(n_d: f64, abbe: f64) -> Self {
        let [f, d, c] = [F_LINE, D_LINE, C_LINE].map(|nm| 1e6 / (nm * nm));
        let b = (n_d - 1.0) / (abbe * (f - c));
        let dispersion = if b.is_finite() && b != 0.0 {
            Dispersion::Cauchy { a: n_d - b * d, b }
        } else {
            Dispersion::None
        };
        Self {
            dispersion,
            ..Self::constant(n_d)
        }
    }

    /// A medium by its index at the d line and its Abbe number. Without one that is greater than 0
    /// it has no dispersion.
    pub(crate) fn from_index(n_d: f64, abbe: Option<f64>) -> Self {
        match abbe {
            Some(abbe) if abbe > 0.0 => Self::from_abbe(n_d, abbe),
            _ => Self::constant(n_d),
        }
    }

    /// A glass by its indices at the F, d and C lines.
    pub(crate) fn from_lines(n_f: f64, n_d: f64, n_c: f64) -> Self {
        let [f, d, c] = [F_LINE, D_LINE, C_LINE].map(|nm| 1e6 / (nm * nm));
        // Newton's divided differences in x = 1/λ².
        let fd = (n_f - n_d) / (f - d);
        let dc = (n_d - n_c) / (d - c);
        let quadratic = (fd - dc) / (f - c);
        let b = dc - quadratic * (d + c);
        let dispersion = Dispersion::ThreeLines {
            n_f,
            n_c,
            a: n_d - (b + quadratic * d) * d,
            b,
            c: quadratic,
        };
        Self {
            dispersion,
            ..Self::constant(n_d)
        }
    }

    /// A glass by a catalogue's formula; none if the formula has no index at the d line or at the
    /// first of some wavelengths in the infrared.
    pub(crate) fn from_formula(formula: Formula, coefficients: [f64; 10]) -> Option<Self> {
        let nm = formula.nominal_nm(&coefficients)?;
        let n_d = formula.index(&coefficients, nm * 1e-3);
        let dispersion = Dispersion::Catalogue {
            formula,
            coefficients,
        };
        Some(Self {
            dispersion,
            ..Self::constant(n_d)
        })
    }

    /// A glass by its indices at wavelengths in nanometers, the shortest first, with its index at
    /// the d line.
    pub(crate) fn from_table(n_d: f64, lines: impl Into<Box<[(f64, f64)]>>) -> Self {
        Self {
            dispersion: Dispersion::Table {
                lines: lines.into(),
            },
            ..Self::constant(n_d)
        }
    }

    /// A glass by its indices at wavelengths in nanometers, the shortest first, none of which is at
    /// or near the d line: its `n_d` is its index in the infrared, or that of the nearest
    /// wavelength.
    pub(crate) fn from_distant_table(lines: &[(f64, f64)]) -> Option<Self> {
        let (first, last) = (lines.first()?, lines.last()?);
        let reaches = |nm: &f64| (first.0..=last.0).contains(nm);
        let nearest = if first.0 > D_LINE { first } else { last };
        let nm = INFRARED.into_iter().find(reaches).unwrap_or(nearest.0);
        Some(Self::from_table(tabulated(lines, nm), lines))
    }

    /// The wavelength in nanometers of the index `n_d`: the d line, or one in the infrared of a
    /// glass that is opaque there.
    pub(crate) fn nominal_nm(&self) -> f64 {
        let stated = match &self.dispersion {
            Dispersion::Catalogue {
                formula,
                coefficients,
            } => formula.nominal_nm(coefficients),
            Dispersion::Scaled { glass, .. } => Some(glass.nominal_nm()),
            _ => None,
        };
        stated.unwrap_or(D_LINE)
    }

    /// The medium with another index `n_d` and the same Abbe number: n − 1 changes by the same
    /// factor at each wavelength.
    pub(crate) fn with_n_d(&self, n_d: f64) -> Self {
        self.scaled(n_d, (n_d - 1.0) / (self.n_d - 1.0))
    }

    /// The medium with another Abbe number and the same `n_d`: n − n_d changes by the same factor
    /// at each wavelength. None of a glass that is opaque in the visible.
    pub(crate) fn with_abbe(&self, abbe: f64) -> Option<Self> {
        if self.doubt_at(D_LINE).is_some() {
            return None;
        }
        Some(match self.abbe() {
            Some(known) => self.scaled(self.n_d, known / abbe),
            None => Self::from_abbe(self.n_d, abbe),
        })
    }

    /// The medium with another `n_d`, and with n − n_d multiplied at each wavelength.
    fn scaled(&self, n_d: f64, factor: f64) -> Self {
        let dispersion = match &self.dispersion {
            // An index of 1 has no dispersion to keep.
            _ if !factor.is_finite() => Dispersion::None,
            Dispersion::None => Dispersion::None,
            Dispersion::Cauchy { a, b } => Dispersion::Cauchy {
                a: n_d + factor * (a - self.n_d),
                b: factor * b,
            },
            Dispersion::Scaled { glass, scale } => Dispersion::Scaled {
                glass: glass.clone(),
                scale: scale * factor,
            },
            _ => Dispersion::Scaled {
                glass: Box::new(self.clone()),
                scale: factor,
            },
        };
        Self {
            dispersion,
            ..Self::constant(n_d)
        }
    }

    /// Why the index at a wavelength in nanometers is not to be relied on, if it is not: it lies
    /// beyond the stated or measured ones, or a formula has a value there that no glass has.
    pub(crate) fn doubt_at(&self, nm: f64) -> Option<String> {
        if let Dispersion::Scaled { glass, .. } = &self.dispersion {
            return glass.doubt_at(nm);
        }
        if let Some([low, high]) = self.stated_range() {
            // Nominal wavelengths are rounded.
            return (!(low - 1.0..=high + 1.0).contains(&nm)).then(|| {
                format!(
                    "the index of a glass at {nm:.0} nm is extrapolated from those at {low:.0} to \
                     {high:.0} nm"
                )
            });
        }
        let Dispersion::Catalogue {
            formula,
            coefficients,
        } = &self.dispersion
        else {
            return None;
        };
        let index = formula.index(coefficients, nm * 1e-3);
        // Where a glass is clear, its index falls with the wavelength, and by less than this: that
        // of calcium fluoride has 0.75 of its n_d - 1 at 9 µm, that of SF57 1.13 at 365 nm.
        let share = (index - 1.0) / (self.n_d - 1.0);
        let is_clear = match nm < self.nominal_nm() {
            true => (1.0 - 1e-9..1.4).contains(&share),
            false => (0.7..1.0 + 1e-9).contains(&share),
        };
        (!is_clear).then(|| {
            format!(
                "the formula of the glass `{}` is not valid at {nm:.0} nm: its index there is \
                 {index:.3}",
                self.name
            )
        })
    }

    /// The shortest and the longest wavelength, in nanometers, at which the index is stated or was
    /// measured; none if that is not known.
    fn stated_range(&self) -> Option<[f64; 2]> {
        match &self.dispersion {
            Dispersion::ThreeLines { .. } => Some([F_LINE, C_LINE]),
            Dispersion::Table { lines } => Some([lines.first()?.0, lines.last()?.0]),
            Dispersion::Catalogue { .. } => self.measured_nm,
            _ => None,
        }
    }

    /// The medium with a name.
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// The index at a wavelength in nanometers. A wavelength within 0.05 nm of the F, d or C line
    /// is that line. Where a formula has no real value, or one that is not between 0.5 and 100, the
    /// index is that at the d line.
    pub fn index(&self, wavelength_nm: f64) -> f64 {
        let nm = named_line(wavelength_nm);
        if nm == D_LINE {
            return self.n_d;
        }
        let um = nm * 1e-3;
        let x = 1.0 / (um * um);
        let n = match &self.dispersion {
            Dispersion::None => self.n_d,
            Dispersion::Cauchy { a, b } => a + b * x,
            Dispersion::ThreeLines { n_f, .. } if nm == F_LINE => *n_f,
            Dispersion::ThreeLines { n_c, .. } if nm == C_LINE => *n_c,
            Dispersion::ThreeLines { a, b, c, .. } => a + (b + c * x) * x,
            Dispersion::Table { lines } => tabulated(lines, nm),
            Dispersion::Catalogue {
                formula,
                coefficients,
            } => formula.index(coefficients, um),
            Dispersion::Scaled { glass, scale } => self.n_d + scale * (glass.index(nm) - glass.n_d),
        };
        if n > 0.5 && n < 100.0 { n } else { self.n_d }
    }

    /// Whether the index depends on the wavelength.
    pub(crate) fn is_dispersive(&self) -> bool {
        self.dispersion != Dispersion::None
    }

    /// The Abbe number (n_d − 1)/(n_F − n_C); none without dispersion.
    pub fn abbe(&self) -> Option<f64> {
        let spread = self.index(F_LINE) - self.index(C_LINE);
        (self.is_dispersive() && spread != 0.0).then(|| (self.n_d - 1.0) / spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glass_by_abbe_number_has_that_abbe_number() {
        let glass = Medium::from_abbe(1.5168, 64.17);
        assert_eq!(glass.index(587.6), 1.5168);
        assert!((glass.abbe().unwrap() - 64.17).abs() < 1e-10);
    }

    /// The data sheet of N-BK7 gives n_F = 1.52238, n_d = 1.51680, n_C = 1.51432 to five places.
    #[test]
    fn sellmeier_gives_the_published_indices_of_bk7() {
        let k = [
            1.03961212,
            0.00600069867,
            0.231792344,
            0.0200179144,
            1.01046945,
            103.560653,
            0.0,
            0.0,
            0.0,
            0.0,
        ];
        let glass = Medium::from_formula(Formula::Sellmeier1, k).unwrap();
        for (line, n) in [(F_LINE, 1.52238), (D_LINE, 1.51680), (C_LINE, 1.51432)] {
            assert!(
                (glass.index(line) - n).abs() < 5e-6,
                "{line}: {}",
                glass.index(line)
            );
        }
    }

    /// Each formula with published coefficients and a published index. Where a formula is not
    /// used by any well-known material its coefficients are those of one that is, rewritten:
    /// b λ²/(λ² − c) = b + b c/(λ² − c).
    #[test]
    fn every_formula_gives_a_published_index() {
        use Formula::*;
        const BK7: [f64; 6] = [
            1.039_612_12,
            0.006_000_698_67,
            0.231_792_344,
            0.020_017_914_4,
            1.010_469_45,
            103.560_653,
        ];
        // The older data sheet of BK7, by powers of λ².
        const OLD: [f64; 6] = [
            2.271_892_9,
            -1.010_807_7e-2,
            1.059_250_9e-2,
            2.081_696_5e-4,
            -7.647_253_8e-6,
            4.924_099_1e-7,
        ];
        // Quartz, ordinary: Ghosh 1999. Yttrium vanadate, ordinary: its makers' data sheets.
        let (qa, qb, qc, qd, qe): (f64, f64, f64, f64, f64) = (
            1.286_041_41,
            1.070_440_83,
            1.005_859_97e-2,
            1.102_022_42,
            100.0,
        );
        let (ya, yb, yc, yd) = (3.778_34, 0.069_736, 0.047_24, 0.010_813_3);
        let d = D_LINE * 1e-3;
        let halves = [0.5 * BK7[0], BK7[1], 0.5 * BK7[0], BK7[1]];
        let fifth = [0.5 * BK7[2], BK7[3], 0.5 * BK7[2], BK7[3], BK7[4], BK7[5]];
        let [a, b, c, e, f, g] = OLD;
        let cases: [(Formula, &[f64], f64, f64); 14] = [
            (Schott, &OLD, d, 1.516_80),
            (Sellmeier1, &BK7, d, 1.516_80),
            // Fused silica, Malitson 1965.
            (
                Sellmeier1,
                &[
                    0.696_166_3,
                    0.004_679_148_26,
                    0.407_942_6,
                    0.013_512_063_1,
                    0.897_479_4,
                    97.934_002_5,
                ],
                d,
                1.458_46,
            ),
            (
                Sellmeier2,
                &[qa - 1.0 + qd, qb, f64::sqrt(qc), qd * qe, 10.0],
                0.5893,
                1.544_21,
            ),
            // BK7 by its F, d and C lines; the e line is none of them.
            (
                Conrady,
                &[1.497511, 0.0100886, 0.0003294],
                0.546_074,
                1.518_72,
            ),
            (Sellmeier3, &[&halves[..], &BK7[2..]].concat(), d, 1.516_80),
            (Handbook1, &[ya, yb, yc, yd], 1.55, 1.944_73),
            (Handbook1, &[ya, yb, yc, yd], 1.30, 1.950_00),
            (Handbook2, &[ya - yb / yc, yb / yc, yc, yd], 1.55, 1.944_73),
            (Sellmeier4, &[qa, qb, qc, qd, qe], 0.5893, 1.544_21),
            (Extended, &OLD, d, 1.516_80),
            (Sellmeier5, &[&halves[..], &fifth].concat(), d, 1.516_80),
            (Extended2, &OLD, d, 1.516_80),
            (Extended3, &[a, b, 0.0, c, e, f, g], d, 1.516_80),
        ];
        for (formula, coefficients, um, published) in cases {
            let mut k = [0.0; 10];
            k[..coefficients.len()].copy_from_slice(coefficients);
            let n = formula.index(&k, um);
            // Silicon's is published to four places, the others to five.
            let half_a_place = if formula == Herzberger { 5e-5 } else { 1e-5 };
            let off = (n - published).abs();
            assert!(off < half_a_place, "{formula:?} at {um} µm: {n}");
        }
        // Silicon, Edwards and Ochoa 1980; Salzberg and Villa's table has four digits at 4 µm.
        let mut silicon = [0.0; 10];
        silicon[..5].copy_from_slice(&[3.416_96, 0.138_497, 0.013_924, -2.09e-5, 1.48e-7]);
        assert!((Herzberger.index(&silicon, 4.0) - 3.4255).abs() < 1.5e-4);
    }

    #[test]
    fn the_formulas_that_are_the_same_curve_agree() {
        // Schott's and both extended polynomials with the same six coefficients.
        let k = [2.27, -0.01, 0.01, 2e-4, -1e-5, 1e-6, 0.0, 0.0, 0.0, 0.0];
        let schott = Formula::Schott.index(&k, 0.55);
        assert_eq!(schott, Formula::Extended.index(&k, 0.55));
        assert_eq!(schott, Formula::Extended2.index(&k, 0.55));
        let third = [2.27, -0.01, 0.0, 0.01, 2e-4, -1e-5, 1e-6, 0.0, 0.0, 0.0];
        assert_eq!(schott, Formula::Extended3.index(&third, 0.55));
        for number in 1..=13 {
            assert_eq!(Formula::from_number(number).unwrap() as u32, number);
        }
        assert_eq!(Formula::from_number(14), None);
    }

    #[test]
    fn three_lines_are_met_exactly_and_between_them_the_curve_is_smooth() {
        let cauchy = Medium::from_abbe(1.7, 30.0);
        let lines = Medium::from_lines(cauchy.index(F_LINE), 1.7, cauchy.index(C_LINE));
        for nm in [400.0, F_LINE, 550.0, D_LINE, C_LINE, 700.0] {
            assert!((lines.index(nm) - cauchy.index(nm)).abs() < 1e-12);
        }
    }

    /// N-BK7 is opaque below 0.29 and above 2.7 µm by its maker's data sheet.
    #[test]
    fn a_formula_is_doubted_where_no_glass_is_clear() {
        let table = crate::prescription::glass::Catalogue::builtin();
        let is_doubted = |name: &str, nm: f64| table.find(name).unwrap().doubt_at(nm).is_some();
        for nm in [150.0, 8000.0, 12_000.0] {
            assert!(is_doubted("N-BK7", nm), "{nm} nm");
        }
        for nm in [300.0, D_LINE, 1550.0, 2500.0] {
            assert!(!is_doubted("N-BK7", nm), "{nm} nm");
        }
        assert!(!is_doubted("CAF2", 8000.0) && !is_doubted("GERMANIUM", 10_000.0));
        for glass in table.glasses().filter(|glass| glass.nominal_nm() == D_LINE) {
            for nm in [F_LINE, D_LINE, C_LINE] {
                assert_eq!(glass.doubt_at(nm), None);
            }
        }
    }
}
