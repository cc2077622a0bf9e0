//! Sizes of memory as text, in powers of 1024.

/// The units of sizes with their powers of two, the smallest first.
pub(super) const UNITS: [(&str, u32); 5] =
    [("B", 0), ("kB", 10), ("MB", 20), ("GB", 30), ("TB", 40)];

/// Returns a size with two or three digits in the largest unit that fits, as in `1.2 GB`.
pub fn size_text(bytes: u64) -> String {
    let fits = |(_, power): &&(&str, u32)| bytes >> power > 0;
    let (unit, power) = UNITS.iter().rev().find(fits).unwrap_or(&UNITS[0]);
    let value = bytes as f64 / (1u64 << power) as f64;
    let digits = usize::from(value < 9.95 && *power > 0);
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_the_largest_unit_that_fits() {
        let sizes = [
            0,
            1023,
            1024,
            10_188,
            261 << 10,
            5 << 29,
            40 << 30,
            u64::MAX,
        ];
        let texts = sizes.map(size_text);
        let expected = [
            "0 B",
            "1023 B",
            "1.0 kB",
            "9.9 kB",
            "261 kB",
            "2.5 GB",
            "40 GB",
            "16777216 TB",
        ];
        assert_eq!(texts, expected);
    }
}
