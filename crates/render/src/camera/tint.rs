//! The color of light behind coatings whose transmittance varies with the wavelength, for a lens of
//! glass without dispersion: rays of all wavelengths take the same path.
//!
//! The film's response to a ray is the integral over the spectrum of [`Spectrum::color`] times the
//! transmittance. The transmittance is a smooth function of the reciprocal of the wavelength, the
//! cosine of the phase in a layer. It is computed at [`NODES`] wavelengths and interpolated by a
//! polynomial, whose integrals with the color are computed once.

use glam::DMat3;
use ivcam_base::math::lagrange_weight;
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel};
use ivcam_optics::lens::Transmittances;
use ivcam_optics::spectrum::Spectrum;

/// The number of wavelengths at which transmittances are computed. With them, the interpolation
/// error of the color is below 1e-5 (`few_wavelengths_have_the_color_of_all`).
const NODES: usize = 7;
/// The first and the last of these wavelengths, in nanometers. Less than a hundredth of the
/// response is outside.
const ENDS: [f64; 2] = [700.0, 405.0];

/// The entries of a matrix for each lane, column by column.
pub(super) type MatrixLanes = [Lane; 9];

/// The film's response to the transmittance at each of a few wavelengths.
#[derive(Clone, Debug)]
pub(super) struct Tint([DMat3; NODES]);

impl Default for Tint {
    fn default() -> Self {
        let [first, last] = ENDS.map(f64::recip);
        let nodes: [f64; NODES] =
            std::array::from_fn(|k| first + (last - first) * k as f64 / (NODES - 1) as f64);
        let spectrum = Spectrum::default();
        let colors: Vec<(f64, DMat3)> = spectrum.colors().collect();
        Self(std::array::from_fn(|k| {
            let weight = |nm: f64| lagrange_weight(&nodes, k, nm.recip());
            let weighted = colors.iter().map(|(nm, color)| *color * weight(*nm));
            weighted.fold(DMat3::ZERO, |sum, color| sum + color)
        }))
    }
}

impl Tint {
    /// The transmittances that determine the color.
    pub(super) fn transmittances(&self) -> Transmittances {
        Transmittances::between(ENDS, NODES)
    }
}

/// The kernel that computes the film's responses to rays from their transmittances.
pub(super) struct Tinted<'a> {
    pub tint: &'a Tint,
    pub transmittances: &'a Transmittances,
    pub out: &'a mut MatrixLanes,
}

impl SimdKernel for Tinted<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        *self.out = [[0.0; LANES]; 9];
        for (k, matrix) in self.tint.0.iter().enumerate() {
            let shares = self.transmittances.shares(k);
            for (entries, entry) in self.out.iter_mut().zip(matrix.to_cols_array()) {
                for i in 0..LANES {
                    entries[i] += entry * shares[i];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::lanes::{bits, dispatch};
    use ivcam_optics::lens::{Coating, Lens, LensRay, Toward};

    /// Rays from the middle of the film and from its corner.
    #[test]
    fn few_wavelengths_have_the_color_of_all() {
        let coated = |name: &str| Lens::named(name).unwrap();
        let mut most: f64 = 0.0;
        for name in ["double-gauss", "canon-70-200", "wide-angle"] {
            let lens = coated(name).with_coating(Coating::MagnesiumFluoride);
            let back = lens.first_order().focal.unwrap().rear_focal_point;
            let rear = lens.prescription().surfaces.last().unwrap().semi_diameter;
            let mut bundle = ivcam_optics::lens::Bundle::default();
            for lane in 0..LANES {
                let part = lane as f64 / LANES as f64 - 0.5;
                let origin = glam::DVec3::new(0.0, if lane % 2 == 0 { 0.0 } else { 15.0 }, back);
                let aim = glam::DVec3::new(0.4 * rear * part, 0.8 * rear * part, lens.length());
                let direction = (aim - origin).normalize();
                bundle.set(lane, &LensRay { origin, direction });
            }
            let rays = bundle.clone();
            let tint = Tint::default();
            let mut transmittances = tint.transmittances();
            lens.trace_bundle_transmitted(&mut bundle, &mut transmittances);
            let mut out = [[0.0; LANES]; 9];
            dispatch(Tinted {
                tint: &tint,
                transmittances: &transmittances,
                out: &mut out,
            });
            assert!(bundle.through().count_ones() > 12, "{name}");
            for lane in bits(bundle.through()) {
                let share = |nm| lens.transmittance_at(&rays.ray(lane), Toward::Scene, nm);
                let spectrum = Spectrum::default();
                let exact = spectrum
                    .colors()
                    .fold(DMat3::ZERO, |sum, (nm, c)| sum + c * share(nm));
                for (found, known) in out.iter().zip(exact.to_cols_array()) {
                    most = most.max((found[lane] - known).abs());
                }
            }
        }
        assert!(most < 1e-5, "{most}");
    }
}
