//! Places in a translated text and in the XML that it was made from.

use ivcam_base::diag::Span;

/// The place in the XML of each part of a text.
#[derive(Default)]
pub(super) struct Places {
    /// The offset of each part in the text, its offset in the XML, and its length if it is a copy,
    /// in the order of the text.
    parts: Vec<(u32, u32, u32)>,
}

impl Places {
    /// Records that the text from an offset on was made from the XML at another. The first `copied`
    /// bytes are the same in both.
    pub(super) fn add(&mut self, text: usize, xml: usize, copied: usize) {
        let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        self.parts.push((narrow(text), narrow(xml), narrow(copied)));
    }

    /// Returns the range of the XML of a range of the text.
    pub(super) fn in_xml(&self, span: Span) -> Span {
        let start = self.at(span.start);
        Span {
            start,
            end: self.at(span.end).max(start),
        }
    }

    fn at(&self, offset: u32) -> u32 {
        let after = self.parts.partition_point(|part| part.0 <= offset);
        match after.checked_sub(1).map(|place| self.parts[place]) {
            Some((text, xml, copied)) => xml.saturating_add((offset - text).min(copied)),
            None => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copied_part_has_a_place_for_each_byte_and_others_have_one() {
        let mut places = Places::default();
        places.add(10, 100, 5);
        places.add(20, 200, 0);
        let at = |n| {
            places
                .in_xml(Span {
                    start: n,
                    end: n + 1,
                })
                .start
        };
        assert_eq!(
            [0, 10, 12, 17, 20, 29].map(at),
            [0, 100, 102, 105, 200, 200]
        );
    }
}
