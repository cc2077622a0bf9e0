//! White balance: the color of the light in which a white surface is shown as white.

use std::ops::RangeInclusive;

use glam::DVec3;

use crate::spectrum::RGB_FROM_XYZ;

/// A filter before the film that makes light of a color temperature white. It keeps the luminance
/// of that light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteBalance {
    kelvin: f64,
    gains: DVec3,
}

impl WhiteBalance {
    /// The color temperatures that it can balance, in kelvins. Below them the blue of light is too
    /// weak for three gains.
    pub const RANGE: RangeInclusive<f64> = 2500.0..=25_000.0;

    /// Returns the filter for a color temperature in kelvins. Returns `None` outside
    /// [`WhiteBalance::RANGE`].
    pub fn of_kelvin(kelvin: f64) -> Option<Self> {
        let is_known = Self::RANGE.contains(&kelvin);
        is_known.then(|| Self {
            kelvin,
            gains: 1.0 / rgb_of(chromaticity(kelvin)),
        })
    }

    /// The color temperature in kelvins.
    pub fn kelvin(&self) -> f64 {
        self.kelvin
    }

    /// The factor of a channel: 0 red, 1 green, 2 blue.
    pub(super) fn gain(&self, channel: usize) -> f64 {
        self.gains[channel]
    }
}

/// Returns light of luminance 1 in linear sRGB.
fn rgb_of((x, y): (f64, f64)) -> DVec3 {
    RGB_FROM_XYZ * DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Returns the chromaticity of light of a color temperature: that of a black body below 4000 K, by
/// the cubic curves of Kang et al. ("Design of advanced color temperature control system for HDTV
/// applications", J. Korean Phys. Soc. 41, 2002), and that of daylight above (CIE 15:2004).
fn chromaticity(kelvin: f64) -> (f64, f64) {
    let t = 1e3 / kelvin;
    let cubic = |[a, b, c, d]: [f64; 4], x: f64| ((a * x + b) * x + c) * x + d;
    if kelvin >= 4000.0 {
        let x = match kelvin <= 7000.0 {
            true => cubic([-4.6070, 2.9678, 0.099_11, 0.244_063], t),
            false => cubic([-2.0064, 1.9018, 0.247_48, 0.237_040], t),
        };
        return (x, cubic([0.0, -3.0, 2.870, -0.275], x));
    }
    let x = cubic([-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_910], t);
    // The curve for y below 2222 K is another one.
    let y = [-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67];
    (x, cubic(y, x))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chromaticities of CIE 15:2004: the illuminants D50, D65 and D75; A is a black body of 2856
    /// K.
    #[test]
    fn illuminants_have_their_published_chromaticities() {
        for (kelvin, x, y) in [
            (5003.0, 0.345_67, 0.358_50),
            (6504.0, 0.312_71, 0.329_02),
            (7504.0, 0.299_02, 0.314_85),
            (2856.0, 0.447_57, 0.407_45),
        ] {
            let (found_x, found_y) = chromaticity(kelvin);
            assert!((found_x - x).abs() < 6e-4, "{kelvin}: {found_x} {x}");
            assert!((found_y - y).abs() < 6e-4, "{kelvin}: {found_y} {y}");
        }
    }

    #[test]
    fn the_light_that_is_balanced_is_white_with_its_luminance() {
        for kelvin in [2500.0, 3200.0, 3999.0, 4001.0, 6504.0, 25_000.0] {
            let light = rgb_of(chromaticity(kelvin));
            let balance = WhiteBalance::of_kelvin(kelvin).unwrap();
            let seen = DVec3::from_array([0, 1, 2].map(|i| light[i] * balance.gain(i)));
            assert!((seen - DVec3::ONE).abs().max_element() < 1e-12);
            let luminance = DVec3::new(0.2126, 0.7152, 0.0722).dot(light);
            assert!((luminance - 1.0).abs() < 1e-3, "{kelvin}: {luminance}");
        }
        assert!(WhiteBalance::of_kelvin(2499.0).is_none());
        assert!(WhiteBalance::of_kelvin(f64::NAN).is_none());
        let daylight = WhiteBalance::of_kelvin(6504.0).unwrap();
        assert!((daylight.gains - DVec3::ONE).abs().max_element() < 2e-3);
    }
}
