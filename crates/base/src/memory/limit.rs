//! The user's choice of how much memory a scene may use.

use std::fmt;

use super::machine::memory_of_machine;
use super::size::UNITS;

/// The share of the machine's memory that a scene may use by default. The rest is for the program
/// itself, the file as it is read, and other programs.
const DEFAULT_SHARE: f64 = 0.5;

/// How much memory a scene, with its textures and its film, may use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum MemoryLimit {
    /// Half of the memory that the machine, or the container, has.
    #[default]
    Machine,
    /// A number of bytes.
    Bytes(u64),
    /// A share of the machine's memory, above 0 and at most 1.
    Share(f64),
}

impl MemoryLimit {
    /// Parses text such as `4GB`, `512M`, `1.5GiB` or `50%`. The units mean powers of 1024. Returns
    /// `None` if the text is neither a size nor a share.
    pub fn parse(word: &str) -> Option<Self> {
        let end = word.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let (number, unit) = word.split_at(end);
        let number: f64 = number.parse().ok()?;
        if unit == "%" {
            let is_share = number > 0.0 && number <= 100.0;
            return is_share.then_some(Self::Share(number / 100.0));
        }
        let unit = unit.trim().to_ascii_lowercase().replace("ib", "b");
        let is_named = |name: &str| {
            let name = name.to_ascii_lowercase();
            unit == name || name.strip_suffix('b') == Some(unit.as_str())
        };
        let (_, power) = UNITS.iter().find(|(name, _)| is_named(name))?;
        let bytes = number * (1u64 << power) as f64;
        (1.0..9e18)
            .contains(&bytes)
            .then_some(Self::Bytes(bytes as u64))
    }

    /// Returns the number of bytes.
    pub fn bytes(self) -> u64 {
        let share = match self {
            Self::Bytes(bytes) => return bytes,
            Self::Share(share) => share,
            Self::Machine => DEFAULT_SHARE,
        };
        (memory_of_machine() as f64 * share) as u64
    }

    /// Returns the limit of each of several scenes that are in memory at the same time.
    pub fn for_each_of(self, scenes: usize) -> Self {
        match scenes {
            0 | 1 => self,
            _ => Self::Bytes(self.bytes() / scenes as u64),
        }
    }
}

impl fmt::Display for MemoryLimit {
    /// Writes text that [`MemoryLimit::parse`] reads back, and nothing for the default.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Machine => Ok(()),
            Self::Share(share) => write!(f, "{}%", 100.0 * share),
            Self::Bytes(bytes) => {
                let is_whole = |(_, power): &&(&str, u32)| bytes % (1 << power) == 0;
                let (unit, power) = UNITS.iter().rev().find(is_whole).unwrap_or(&UNITS[0]);
                write!(f, "{}{unit}", bytes >> power)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_size_or_a_share_of_the_machine() {
        let sizes = [
            ("4GB", 4 << 30),
            ("512M", 512 << 20),
            ("1.5GiB", 3 << 29),
            ("100kb", 100 << 10),
            ("12B", 12),
        ];
        for (word, bytes) in sizes {
            let limit = MemoryLimit::parse(word);
            assert_eq!(limit, Some(MemoryLimit::Bytes(bytes)), "{word}");
            let written = limit.map(|l| l.to_string()).unwrap_or_default();
            assert_eq!(MemoryLimit::parse(&written), limit, "{written}");
        }
        assert_eq!(MemoryLimit::parse("50%"), Some(MemoryLimit::Share(0.5)));
        assert_eq!(MemoryLimit::Share(0.25).to_string(), "25%");
        for word in [
            "",
            "4",
            "GB",
            "0GB",
            "-1GB",
            "4XB",
            "0%",
            "101%",
            "1e3GB",
            "9999999TB",
        ] {
            assert_eq!(MemoryLimit::parse(word), None, "{word}");
        }
    }

    #[test]
    fn the_default_is_half_of_the_machine_and_scenes_at_one_time_share_it() {
        let half = MemoryLimit::default().bytes();
        assert_eq!(half, MemoryLimit::Share(0.5).bytes());
        assert!(half >= 1 << 20);
        let of_four = MemoryLimit::Bytes(4 << 20).for_each_of(4);
        assert_eq!(of_four, MemoryLimit::Bytes(1 << 20));
        assert_eq!(MemoryLimit::Machine.for_each_of(1), MemoryLimit::Machine);
    }
}
