//! TIFF pictures, and TIFF directories, of which a JPEG's EXIF data consist.
//!
//! Numbers are big-endian. Pictures are not compressed and have one strip. `ImageDescription` is
//! the command and `Software` the program.

use std::io::Write;

use indexmap::IndexMap;

use super::developed::{Depth, Picture};
use super::rows::{Heading, PictureRows, RowSource, write_levels};

/// The largest texts of a JPEG file, whose segments have at most 65,533 bytes.
const EXIF_TEXT: usize = 30_000;

/// The header: big-endian, and the directory follows.
const HEADER: &[u8] = b"MM\0*\0\0\0\x08";

/// An entry of a directory. Its values are in the file's order of bytes.
struct TagEntry {
    tag: u16,
    kind: u16,
    count: u32,
    values: Vec<u8>,
}

impl TagEntry {
    fn text(tag: u16, text: &str) -> Self {
        let mut values = text.as_bytes().to_vec();
        values.push(0);
        Self {
            tag,
            kind: 2,
            count: values.len() as u32,
            values,
        }
    }

    fn shorts(tag: u16, values: &[u16]) -> Self {
        Self {
            tag,
            kind: 3,
            count: values.len() as u32,
            values: values.iter().flat_map(|v| v.to_be_bytes()).collect(),
        }
    }

    fn long(tag: u16, value: u32) -> Self {
        Self {
            tag,
            kind: 4,
            count: 1,
            values: value.to_be_bytes().to_vec(),
        }
    }

    /// A number of pixels, in the shortest form: some programs read no other.
    fn size(tag: u16, pixels: u32) -> Self {
        match u16::try_from(pixels) {
            Ok(short) => Self::shorts(tag, &[short]),
            Err(_) => Self::long(tag, pixels),
        }
    }

    fn rational(tag: u16, [over, under]: [u32; 2]) -> Self {
        Self {
            tag,
            kind: 5,
            count: 1,
            values: [over.to_be_bytes(), under.to_be_bytes()].concat(),
        }
    }
}

/// Returns the bytes of a header and a directory. Values longer than four bytes follow it.
fn directory(mut entries: Vec<TagEntry>) -> Vec<u8> {
    entries.sort_by_key(|entry| entry.tag);
    let mut out = HEADER.to_vec();
    out.extend((entries.len() as u16).to_be_bytes());
    let after = out.len() + 12 * entries.len() + 4;
    let mut long: Vec<u8> = Vec::new();
    for mut entry in entries {
        out.extend(entry.tag.to_be_bytes());
        out.extend(entry.kind.to_be_bytes());
        out.extend(entry.count.to_be_bytes());
        if entry.values.len() <= 4 {
            // Values this short take the place of their address.
            entry.values.resize(4, 0);
            out.extend(entry.values);
            continue;
        }
        if long.len() % 2 == 1 {
            long.push(0); // Addresses are even.
        }
        out.extend(((after + long.len()) as u32).to_be_bytes());
        long.extend(entry.values);
    }
    out.extend([0; 4]); // There is no further directory.
    out.extend(long);
    out
}

/// Returns the entries of a provenance's command and program, of texts up to a length.
fn texts(provenance: &IndexMap<String, String>, longest: usize) -> Vec<TagEntry> {
    let text = |(tag, key)| {
        let text = provenance.get(key).filter(|t| t.len() <= longest);
        text.map(|text| TagEntry::text(tag, text))
    };
    let entries = [(0x010e, "Command"), (0x0131, "Software")];
    entries.into_iter().filter_map(text).collect()
}

/// Returns a picture's EXIF data: a header and one directory.
pub(super) fn exif(picture: &Picture) -> Vec<u8> {
    directory(texts(&picture.provenance, EXIF_TEXT))
}

/// Writes a picture.
///
/// # Errors
/// Returns the errors of [`write_rows`].
pub(super) fn write(picture: &Picture, depth: Depth, to: &mut dyn Write) -> std::io::Result<()> {
    let (heading, mut rows) = PictureRows::of(picture);
    write_rows(&heading, depth, &mut rows, to)
}

/// Writes a picture while its rows are made. It has no place for a late entry.
///
/// # Errors
/// Fails if the stream does, the rows cannot be made, and for a picture of more than 4 GB, which
/// the format cannot hold.
pub(super) fn write_rows(
    heading: &Heading,
    depth: Depth,
    rows: &mut dyn RowSource,
    to: &mut dyn Write,
) -> std::io::Result<()> {
    let bits: u16 = match depth {
        Depth::Eight => 8,
        Depth::Sixteen => 16,
    };
    let size = heading.resolution;
    let bytes = 3 * size.pixels() as u64 * u64::from(bits / 8);
    let head = |strip: u32| {
        let mut entries = texts(&heading.provenance, usize::MAX);
        entries.extend([
            TagEntry::size(0x0100, size.width),
            TagEntry::size(0x0101, size.height),
            TagEntry::shorts(0x0102, &[bits; 3]),
            TagEntry::shorts(0x0103, &[1]), // no compression
            TagEntry::shorts(0x0106, &[2]), // red, green, blue
            TagEntry::long(0x0111, strip),
            TagEntry::shorts(0x0115, &[3]), // samples per pixel
            TagEntry::size(0x0116, size.height),
            TagEntry::long(0x0117, bytes as u32),
            TagEntry::rational(0x011a, [72, 1]),
            TagEntry::rational(0x011b, [72, 1]),
            TagEntry::shorts(0x0128, &[2]), // the resolution is per inch
        ]);
        let mut head = directory(entries);
        head.resize(head.len().next_multiple_of(2), 0);
        head
    };
    let length = head(0).len();
    if u32::try_from(length as u64 + bytes).is_err() {
        let error = "a TIFF file can't be larger than 4 GB; write .png or .exr";
        return Err(std::io::Error::other(error));
    }
    to.write_all(&head(length as u32))?;
    write_levels(heading, depth, rows, to)
}
