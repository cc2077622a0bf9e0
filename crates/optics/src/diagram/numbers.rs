//! Formats numbers for scales and tables.

/// Returns a round number near a size: 1, 2 or 5 times a power of ten.
pub(crate) fn round_number(size: f64) -> f64 {
    if !(size > 0.0 && size.is_finite()) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(size)));
    let lead = size / power;
    power
        * match lead {
            l if l < 1.5 => 1.0,
            l if l < 3.5 => 2.0,
            l if l < 7.5 => 5.0,
            _ => 10.0,
        }
}

/// Formats a number with the decimals of a step, and a typographic minus sign.
pub(crate) fn tidy(value: f64, step: f64) -> String {
    if value.is_infinite() {
        return "\u{221e}".to_owned();
    }
    let places = (-libm::floor(libm::log10(step.abs().max(1e-12)) + 1e-9)).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.places$}");
    let zero = text
        .trim_start_matches('-')
        .chars()
        .all(|c| c == '0' || c == '.');
    match text.strip_prefix('-') {
        Some(rest) if !zero => format!("\u{2212}{rest}"),
        Some(rest) => rest.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_scales_are_round() {
        assert_eq!(round_number(0.0123), 0.01);
        assert_eq!(round_number(37.0), 50.0);
        assert_eq!(round_number(2.2e3), 2e3);
        assert_eq!(tidy(-0.5, 0.25), "\u{2212}0.5");
        assert_eq!(tidy(-0.04, 0.1), "0.0");
        assert_eq!(tidy(20.0, 10.0), "20");
    }
}
