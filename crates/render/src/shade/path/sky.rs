//! A clear sky with the sun (Preetham, Shirley and Smits, "A practical analytic model for
//! daylight", 1999).
//!
//! Luminance and color of the sky are the paper's formulas for a turbidity. The sun is the light
//! that the paper's Rayleigh and aerosol extinction leave of 127.5 klx, at one wavelength for each
//! channel. Everything is scaled so that white paper that lies flat shows the level 1 as
//! the mean of its channels.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use ivcam_inventor::traversal::state::LightKind;
use ivcam_optics::spectrum::RGB_FROM_XYZ;
use libm::{acos, cos, exp, pow, sin, tan};

use super::environment::{EnvironmentLight, solid_angle};
use crate::scene::Light;

/// The pixels of the sky's picture. A pixel is 0.7° across.
const SIZE: (usize, usize) = (512, 256);
/// The sun outside of the atmosphere, in klx.
const SUN: f64 = 127.5;
/// The share of light that the ground below the horizon sends back.
const GROUND: f64 = 0.2;

/// The sun's place, and how hazy the air is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearSky {
    /// The angle of the sun above the horizon in radians, from 0 to π/2.
    pub elevation: f64,
    /// The angle from −z to the sun, toward +x, in radians.
    pub azimuth: f64,
    /// The turbidity: 2 is very clear, 10 is hazy.
    pub turbidity: f64,
}

/// The angle across the sun, in radians.
pub(super) const SUN_ANGLE: f32 = 0.0093;

impl ClearSky {
    /// The direction to the sun, with +y up.
    fn toward(&self) -> DVec3 {
        let flat = cos(self.elevation);
        let (x, z) = (flat * sin(self.azimuth), -flat * cos(self.azimuth));
        DVec3::new(x, sin(self.elevation), z)
    }

    /// Returns the light of the sky, and the sun as a directional light.
    pub fn light(&self) -> Option<(EnvironmentLight, Light)> {
        let (width, height) = SIZE;
        let toward = self.toward();
        let sky = Sky::new(self.turbidity, FRAC_PI_2 - self.elevation);
        let radiance = |row: usize, column: usize| {
            let down = PI * (row as f64 + 0.5) / height as f64;
            let turn = TAU * ((column as f64 + 0.5) / width as f64 - 0.5);
            let (x, z) = (sin(down) * sin(turn), -sin(down) * cos(turn));
            let angle = acos(DVec3::new(x, cos(down), z).dot(toward).clamp(-1.0, 1.0));
            (sky.radiance(down, angle), cos(down))
        };
        let mut pixels = Vec::with_capacity(width * height);
        let mut level = DVec3::ZERO;
        for row in 0..height / 2 {
            let solid_angle = solid_angle(width, height, row);
            for column in 0..width {
                let (light, cosine) = radiance(row, column);
                level += light * (cosine * solid_angle / PI);
                pixels.push(light);
            }
        }
        let sun = self.sun();
        level += sun * (toward.y.max(0.0) / PI);
        pixels.resize(width * height, level * GROUND);
        let scale = 1.0 / (level.element_sum() / 3.0);
        let pixels = pixels
            .iter()
            .map(|light| (*light * scale).as_vec3())
            .collect();
        let light = Light {
            // A light of the intensity I brings the irradiance π·I.
            color: (sun * (scale / PI)).as_vec3(),
            at_eye: false,
            kind: LightKind::Directional,
            ..Light::headlight(-toward.as_vec3())
        };
        Some((EnvironmentLight::new(width, height, pixels)?, light))
    }

    /// The irradiance of a surface that faces the sun, in klx of each channel.
    fn sun(&self) -> DVec3 {
        let degrees = self.elevation.to_degrees();
        // The relative mass of the air (Kasten 1966, the paper's appendix).
        let mass = 1.0 / (sin(self.elevation) + 0.15 * pow(degrees + 3.885, -1.253));
        let haze = (0.046_08 * self.turbidity - 0.045_86).max(0.0);
        let through = |micrometers: f64| {
            let rayleigh = exp(-0.008_735 * pow(micrometers, -4.08) * mass);
            SUN * rayleigh * exp(-haze * pow(micrometers, -1.3) * mass)
        };
        DVec3::new(through(0.61), through(0.55), through(0.465))
    }
}

/// The distributions of luminance and of the two chromaticities.
struct Sky {
    /// The coefficients A to E of Perez and others, for Y, x and y.
    perez: [[f64; 5]; 3],
    /// The values at the zenith over the distribution there.
    zenith: [f64; 3],
}

impl Sky {
    fn new(t: f64, from_zenith: f64) -> Self {
        let perez = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * from_zenith);
        let luminance = (4.0453 * t - 4.9710) * tan(chi) - 0.2155 * t + 2.4192;
        let s = from_zenith;
        let polynomial = |rows: [[f64; 4]; 3]| {
            let row = |r: [f64; 4]| ((r[0] * s + r[1]) * s + r[2]) * s + r[3];
            (row(rows[0]) * t + row(rows[1])) * t + row(rows[2])
        };
        let x = polynomial([
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]);
        let y = polynomial([
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]);
        let values = [luminance.max(0.0), x, y];
        Self {
            zenith: std::array::from_fn(|i| values[i] / distribution(&perez[i], 0.0, from_zenith)),
            perez,
        }
    }

    /// The radiance in kcd/m² of each channel at an angle from the zenith and one from the sun.
    fn radiance(&self, from_zenith: f64, from_sun: f64) -> DVec3 {
        let at = from_zenith.min(FRAC_PI_2 - 1e-3);
        let [luminance, x, y] =
            std::array::from_fn(|i| self.zenith[i] * distribution(&self.perez[i], at, from_sun));
        let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance;
        (RGB_FROM_XYZ * xyz).max(DVec3::ZERO)
    }
}

/// The distribution of Perez and others.
fn distribution([a, b, c, d, e]: &[f64; 5], from_zenith: f64, from_sun: f64) -> f64 {
    let cosine = cos(from_sun);
    (1.0 + a * exp(b / cos(from_zenith))) * (1.0 + c * exp(d * from_sun) + e * cosine * cosine)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_clear_sky_is_blue_and_its_sun_yellow_and_both_make_white_paper_white() {
        for (degrees, least, most) in [(60.0f64, 1.0, 9.0), (30.0, 1.0, 9.0), (5.0, 0.01, 1.0)] {
            let place = ClearSky {
                elevation: degrees.to_radians(),
                azimuth: 0.7,
                turbidity: 3.0,
            };
            let (sky, sun) = place.light().unwrap();
            let zenith = sky.radiance(Vec3::Y).0;
            assert!(
                zenith.z > 1.3 * zenith.x && sun.color.x > sun.color.z,
                "{degrees}"
            );
            let away = -sun.direction.with_y(0.0).normalize() + 1e-3 * Vec3::Y;
            // The horizon below a high sun is not much brighter than the zenith.
            let least_share = if degrees > 45.0 { 1.0 } else { 2.0 };
            let bright = sky.radiance(away).0;
            assert!(bright.y > least_share * zenith.y, "{degrees}: {bright}");
            // The sun over the sky on flat paper: only a high sun is brighter than the sky.
            let sunny = (sun.color * -sun.direction.y).element_sum() / 3.0;
            let ratio = sunny / (1.0 - sunny);
            assert!(ratio > least && ratio < most, "{degrees}: {ratio}");
        }
    }
}
