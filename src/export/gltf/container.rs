//! Packs the JSON and the binary part of a file: as GLB, or as JSON with the bytes in it.

use super::schema::{Buffer, Root};
use crate::diag::{Diagnostic, Result};

/// How a file is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::export) enum Packing {
    /// JSON, with the binary part in it.
    Json,
    /// GLB.
    Binary,
}

/// Packs a file.
///
/// # Errors
/// Fails if a GLB file would have 4 GiB or more, which its header cannot say.
pub(super) fn pack(mut root: Root, bytes: Vec<u8>, packing: Packing) -> Result<Vec<u8>> {
    if !bytes.is_empty() {
        let uri = (packing == Packing::Json)
            .then(|| format!("data:application/octet-stream;base64,{}", base64(&bytes)));
        root.buffers = vec![Buffer {
            uri,
            byte_length: bytes.len(),
        }];
    }
    let mut json = serde_json::to_vec(&root).expect("numbers and strings are JSON");
    if packing == Packing::Json {
        json.push(b'\n');
        return Ok(json);
    }
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut padded = bytes;
    padded.resize(padded.len().next_multiple_of(4), 0);
    let chunks: [(&[u8], &[u8; 4]); 2] = [(&json, b"JSON"), (&padded, b"BIN\0")];
    let used = if padded.is_empty() { 1 } else { 2 };
    let length: usize = chunks[..used].iter().map(|(data, _)| data.len() + 8).sum();
    let Ok(length) = u32::try_from(length + 12) else {
        return Err(Diagnostic::beyond_limit(
            "the scene is larger than 4 GiB, the largest size of a GLB file",
        ));
    };
    let mut out = Vec::with_capacity(length as usize);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(length.to_le_bytes());
    for (data, kind) in &chunks[..used] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(*kind);
        out.extend(*data);
    }
    Ok(out)
}

/// Encodes bytes in base64 (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let at = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= three.len() {
                char::from(letter)
            } else {
                '='
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_has_the_values_of_the_standard() {
        for (text, code) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), code);
        }
    }
}
