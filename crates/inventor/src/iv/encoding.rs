//! The encoding of text in scene files.

/// The characters of the bytes 0x80 to 0x9F in Windows-1252. The five that it leaves undefined are
/// the control characters of Latin-1, as in the WHATWG's Encoding Standard.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}',
    '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

/// The characters that a backslash before them makes a part of a string in quotes. Any other
/// backslash is kept, because files contain Windows paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Escapes {
    /// Quotes, as in Inventor and VRML 1.0. Such a string cannot end in a backslash.
    Quote,
    /// Quotes and backslashes, as in VRML97 and X3D.
    QuoteAndBackslash,
}

impl Escapes {
    /// Returns the escapes of a format, by whether its strings are those of VRML97 and X3D.
    pub(super) fn of(is_vrml97_or_x3d: bool) -> Self {
        match is_vrml97_or_x3d {
            true => Self::QuoteAndBackslash,
            false => Self::Quote,
        }
    }
}

/// Decodes bytes as UTF-8, or as Windows-1252, which contains Latin-1, if they are not valid UTF-8.
pub(super) fn text(bytes: &[u8]) -> String {
    text_of(bytes.to_vec())
}

/// Decodes bytes as [`text`] does. Valid UTF-8 is not copied.
pub(super) fn text_of(bytes: Vec<u8>) -> String {
    let character = |&byte: &u8| match byte {
        0x80..=0x9f => WINDOWS_1252[usize::from(byte - 0x80)],
        _ => char::from(byte),
    };
    String::from_utf8(bytes).unwrap_or_else(|e| e.as_bytes().iter().map(character).collect())
}

/// Decodes XML in UTF-16, which begins with a byte-order mark; `None` for other bytes.
pub(super) fn from_utf16(bytes: &[u8]) -> Option<String> {
    let number = match bytes.first_chunk()? {
        [0xff, 0xfe, b'<', 0] => u16::from_le_bytes,
        [0xfe, 0xff, 0, b'<'] => u16::from_be_bytes,
        _ => return None,
    };
    let units = bytes[2..].as_chunks().0.iter().map(|&unit| number(unit));
    let text = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
    Some(text.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_not_utf_8_are_windows_1252() {
        assert_eq!(text("Größe €".as_bytes()), "Größe €");
        assert_eq!(text(b"\x93Gr\xf6\xdfe\x94 \x80\x9d"), "“Größe” €\u{9d}");
    }
}
