//! The reflectance of surfaces: Fresnel's formulas and a single layer of magnesium fluoride.
//!
//! Light is treated as unpolarized at every surface: the reflectance is the mean of both
//! polarizations. That is exact for one surface, and on the axis.

/// The coating of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Coating {
    /// The surface reflects nothing, as in the paper, whose lenses transmit all light. This is the
    /// default.
    #[default]
    Ideal,
    /// The surface is uncoated.
    Bare,
    /// A quarter wave of magnesium fluoride on a surface between glass and air. A cemented surface
    /// is uncoated, because there the layer would reflect more.
    MagnesiumFluoride,
}

/// The index of an evaporated layer of magnesium fluoride. It changes by 0.4% over the visible.
pub(crate) const FLUORIDE: f64 = 1.38;
/// The wavelength at which the layer is a quarter wave thick, in nanometers.
pub(crate) const QUARTER_WAVE_AT: f64 = 550.0;
/// A surface has a layer if the medium on one side has an index below this: air, but not cement or
/// water.
const MAX_INDEX_OF_AIR: f64 = 1.2;

/// The way in which a surface between two media reflects light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reflection {
    /// The surface reflects nothing below the critical angle.
    None,
    /// The surface is uncoated.
    Bare,
    /// The surface has a layer of magnesium fluoride.
    Layer,
}

impl Coating {
    /// All coatings with their names.
    pub const ALL: [(&'static str, Self); 3] = [
        ("ideal", Self::Ideal),
        ("none", Self::Bare),
        ("mgf2", Self::MagnesiumFluoride),
    ];

    /// The name in options and lens files.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, c)| *c == self)
            .map_or("", |(n, _)| n)
    }

    /// The coating with a name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, c)| *c)
    }

    /// Returns the way in which a surface with this coating reflects between media of two indices.
    pub(crate) fn reflection(self, from: f64, into: f64) -> Reflection {
        if self == Self::Ideal || from == into {
            Reflection::None
        } else if self == Self::Bare
            || from.min(into) > MAX_INDEX_OF_AIR
            || from.max(into) < FLUORIDE
        {
            Reflection::Bare
        } else {
            Reflection::Layer
        }
    }

    /// The reflectance for unpolarized light that comes from a medium of index `from` at an angle
    /// with this cosine. It is 1 beyond the critical angle.
    pub fn reflectance(self, from: f64, into: f64, cos: f64, wavelength_nm: f64) -> f64 {
        let sine = from * (1.0 - cos * cos).max(0.0).sqrt();
        if sine > into {
            return 1.0;
        }
        let behind = cos_in(into, sine);
        match self.reflection(from, into) {
            Reflection::None => return 0.0,
            Reflection::Bare => {
                let [s, p] = amplitudes(from, cos, into, behind);
                return 0.5 * (s * s + p * p);
            }
            Reflection::Layer => {}
        }
        let inside = cos_in(FLUORIDE, sine);
        // The layer's optical thickness is a quarter of 550 nm, so this is the phase of the path
        // through the layer and back.
        let phase = std::f64::consts::PI * QUARTER_WAVE_AT / wavelength_nm * inside;
        let turn = libm::cos(phase);
        let front = amplitudes(from, cos, FLUORIDE, inside);
        let rear = amplitudes(FLUORIDE, inside, into, behind);
        let layer = |(a, b): (f64, f64)| {
            let (squares, product) = (a * a + b * b, a * b);
            let mixed = 2.0 * product * turn;
            (squares + mixed) / (1.0 + product * product + mixed)
        };
        0.5 * (layer((front[0], rear[0])) + layer((front[1], rear[1])))
    }
}

/// The cosine of the angle in a medium, by Snell's law. `sine` is n sin θ.
fn cos_in(index: f64, sine: f64) -> f64 {
    let s = sine / index;
    (1.0 - s * s).max(0.0).sqrt()
}

/// The amplitude reflection coefficients by Fresnel, perpendicular to and in the plane of
/// incidence.
fn amplitudes(from: f64, cos_from: f64, into: f64, cos_into: f64) -> [f64; 2] {
    let over = |a: f64, b: f64| if a + b > 0.0 { (a - b) / (a + b) } else { 1.0 };
    [
        over(from * cos_from, into * cos_into),
        over(into * cos_from, from * cos_into),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::{Lens, Prescription};

    /// A complex number, for the characteristic matrix.
    #[derive(Clone, Copy)]
    struct Complex(f64, f64);

    impl Complex {
        fn times(self, o: Self) -> Self {
            Self(self.0 * o.0 - self.1 * o.1, self.0 * o.1 + self.1 * o.0)
        }
        fn plus(self, o: Self) -> Self {
            Self(self.0 + o.0, self.1 + o.1)
        }
        fn square(self) -> f64 {
            self.0 * self.0 + self.1 * self.1
        }
    }

    /// Reflectance and transmittance of a layer by its characteristic matrix (Abelès), one
    /// polarization: admittances n cos θ and n / cos θ.
    fn by_matrix(n: [f64; 3], sine: f64, quarter: f64, nm: f64, p: bool) -> (f64, f64) {
        let cos = n.map(|n| cos_in(n, sine));
        let [y0, y1, y2] = std::array::from_fn(|i| if p { n[i] / cos[i] } else { n[i] * cos[i] });
        let delta = 2.0 * std::f64::consts::PI * (quarter / 4.0) * cos[1] / nm;
        let (c, s) = (delta.cos(), delta.sin());
        let b = Complex(c, s * y2 / y1);
        let c = Complex(c * y2, s * y1);
        let sum = Complex(y0 * b.0, y0 * b.1).plus(c);
        let difference = Complex(y0 * b.0 - c.0, y0 * b.1 - c.1);
        let transmitted = Complex(4.0 * y0 * y2, 0.0).times(Complex(1.0 / sum.square(), 0.0));
        (difference.square() / sum.square(), transmitted.0)
    }

    #[test]
    fn bare_glass_reflects_fresnels_four_percent_and_from_inside_the_same() {
        let n: f64 = 1.5168;
        let known = ((n - 1.0) / (n + 1.0)).powi(2);
        assert!((known - 0.042_165).abs() < 1e-6);
        for (from, into) in [(1.0, n), (n, 1.0)] {
            let r = Coating::Bare.reflectance(from, into, 1.0, 550.0);
            assert!((r - known).abs() < 1e-15, "{r}");
        }
    }

    /// At Brewster's angle tan θ = n the light in the plane of incidence is not reflected; the
    /// other reflects ((n² − 1)/(n² + 1))².
    #[test]
    fn at_brewsters_angle_one_polarization_is_not_reflected() {
        let n: f64 = 1.5168;
        let cos = 1.0 / (1.0 + n * n).sqrt();
        let r = Coating::Bare.reflectance(1.0, n, cos, 550.0);
        let s = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((r - 0.5 * s).abs() < 1e-15);
    }

    #[test]
    fn a_quarter_wave_of_fluoride_reflects_what_the_textbook_says() {
        let n: f64 = 1.5168;
        let known = ((1.38 * 1.38 - n) / (1.38 * 1.38 + n)).powi(2);
        let r = Coating::MagnesiumFluoride.reflectance(1.0, n, 1.0, 550.0);
        assert!(
            (r - known).abs() < 1e-15 && (r - 0.0128).abs() < 1e-4,
            "{r}"
        );
        // On a glass of 1.38² nothing is left; half a wave is as if it were not there.
        let none = Coating::MagnesiumFluoride.reflectance(1.0, 1.38 * 1.38, 1.0, 550.0);
        assert!(none < 1e-30);
        let half = Coating::MagnesiumFluoride.reflectance(1.0, n, 1.0, 275.0);
        assert!((half - 0.042_165).abs() < 1e-6, "{half}");
    }

    #[test]
    fn a_layer_agrees_with_its_characteristic_matrix_and_loses_no_energy() {
        for (from, into) in [(1.0, 1.5168), (1.7847, 1.0), (1.0, 1.9229)] {
            for nm in [400.0, 486.1, 550.0, 656.3, 700.0] {
                for i in 0..40 {
                    let cos: f64 = 1.0 - f64::from(i) / 40.0;
                    let sine = from * (1.0 - cos * cos).sqrt();
                    let computed = Coating::MagnesiumFluoride.reflectance(from, into, cos, nm);
                    if sine > into {
                        assert_eq!(computed, 1.0);
                        continue;
                    }
                    let n = [from, 1.38, into];
                    let (rs, ts) = by_matrix(n, sine, 550.0, nm, false);
                    let (rp, tp) = by_matrix(n, sine, 550.0, nm, true);
                    assert!((rs + ts - 1.0).abs() < 1e-12 && (rp + tp - 1.0).abs() < 1e-12);
                    let off = (computed - 0.5 * (rs + rp)).abs();
                    assert!(off < 1e-12, "{computed} {cos} {nm}");
                }
            }
        }
    }

    #[test]
    fn an_ideal_surface_reflects_nothing_but_beyond_the_critical_angle_all() {
        assert_eq!(Coating::Ideal.reflectance(1.0, 1.5, 0.3, 550.0), 0.0);
        assert_eq!(Coating::Ideal.reflectance(1.5, 1.0, 0.3, 550.0), 1.0);
    }

    #[test]
    fn cement_stays_bare_where_the_lens_is_coated() {
        let coated = Coating::MagnesiumFluoride.reflectance(1.6, 1.5, 0.9, 550.0);
        assert_eq!(coated, Coating::Bare.reflectance(1.6, 1.5, 0.9, 550.0));
    }

    #[test]
    fn coatings_are_written_and_read_surface_by_surface() {
        use crate::prescription::formats::{read, write};
        use ivcam_base::diag::{Sink, Source};
        let mut lens = Lens::named("cooke-triplet").unwrap().prescription().clone();
        lens.surfaces[1].coating = Coating::MagnesiumFluoride;
        lens.surfaces[4].coating = Coating::Bare;
        let (text, left_out) = write::write(&lens, write::OutputFormat::Json).unwrap();
        assert!(left_out.is_empty());
        let source = |text: String| std::sync::Arc::new(Source::new("a.json", text.into_bytes()));
        let again = read(&source(text.clone()), &mut Sink::new()).unwrap();
        let of = |lens: &Prescription| lens.surfaces.iter().map(|s| s.coating).collect::<Vec<_>>();
        assert_eq!(of(&again), of(&lens));
        // Beside `surfaces` it is for those that say nothing.
        let whole = text.replacen("\"units\"", "\"coating\": \"none\", \"units\"", 1);
        let whole = read(&source(whole), &mut Sink::new()).unwrap();
        assert_eq!(whole.surfaces[0].coating, Coating::Bare);
        assert_eq!(whole.surfaces[1].coating, Coating::MagnesiumFluoride);
        let wrong = text.replacen("mgf2", "magic", 1);
        let error = read(&source(wrong), &mut Sink::new()).unwrap_err();
        assert!(error.message.contains("magic") && error.location().1.unwrap().0 > 5);
    }
}
