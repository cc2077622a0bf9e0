//! The parts of a glTF file: JSON alone, or a GLB file with JSON and a binary chunk.

use ivcam_base::diag::{Diagnostic, ErrorKind, Result, Sink, Span};

use super::schema::Root;
use crate::iv::read::header::without_mark;

/// The JSON and the binary chunk of a file.
pub(super) struct GltfFile<'b> {
    pub(super) root: Root,
    pub(super) chunk: Option<&'b [u8]>,
}

/// Reads the parts of a file.
///
/// # Errors
/// Returns an error if the JSON is damaged, or is not glTF 2.
pub(super) fn container<'b>(sink: &mut Sink, bytes: &'b [u8]) -> Result<GltfFile<'b>> {
    let (json, start, chunk) = match bytes.starts_with(b"glTF") {
        true => chunks(sink, bytes)?,
        false => (bytes, 0, None),
    };
    let json = without_mark(json);
    let root: Root = serde_json::from_slice(json).map_err(|error| {
        let line_start: usize = json
            .split_inclusive(|&b| b == b'\n')
            .take(error.line().saturating_sub(1))
            .map(<[u8]>::len)
            .sum();
        let at = start + line_start + error.column().saturating_sub(1);
        let what = error.to_string();
        let what = what
            .split(" at line ")
            .next()
            .unwrap_or_default()
            .to_owned();
        damaged(
            sink,
            at.min(bytes.len()),
            format!("the JSON of this glTF file: {what}"),
        )
    })?;
    let version = root
        .asset
        .get("version")
        .and_then(|v| v.as_str())
        .unwrap_or_default();
    if !version.starts_with("2.") && version != "2" {
        let message = format!("glTF {version} is not read");
        let error = sink
            .error(Span::at(start), message)
            .of_kind(ErrorKind::Unsupported);
        return Err(error.with_help("glTF 2.0 is read; most programs can write it"));
    }
    Ok(GltfFile { root, chunk })
}

fn damaged(sink: &Sink, at: usize, message: String) -> Box<Diagnostic> {
    sink.error(Span::at(at), message)
        .of_kind(ErrorKind::Damaged)
}

/// The JSON of a GLB file, its offset, and the binary chunk.
type Chunks<'b> = (&'b [u8], usize, Option<&'b [u8]>);

/// Finds the chunks of a GLB file: 12 bytes, then each chunk after its length and its type.
fn chunks<'b>(sink: &mut Sink, bytes: &'b [u8]) -> Result<Chunks<'b>> {
    let number = |at: usize| {
        let bytes = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes))
    };
    if let Some(version) = number(4).filter(|version| *version != 2) {
        let error = sink.error(Span::at(4), format!("version {version} of GLB is not read"));
        return Err(error.of_kind(ErrorKind::Unsupported));
    }
    let (mut at, mut json, mut chunk) = (12, None, None);
    while let (Some(length), Some(kind)) = (number(at), number(at + 4)) {
        let end = (at + 8).saturating_add(length as usize);
        if end > bytes.len() {
            sink.damage(Span::at(at), "the file ends inside a chunk");
        }
        let content = &bytes[at + 8..end.min(bytes.len())];
        match kind {
            0x4e4f_534a if json.is_none() => json = Some((content, at + 8)),
            0x004e_4942 if chunk.is_none() => chunk = Some(content),
            _ => {}
        }
        at = end;
    }
    let missing = || damaged(sink, 12.min(bytes.len()), "the GLB file has no JSON".into());
    let (json, start) = json.ok_or_else(missing)?;
    Ok((json, start, chunk))
}
