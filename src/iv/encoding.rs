//! Text of scene files: UTF-8, or Latin-1 where it is not that.

/// Text as the file has it; bytes that are not UTF-8 are Latin-1.
pub fn text(bytes: &[u8]) -> String {
    text_of(bytes.to_vec())
}

/// The same for bytes that are already in memory of their own.
pub fn text_of(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes)
        .unwrap_or_else(|e| e.as_bytes().iter().map(|&b| char::from(b)).collect())
}
