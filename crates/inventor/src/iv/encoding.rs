//! The encoding of text in scene files.

/// Decodes bytes as UTF-8, or as Latin-1 if they are not valid UTF-8.
pub(super) fn text(bytes: &[u8]) -> String {
    text_of(bytes.to_vec())
}

/// Decodes bytes as [`text`] does. Valid UTF-8 is not copied.
pub(super) fn text_of(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes)
        .unwrap_or_else(|e| e.as_bytes().iter().map(|&b| char::from(b)).collect())
}
