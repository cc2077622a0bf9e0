//! Exposure in a photographer's terms: shutter, ISO and aperture, instead of the paper's constant.
//!
//! Scenes are in Inventor's units, where 1 is a white surface in full light. One number says how
//! many candela per square meter that is; the rest is photometry. Film of ISO S is saturated,
//! level 1, by H = 78/S lux seconds (ISO 12232, saturation-based speed), and H is the irradiance
//! of equation 1, with the solid angle and the glass's losses, times the shutter's time.

use std::f64::consts::PI;

/// Lux seconds that saturate a film of ISO 1.
const SATURATION: f64 = 78.0;

/// What a photographer sets beside the aperture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Seconds that the shutter is open.
    pub shutter: f64,
    pub iso: f64,
    /// Candela per square meter of radiance 1.
    pub white: f64,
}

impl Metering {
    /// The luminance of a white surface in full sun, in cd/m², from the rule of photographers: at
    /// f/16 and 1/ISO seconds it is just white. π/(4·16²) L/S = 78/S gives 25,424, which is a
    /// sun of 80,000 lux.
    pub const SUNLIT_WHITE: f64 = SATURATION * 1024.0 / PI;

    pub fn new(shutter: f64) -> Self {
        Self {
            shutter,
            iso: 100.0,
            white: Self::SUNLIT_WHITE,
        }
    }

    /// The level of white on the axis, for a lens that brings it an irradiance of so many
    /// steradians from radiance 1: π/(4N²) for a distant scene.
    pub(crate) fn level_of_white(&self, steradians: f64) -> f64 {
        let lux_seconds = self.white * steradians * self.shutter;
        lux_seconds * self.iso / SATURATION
    }

    /// The exposure value of the settings, log₂ N²/t: 15 is f/16 and 1/125 s. No ISO is in it.
    pub fn exposure_value(&self, f_number: f64) -> f64 {
        libm::log2(f_number * f_number / self.shutter)
    }

    /// The time as a camera's dial writes it.
    pub(crate) fn dial(&self) -> String {
        let t = self.shutter;
        if t < 0.3 {
            format!("1/{} s", (100.0 / t).round() / 100.0)
        } else {
            format!("{} s", (1e4 * t).round() / 1e4)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_f16_and_one_over_iso_a_white_surface_in_the_sun_is_just_white() {
        for iso in [25.0, 100.0, 400.0] {
            let metering = Metering {
                iso,
                ..Metering::new(1.0 / iso)
            };
            let steradians = PI / (4.0 * 16.0 * 16.0);
            assert!((metering.level_of_white(steradians) - 1.0).abs() < 1e-14);
        }
        assert!((Metering::SUNLIT_WHITE - 25_424.0).abs() < 1.0);
    }

    /// A stop more of aperture, a stop less of time, or twice the ISO.
    #[test]
    fn a_stop_is_a_factor_of_two_whichever_way_it_is_made() {
        let at = |n: f64, shutter: f64, iso: f64| {
            let metering = Metering {
                iso,
                ..Metering::new(shutter)
            };
            metering.level_of_white(PI / (4.0 * n * n))
        };
        let base = at(8.0, 1.0 / 60.0, 100.0);
        for other in [
            at(8.0 / 2f64.sqrt(), 1.0 / 60.0, 100.0),
            at(8.0, 1.0 / 30.0, 100.0),
            at(8.0, 1.0 / 60.0, 200.0),
        ] {
            assert!((other / base - 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_exposure_value_is_the_one_of_the_tables() {
        let ev = Metering::new(1.0 / 125.0).exposure_value(16.0);
        assert!((ev - 14.966).abs() < 1e-3, "{ev}");
        assert_eq!(Metering::new(1.0).exposure_value(1.0), 0.0);
        assert_eq!(Metering::new(1.0 / 60.0).dial(), "1/60 s");
        assert_eq!(Metering::new(2.5).dial(), "2.5 s");
    }
}
