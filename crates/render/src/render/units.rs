//! The units in which the samples of a pixel are added.
//!
//! Floating-point sums depend on their order. The samples of a unit are added one by one, and the
//! sums of the units are folded in their order. So the units of a picture can be rendered anywhere,
//! and have the bits of one render after they are folded.

use std::ops::Range;

/// The number of samples in each of the first units.
const FIRST: u32 = 64;
/// Later units have this part of the power of two below their samples' numbers, so that a long
/// render has few units and a picture of 2^k samples can be divided into 16 equal parts.
const PART: u32 = 8;

/// Returns the number of samples of the unit that contains a sample.
fn size(sample: u32) -> u32 {
    let power = 1 << sample.max(1).ilog2();
    FIRST.max(power / PART)
}

/// Returns the first sample of the unit that contains a sample.
pub fn border_before(sample: u32) -> u32 {
    sample / size(sample) * size(sample)
}

/// Returns the first sample of the unit after the one that contains a sample.
pub fn border_after(sample: u32) -> u32 {
    border_before(sample) + size(sample)
}

/// Returns whether a sample is the first of its unit.
pub fn is_border(sample: u32) -> bool {
    border_before(sample) == sample
}

/// Cuts a range of samples at the borders of units.
pub fn pieces(samples: &Range<u32>) -> impl Iterator<Item = Range<u32>> {
    let Range { mut start, end } = *samples;
    std::iter::from_fn(move || {
        let piece = start..border_after(start).min(end);
        start = piece.end;
        (!piece.is_empty()).then_some(piece)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_follow_each_other_and_sixteen_equal_parts_end_at_borders() {
        for end in [1, 63, 64, 65, 1000, 1024, 1025, 1 << 16, 1 << 24] {
            let pieces: Vec<Range<u32>> = pieces(&(0..end)).collect();
            assert!(pieces.windows(2).all(|w| w[0].end == w[1].start));
            assert!(pieces.iter().all(|p| is_border(p.start)));
            assert_eq!(pieces.last().unwrap().end, end);
            assert!(pieces.len() <= 16 + 8 * 14, "{}", pieces.len());
        }
        for power in 10..24 {
            assert!((0..=16).all(|i| is_border(i << (power - 4))));
        }
        assert!(!is_border(100) && is_border(192) && !is_border(1088));
        assert_eq!(
            pieces(&(100..200)).collect::<Vec<_>>(),
            [100..128, 128..192, 192..200]
        );
    }
}
