//! Reads one file into a document, which may already contain others.

use std::sync::Arc;

use ivcam_base::diag::{Result, Source};
use ivcam_base::files::FileBytes;

use super::assemble::{Assembler, FileRead};
use super::header::{self, Encoding, Header, without_mark};
use super::{ascii, binary, formats, upgrade};
use crate::iv::document::Document;
use crate::iv::encoding;
use crate::iv::limits::Limits;

/// Reads one file into a document, which may already contain others. `otherwise` is used if the
/// file has no header.
///
/// # Errors
/// Returns an error if the file has no header and `otherwise` is `None`, if it cannot be
/// decompressed, or if a limit is exceeded.
pub(super) fn read_into(
    document: &mut Document,
    name: &str,
    bytes: FileBytes,
    limits: &Limits,
    otherwise: Option<Header>,
) -> Result<FileRead> {
    let is_gzipped = bytes.starts_with(&header::GZIP);
    let (bytes, damage) = header::unpack(bytes, name, limits)?;
    let bytes = match encoding::from_utf16(&bytes) {
        Some(text) => FileBytes::Read(text.into_bytes()),
        None => bytes,
    };
    let header = match (Header::parse(&bytes, name), otherwise) {
        (Ok(header), _) => header,
        (Err(_), Some(header)) => Header {
            length: bytes.len() - without_mark(&bytes).len(),
            ..header
        },
        (Err(error), None) => return Err(error),
    };
    if document.sources.is_empty() {
        document.format = header.words.clone();
        document.is_gzipped = is_gzipped;
    }
    let is_binary = header.encoding.is_binary(&bytes);
    // A large file is not kept: its text is read again if a message quotes it.
    let (mut source, file): (_, Option<FileBytes>) = match bytes {
        FileBytes::Read(bytes) => (Source::new(name, bytes), None),
        #[cfg(target_os = "linux")]
        FileBytes::Mapped(_) => (Source::on_disk(name, bytes.len()), Some(bytes)),
    };
    if is_binary {
        source = source.into_binary();
    }
    let source = Arc::new(source);
    let before = document.sink.set_source(Some(source.clone()));
    if let Some(damage) = damage {
        document.sink.add(*damage);
    }
    let first_node = document.nodes.len();
    document.sources.push(source.clone());
    if header.multiplies_textures() {
        document
            .multiplying
            .insert(document.sources.len() as u16 - 1);
    }
    let encoding = header.encoding;
    let bytes = file.as_deref().unwrap_or(&source.bytes);
    let mut assembler = Assembler::new(document, header, limits, read_into);
    assembler.file = file.as_ref();
    let roots = match encoding {
        Encoding::Text => ascii::read(&mut assembler, bytes),
        Encoding::Binary => binary::read(&mut assembler, bytes),
        Encoding::Xml => formats::x3d::read(&mut assembler, bytes),
        Encoding::Obj => formats::obj::read(&mut assembler, bytes),
        Encoding::Ply => formats::ply::read(&mut assembler, bytes),
        Encoding::Stl => formats::stl::read(&mut assembler, bytes),
        Encoding::Gltf => formats::gltf::read(&mut assembler, bytes),
    };
    let old = std::mem::take(&mut assembler.old);
    let header = assembler.header.clone();
    let declared = std::mem::take(&mut assembler.declared);
    let roots = roots?;
    upgrade::upgrade(document, &header, first_node, old);
    document.sink.set_source(before);
    Ok(FileRead { roots, declared })
}
