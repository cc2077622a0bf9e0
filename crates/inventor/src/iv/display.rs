//! Conversion between linear light and the values that a screen shows, by the curve of sRGB (IEC
//! 61966-2-1).

use glam::Vec3;

/// The name of the `MetadataBoolean` in the field `metadata` of a light whose intensity and
/// attenuation are of linear light, as glTF's are, and not of the levels of a screen.
pub const LINEAR_LIGHT: &str = "linear light";

/// Returns the linear light of a value of a screen. Above 1 the curve goes on as a power.
pub fn linear_of_display(value: f32) -> f32 {
    match value <= 0.04045 {
        true => value / 12.92,
        false => libm::powf((value + 0.055) / 1.055, 2.4),
    }
}

/// Returns the value of a screen of some linear light. It may be above 1.
pub fn display_of_linear(light: f32) -> f32 {
    match light <= 0.003_130_8 {
        true => light * 12.92,
        false => 1.055 * libm::powf(light, 1.0 / 2.4) - 0.055,
    }
}

/// Returns a color as a screen shows it.
pub(crate) fn display_color(light: Vec3) -> Vec3 {
    light.map(display_of_linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_the_same_after_both_conversions() {
        for step in 0..=1000 {
            let value = step as f32 / 500.0;
            let back = display_of_linear(linear_of_display(value));
            assert!((back - value).abs() < 2e-6, "{value}: {back}");
        }
        assert!((linear_of_display(0.5) - 0.214_041_1).abs() < 1e-6);
    }
}
