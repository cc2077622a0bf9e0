//! Functions that parse and format the values of options.

use std::time::Duration;

use ivcam_base::math::{LengthUnit, Meters, Mm, parse_length};

/// The description of a positive number in messages.
pub(crate) const POSITIVE: &str = "a number greater than 0";

/// Sets a variable if there is a value.
pub(super) fn set<T>(slot: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *slot = value;
    }
}

/// Parses a finite number.
pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Parses a finite number greater than 0.
pub(crate) fn positive(word: &str) -> Option<f64> {
    finite(word).filter(|x| *x > 0.0)
}

/// Parses a fraction: `1%` or `0.01`.
pub(super) fn share(word: &str) -> Option<f64> {
    match word.strip_suffix('%') {
        Some(percent) => positive(percent.trim()).map(|p| p / 100.0),
        None => positive(word),
    }
}

/// Parses a duration: `30s`, `500ms`, `2m` or `1h`.
pub(crate) fn duration(word: &str) -> Option<Duration> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];
    let (number, unit) = units
        .iter()
        .find_map(|(name, unit)| Some((word.strip_suffix(name)?, *unit)))?;
    Duration::try_from_secs_f64(positive(number.trim())? * unit).ok()
}

/// Parses two numbers with an `x` between them: `360x240`.
pub(super) fn pair<T: std::str::FromStr>(word: &str) -> Option<(T, T)> {
    let (a, b) = word.split_once(['x', 'X', '×'])?;
    Some((a.trim().parse().ok()?, b.trim().parse().ok()?))
}

/// Parses a distance greater than 0. A number without a unit is in meters. Focus is pulled in the
/// reciprocal, which is infinite below 6e-309.
pub(crate) fn distance(word: &str) -> Option<Meters> {
    parse_length(word, LengthUnit::Meter)
        .map(Meters::from)
        .filter(|d| d.0 > 0.0 && d.0.recip().is_finite())
}

/// Returns the text that [`distance`] reads as exactly this distance. [`distance`] converts meters
/// to millimeters and back, which may round, so the text is in millimeters if that happens.
pub(super) fn distance_word(meters: Meters) -> String {
    let word = meters.0.to_string();
    if distance(&word) == Some(meters) {
        word
    } else {
        format!("{}mm", Mm::from(meters).0)
    }
}

/// Parses a length in millimeters, which may be negative.
pub(super) fn length(word: &str) -> Option<f64> {
    let length = parse_length(word, LengthUnit::Millimeter)?;
    length.0.is_finite().then_some(length.0)
}

/// Parses an angle of less than 90 degrees. Returns radians.
pub(super) fn angle(word: &str) -> Option<f64> {
    let degrees = finite(word.trim_end_matches("deg"))?;
    (degrees.abs() < 90.0).then(|| degrees.to_radians())
}

/// Returns an angle in degrees that [`f64::to_radians`] converts to exactly this one, if there is
/// one. The conversion rounds, so it tries a rounded number first, and then the neighbors.
pub(super) fn degrees(radians: f64) -> f64 {
    let exact = radians.to_degrees();
    let rounded = (exact * 1e6).round() / 1e6;
    let near = [rounded, exact, exact.next_up(), exact.next_down()];
    let same = near
        .into_iter()
        .find(|degrees| degrees.to_radians() == radians);
    same.unwrap_or(exact)
}

/// Returns the text of a switch.
pub(super) fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

/// Returns a value as text, or nothing if it is the default `usual`.
pub(super) fn unless_default<T: PartialEq>(
    value: T,
    usual: T,
    word: impl Fn(T) -> String,
) -> Vec<String> {
    if value == usual {
        Vec::new()
    } else {
        vec![word(value)]
    }
}

/// Returns an empty value for a switch that is on, or nothing.
pub(super) fn switch(on: bool) -> Vec<String> {
    if on { vec![String::new()] } else { Vec::new() }
}

/// Returns a value as text, or nothing if there is none.
pub(super) fn if_any<T>(value: Option<T>, word: impl Fn(T) -> String) -> Vec<String> {
    value.map(word).into_iter().collect()
}

/// Returns paths as text.
pub(super) fn paths(paths: &[std::path::PathBuf]) -> Vec<String> {
    paths.iter().map(|p| p.display().to_string()).collect()
}
