//! The encoding of text in scene files.

/// Decodes UTF-8, or Latin-1 where the bytes are not UTF-8.
pub(super) fn text(bytes: &[u8]) -> String {
    text_of(bytes.to_vec())
}

/// Decodes like [`text`], in the memory that the bytes are in if they are UTF-8.
pub(super) fn text_of(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes)
        .unwrap_or_else(|e| e.as_bytes().iter().map(|&b| char::from(b)).collect())
}
