//! The user's choice of how much work a scene may cause.

use std::fmt;

/// The number of steps that a scene may cause, with its unit of text: see [`crate::work`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkLimit(pub u64);

/// The suffixes of numbers of steps, the smallest first.
const SUFFIXES: [(&str, u64); 4] = [
    ("k", 1_000),
    ("M", 1_000_000),
    ("G", 1_000_000_000),
    ("T", 1_000_000_000_000),
];

/// One ray may take the steps of the scene divided by this number: 3,814 with the usual limit. Rays
/// through forests of 160,000 groves with 256 leaves each take less than 500.
const RAYS: u64 = 1 << 18;

impl Default for WorkLimit {
    /// Returns 1G steps, some seconds of one processor.
    fn default() -> Self {
        Self(1_000_000_000)
    }
}

impl WorkLimit {
    /// Parses text such as `500M`, `2G` or `1000`; the suffixes k, M, G and T mean powers of 1000.
    /// Returns `None` if the text is not a number of steps above 0.
    pub fn parse(word: &str) -> Option<Self> {
        let is_suffix = |(suffix, _): &&(&str, u64)| word.ends_with(suffix);
        let (suffix, factor) = SUFFIXES.iter().find(is_suffix).unwrap_or(&("", 1));
        let number: f64 = word.strip_suffix(suffix)?.parse().ok()?;
        let steps = number * *factor as f64;
        (1.0..9e18).contains(&steps).then_some(Self(steps as u64))
    }

    /// Returns the number of steps that one ray may take between shared parts of a scene.
    pub fn of_ray(self) -> u64 {
        (self.0 / RAYS).max(1)
    }
}

impl fmt::Display for WorkLimit {
    /// Writes text that [`WorkLimit::parse`] reads back.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_whole = |(_, factor): &&(&str, u64)| self.0.is_multiple_of(*factor);
        let (suffix, factor) = SUFFIXES.iter().rev().find(is_whole).unwrap_or(&("", 1));
        write!(f, "{}{suffix}", self.0 / factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_number_with_a_suffix() {
        for (word, steps) in [("1000", 1000), ("2.5k", 2500), ("30M", 30_000_000)] {
            let limit = WorkLimit::parse(word);
            assert_eq!(limit, Some(WorkLimit(steps)), "{word}");
            let written = limit.map(|l| l.to_string()).unwrap_or_default();
            assert_eq!(WorkLimit::parse(&written), limit, "{written}");
        }
        assert_eq!(WorkLimit(4_000_000_000).to_string(), "4G");
        for word in ["", "G", "0", "-1G", "1X", "1e30", "nan"] {
            assert_eq!(WorkLimit::parse(word), None, "{word}");
        }
    }
}
