//! How single values are read and written.

use std::time::Duration;

use crate::math::{LengthUnit, Meters, Mm, parse_length};

pub(super) const POSITIVE: &str = "a number greater than 0";

pub(super) fn set<T>(slot: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *slot = value;
    }
}

pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

pub(super) fn positive(word: &str) -> Option<f64> {
    finite(word).filter(|x| *x > 0.0)
}

/// `1%` or `0.01`.
pub(super) fn share(word: &str) -> Option<f64> {
    match word.strip_suffix('%') {
        Some(percent) => positive(percent.trim()).map(|p| p / 100.0),
        None => positive(word),
    }
}

/// `30s`, `500ms`, `2m` or `1h`.
pub(super) fn duration(word: &str) -> Option<Duration> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];
    let (number, unit) = units
        .iter()
        .find_map(|(name, unit)| Some((word.strip_suffix(name)?, *unit)))?;
    Duration::try_from_secs_f64(positive(number.trim())? * unit).ok()
}

/// `360x240`.
pub(super) fn pair<T: std::str::FromStr>(word: &str) -> Option<(T, T)> {
    let (a, b) = word.split_once(['x', 'X', '×'])?;
    Some((a.trim().parse().ok()?, b.trim().parse().ok()?))
}

/// A distance greater than 0; a bare number is meters.
pub(super) fn distance(word: &str) -> Option<Meters> {
    parse_length(word, LengthUnit::Meter)
        .filter(|l| l.0 > 0.0)
        .map(Meters::from)
}

/// The word that [`distance`] reads as this distance. Meters pass through millimeters there, which
/// may round.
pub(super) fn distance_word(meters: Meters) -> String {
    let word = meters.0.to_string();
    if distance(&word) == Some(meters) {
        word
    } else {
        format!("{}mm", Mm::from(meters).0)
    }
}

/// A length in millimeters, which may be negative.
pub(super) fn length(word: &str) -> Option<f64> {
    let length = parse_length(word, LengthUnit::Millimeter)?;
    length.0.is_finite().then_some(length.0)
}

/// An angle in degrees, less than 90, as radians.
pub(super) fn angle(word: &str) -> Option<f64> {
    let degrees = finite(word.trim_end_matches("deg"))?;
    (degrees.abs() < 90.0).then(|| degrees.to_radians())
}

/// Radians as degrees, to a millionth.
pub(super) fn degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e6).round() / 1e6
}

pub(super) fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

/// The value if it is not the usual one.
pub(super) fn unless_usual<T: PartialEq>(
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

/// A switch that is on.
pub(super) fn switch(on: bool) -> Vec<String> {
    if on { vec![String::new()] } else { Vec::new() }
}

/// The value if there is one.
pub(super) fn if_any<T>(value: Option<T>, word: impl Fn(T) -> String) -> Vec<String> {
    value.map(word).into_iter().collect()
}

/// The paths as words.
pub(super) fn paths(paths: &[std::path::PathBuf]) -> Vec<String> {
    paths.iter().map(|p| p.display().to_string()).collect()
}
