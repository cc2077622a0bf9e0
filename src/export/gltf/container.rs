//! Packs the JSON and the binary part of a file: as GLB, or as JSON with the bytes in it.

use ivcam_base::diag::{Diagnostic, Result};

use super::schema::{Buffer, Root};
use crate::export::base64::base64;

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
