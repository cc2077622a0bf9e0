//! The end of a JPEG file (ITU-T T.81, annex B).

/// The marker EOI.
pub(super) const END: [u8; 2] = [0xff, 0xd9];

/// Returns whether the end marker follows the segments and scans of a file.
pub(super) fn has_end(bytes: &[u8]) -> bool {
    let mut rest = bytes;
    loop {
        // In the data of a scan, FF 00 is a byte and D0 to D7 are restarts. FF fills, 01 and D8
        // (SOI) begin no segment.
        let is_marker =
            |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0x00 | 0x01 | 0xd0..=0xd8 | 0xff);
        let Some(at) = rest.windows(2).position(is_marker) else {
            return false;
        };
        if rest[at..].starts_with(&END) {
            return true;
        }
        let length = rest.get(at + 2..).and_then(|after| after.first_chunk());
        let Some(length) = length.map(|&length| usize::from(u16::from_be_bytes(length))) else {
            return false;
        };
        rest = rest.get(at + 2 + length..).unwrap_or_default();
    }
}
