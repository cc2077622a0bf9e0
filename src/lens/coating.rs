//! What a surface reflects, and what a lens therefore loses: Fresnel's formulas, a single layer of
//! magnesium fluoride, and the T-number.
//!
//! Light is taken as unpolarized at every surface: the mean of both polarizations, exact for
//! one surface and on the axis. Glass absorbs nothing. What a surface does not reflect it lets
//! through.

use glam::DVec3;

use super::trace::{Course, Element, LensRay, Toward};
use super::{Lens, Prescription};

/// What lies on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coating {
    /// Reflects nothing: the paper's lenses, which pass all light. Default.
    #[default]
    Ideal,
    /// Nothing: the bare step of the index.
    Bare,
    /// A quarter wave of magnesium fluoride on a surface between glass and air; a cemented one
    /// stays bare, for there it would do harm.
    MagnesiumFluoride,
}

/// The index of an evaporated layer of magnesium fluoride. It changes by 0.4% over the visible.
const FLUORIDE: f64 = 1.38;
/// The wavelength at which the layer is a quarter wave thick, in nanometers.
const QUARTER_WAVE_AT: f64 = 550.0;
/// A layer is on surfaces to a medium thinner than this: air, not cement and not water.
const THIN: f64 = 1.2;

impl Coating {
    pub const ALL: [(&'static str, Self); 3] = [
        ("ideal", Self::Ideal),
        ("none", Self::Bare),
        ("mgf2", Self::MagnesiumFluoride),
    ];

    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, c)| *c == self)
            .map_or("", |(n, _)| n)
    }

    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, c)| *c)
    }

    /// The share of unpolarized light that is reflected, for light that comes from the index
    /// `from` at an angle of this cosine; 1 beyond the critical angle.
    pub fn reflectance(self, from: f64, into: f64, cos: f64, wavelength_nm: f64) -> f64 {
        let sine = from * (1.0 - cos * cos).max(0.0).sqrt();
        if sine > into {
            return 1.0;
        }
        if self == Self::Ideal || from == into {
            return 0.0;
        }
        let behind = cos_in(into, sine);
        if self == Self::Bare || from.min(into) > THIN || from.max(into) < FLUORIDE {
            let [s, p] = amplitudes(from, cos, into, behind);
            return 0.5 * (s * s + p * p);
        }
        let inside = cos_in(FLUORIDE, sine);
        // The layer's optical thickness is a quarter of 550 nm, so this is the phase of the way
        // through it and back.
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

/// The cosine in a medium, by Snell's law; `sine` is n sin θ.
fn cos_in(index: f64, sine: f64) -> f64 {
    let s = sine / index;
    (1.0 - s * s).max(0.0).sqrt()
}

/// Fresnel's reflected amplitudes across and in the plane of incidence.
fn amplitudes(from: f64, cos_from: f64, into: f64, cos_into: f64) -> [f64; 2] {
    let over = |a: f64, b: f64| if a + b > 0.0 { (a - b) / (a + b) } else { 1.0 };
    [
        over(from * cos_from, into * cos_into),
        over(into * cos_from, from * cos_into),
    ]
}

impl Prescription {
    /// The same lens with this on every surface.
    pub fn with_coating(mut self, coating: Coating) -> Self {
        self.surfaces.iter_mut().for_each(|s| s.coating = coating);
        self
    }
}

impl Element {
    /// The share of light that is reflected where a ray meets the surface.
    pub(super) fn reflectance(&self, toward: Toward, cos: f64, wavelength_nm: f64) -> f64 {
        let [front, behind] = self.indices;
        let (from, into) = match toward {
            Toward::Film => (front, behind),
            Toward::Scene => (behind, front),
        };
        self.coating.reflectance(from, into, cos, wavelength_nm)
    }
}

impl Lens {
    /// The same lens with this on every surface.
    pub fn with_coating(&self, coating: Coating) -> Self {
        self.with(self.prescription().clone().with_coating(coating))
    }

    /// Whether any surface reflects, so that rays lose some of their light.
    pub fn reflects(&self) -> bool {
        self.reflects
    }

    /// The share of a ray's light that reaches the other side, at the lens's wavelength; 0 for a
    /// ray that is lost.
    pub fn transmittance(&self, ray: &LensRay, toward: Toward) -> f64 {
        let course = self.course(toward, true);
        transmittance(&course, ray, self.wavelength())
    }

    /// The share of the light of the widest beam along the axis that gets through, of what the
    /// stop would let pass. None where no beam does.
    pub fn axial_transmittance(&self) -> Option<f64> {
        const RINGS: u32 = 32;
        const SPOKES: u32 = 16;
        if !self.reflects() {
            return Some(1.0);
        }
        let spokes = if self.prescription().is_rotational() {
            1
        } else {
            SPOKES
        };
        let beam = self.axial_beam().height;
        let far = -4.0 * (beam + self.length() + 1.0);
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..RINGS * spokes {
            let (ring, spoke) = (i % RINGS, i / RINGS);
            // Rings of equal area, each at its middle.
            let r = beam * ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt();
            let angle = std::f64::consts::TAU * (f64::from(spoke) + 0.5) / f64::from(spokes);
            let ray = LensRay {
                origin: DVec3::new(r * libm::cos(angle), r * libm::sin(angle), far),
                direction: DVec3::Z,
            };
            let share = self.transmittance(&ray, Toward::Film);
            sum += share;
            count += f64::from(u8::from(share > 0.0));
        }
        (count > 0.0).then(|| sum / count)
    }

    /// The f-number of a lens without losses that would make as bright a picture: N/√τ.
    pub fn t_number(&self) -> Option<f64> {
        let f_number = self.first_order().f_number()?;
        Some(f_number / self.axial_transmittance()?.sqrt())
    }
}

fn transmittance(course: &Course<'_>, ray: &LensRay, wavelength_nm: f64) -> f64 {
    let mut share = 1.0;
    let outcome = course.walk(*ray, |surface, _, hit| {
        let element = &course.elements[surface];
        share *= 1.0 - element.reflectance(course.toward, hit.cos, wavelength_nm);
    });
    if outcome.is_ok() { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::Surface;
    use crate::lens::glass::Medium;

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
                    let ours = Coating::MagnesiumFluoride.reflectance(from, into, cos, nm);
                    if sine > into {
                        assert_eq!(ours, 1.0);
                        continue;
                    }
                    let n = [from, 1.38, into];
                    let (rs, ts) = by_matrix(n, sine, 550.0, nm, false);
                    let (rp, tp) = by_matrix(n, sine, 550.0, nm, true);
                    assert!((rs + ts - 1.0).abs() < 1e-12 && (rp + tp - 1.0).abs() < 1e-12);
                    assert!((ours - 0.5 * (rs + rp)).abs() < 1e-12, "{ours} {cos} {nm}");
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
        use crate::diag::{Sink, Source};
        use crate::lens::formats::{read, write};
        let mut lens = Lens::named("cooke-triplet").unwrap().prescription().clone();
        lens.surfaces[1].coating = Coating::MagnesiumFluoride;
        lens.surfaces[4].coating = Coating::Bare;
        let (text, left_out) = write::write(&lens, write::Target::Json).unwrap();
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

    fn window(coating: Coating) -> Lens {
        let glass = Medium::constant(1.5168);
        let surfaces = vec![
            Surface::sphere(0.0, 5.0, glass, 10.0),
            Surface::sphere(0.0, 1.0, Medium::air(), 10.0),
        ];
        Lens::new(Prescription::new("window", surfaces).with_coating(coating))
    }

    #[test]
    fn a_bare_window_passes_the_square_of_what_one_surface_does() {
        let ray = LensRay {
            origin: DVec3::new(1.0, 2.0, -5.0),
            direction: DVec3::Z,
        };
        let through = window(Coating::Bare).transmittance(&ray, Toward::Film);
        let one = 1.0 - (0.5168f64 / 2.5168).powi(2);
        assert!((through - one * one).abs() < 1e-15);
        assert_eq!(
            window(Coating::Ideal).transmittance(&ray, Toward::Film),
            1.0
        );
    }

    #[test]
    fn a_ray_loses_the_same_share_both_ways() {
        let lens = Lens::named("double-gauss").unwrap();
        for (_, coating) in Coating::ALL {
            let lens = lens.with_coating(coating);
            let ray = LensRay {
                origin: DVec3::new(3.0, 8.0, -50.0),
                direction: DVec3::new(0.0, 0.05, 1.0),
            };
            let out = lens.trace_from_scene(&ray).unwrap();
            let back = LensRay {
                origin: out.origin + 10.0 * out.direction,
                direction: -out.direction,
            };
            let there = lens.transmittance(&ray, Toward::Film);
            let again = lens.transmittance(&back, Toward::Scene);
            assert!((there / again - 1.0).abs() < 1e-12, "{there} {again}");
        }
    }

    /// Six surfaces between glass and air.
    #[test]
    fn the_t_number_is_the_f_number_over_the_root_of_what_gets_through() {
        let lens = Lens::named("cooke-triplet").unwrap();
        let f = lens.first_order().f_number().unwrap();
        assert_eq!(lens.t_number(), Some(f));
        let bare = lens.with_coating(Coating::Bare);
        let share = bare.axial_transmittance().unwrap();
        // On the axis itself: the product over the surfaces, known by hand.
        let indices = lens.prescription().indices(lens.wavelength());
        let product: f64 = indices
            .windows(2)
            .map(|n| 1.0 - ((n[0] - n[1]) / (n[0] + n[1])).powi(2))
            .product();
        assert!((share / product - 1.0).abs() < 0.01, "{share} {product}");
        assert!((bare.t_number().unwrap() - f / share.sqrt()).abs() < 1e-12);
        let coated = lens.with_coating(Coating::MagnesiumFluoride);
        assert!(coated.axial_transmittance().unwrap() > 0.9);
    }
}
