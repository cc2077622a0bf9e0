//! Text of scene files: UTF-8, or Latin-1 where it is not that.

/// Text as the file has it; bytes that are not UTF-8 are Latin-1.
pub fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(s) => s.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}
