//! Exposure by shutter time, ISO speed and aperture, instead of the paper's constant.
//!
//! Radiance in scenes is in Inventor's units, where 1 is a white surface in full light. One number
//! states how many candela per square meter that is; the rest is photometry. Film of ISO S is
//! saturated (level 1) by H = 78/S lux seconds (ISO 12232, saturation-based speed), where H is the
//! irradiance of the paper's equation 1, with the solid angle and the losses of the glass, times
//! the shutter time.

use std::f64::consts::PI;

/// The exposure that saturates a film of ISO 1, in lux seconds (ISO 12232).
const SATURATION: f64 = 78.0;

/// The settings that determine the exposure together with the aperture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// The time that the shutter is open, in seconds.
    pub shutter: f64,
    /// The ISO speed of the film.
    pub iso: f64,
    /// The luminance of radiance 1, in candela per square meter.
    pub white: f64,
}

impl Metering {
    /// The luminance of a white surface in full sun, in cd/m², by the "sunny 16" rule: at f/16 and
    /// 1/ISO seconds it just saturates the film. π/(4·16²) L/S = 78/S gives 25,424 cd/m², an
    /// illuminance of 80,000 lux.
    pub const SUNLIT_WHITE: f64 = SATURATION * 1024.0 / PI;

    /// Returns the settings of a shutter time in seconds at ISO 100 in full sun.
    pub fn new(shutter: f64) -> Self {
        Self {
            shutter,
            iso: 100.0,
            white: Self::SUNLIT_WHITE,
        }
    }

    /// Returns the level of a white surface on the axis. `steradians` is the irradiance on the film
    /// for radiance 1: π/(4N²) for a distant scene.
    pub fn level_of_white(&self, steradians: f64) -> f64 {
        let lux_seconds = self.white * steradians * self.shutter;
        lux_seconds * self.iso / SATURATION
    }

    /// Returns the exposure value log₂(N²/t): f/16 and 1/125 s give 15. It does not depend on ISO.
    pub fn exposure_value(&self, f_number: f64) -> f64 {
        libm::log2(f_number * f_number / self.shutter)
    }

    /// Formats the shutter time as on a camera's dial: `1/60 s`, `2.5 s`.
    pub fn dial(&self) -> String {
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

    /// A stop is a factor of √2 in the f-number, or of 2 in the time or the ISO speed.
    #[test]
    fn a_stop_of_aperture_time_or_iso_doubles_the_level() {
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
