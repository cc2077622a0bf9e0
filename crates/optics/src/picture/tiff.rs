//! TIFF pictures, and TIFF directories, of which a JPEG's EXIF data consist.
//!
//! What is written is big-endian. Pictures are not compressed and have one strip.
//! `ImageDescription` is the command and `Software` the program.

use std::io::Write;

use indexmap::IndexMap;

use super::developed::{Depth, Picture};
use super::rows::{Heading, PictureRows, RowSource, write_levels};

/// The largest texts of a JPEG file, whose segments have at most 65,533 bytes.
const EXIF_TEXT: usize = 30_000;

/// The header: big-endian, and the directory follows.
const HEADER: &[u8] = b"MM\0*\0\0\0\x08";

/// The tag SampleFormat, and its value for numbers of IEEE 754 (TIFF 6.0, section 19).
pub(super) const SAMPLE_FORMAT: u16 = 0x0153;
pub(super) const FLOATING_POINT: u16 = 3;

/// The tag PhotometricInterpretation, and two of its values (TIFF 6.0, sections 4 and 5).
const PHOTOMETRIC_INTERPRETATION: u16 = 0x0106;
const BLACK_IS_ZERO: u16 = 1;
const PALETTE: u16 = 3;

/// The tag ColorMap: all levels of red, then of green, then of blue, of 16 bits.
const COLOR_MAP: u16 = 0x0140;

/// Returns whether a file is a BigTIFF, whose addresses have 64 bits.
pub(super) fn is_big(bytes: &[u8]) -> bool {
    bytes.starts_with(b"II+\0") || bytes.starts_with(b"MM\0+")
}

/// Returns the first value of a tag with 16-bit values in the first directory of a TIFF or BigTIFF
/// file; `None` if it is not there.
pub(super) fn first_short(bytes: &[u8], tag: u16) -> Option<u16> {
    let (place, _) = find_shorts(bytes, tag)?;
    Some(number(bytes, place, 2)? as u16)
}

/// Returns the number at a place of a file in the file's order of bytes; `None` beyond its end.
fn number(bytes: &[u8], at: u64, size: u64) -> Option<u64> {
    let at = usize::try_from(at).ok()?;
    let part = bytes.get(at..)?.get(..size as usize)?;
    let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
    Some(match bytes[0] {
        b'I' => part.iter().rev().fold(0, add),
        _ => part.iter().fold(0, add),
    })
}

/// Returns the place of the 16-bit values of a tag in the first directory, and their number.
fn find_shorts(bytes: &[u8], tag: u16) -> Option<(u64, u64)> {
    // The sizes of an address, of the number of entries, and of an entry.
    let (address, count, entry) = match is_big(bytes) {
        true => (8, 8, 20),
        false => (4, 2, 12),
    };
    let directory = number(bytes, address, address)?;
    let mut at = directory.checked_add(count)?;
    for _ in 0..number(bytes, directory, count)? {
        if number(bytes, at, 2)? == u64::from(tag) {
            let values = at + 4 + address;
            let shorts = number(bytes, at + 4, address)?;
            // Values that are no longer than an address take its place.
            let place = match shorts.saturating_mul(2) <= address {
                true => values,
                false => number(bytes, values, address)?,
            };
            return Some((place, shorts));
        }
        at += entry;
    }
    None
}

/// Returns a file with a palette of 256 colors as one of gray levels, which are the numbers of the
/// colors, and the colors; `None` for any other file.
pub(super) fn without_palette(bytes: &[u8]) -> Option<(Vec<u8>, Vec<[u8; 3]>)> {
    if first_short(bytes, PHOTOMETRIC_INTERPRETATION)? != PALETTE {
        return None;
    }
    let (place, count) = find_shorts(bytes, COLOR_MAP)?;
    if count != 3 * 256 {
        return None;
    }
    let levels = (0..count).map(|i| number(bytes, place + 2 * i, 2));
    let levels: Vec<u64> = levels.collect::<Option<_>>()?;
    // Some programs have written levels of 8 bits.
    let shift = if levels.iter().all(|level| *level < 256) {
        0
    } else {
        8
    };
    let color = |i: usize| [0, 256, 512].map(|first| (levels[first + i] >> shift) as u8);
    let mut gray = bytes.to_vec();
    let (place, _) = find_shorts(bytes, PHOTOMETRIC_INTERPRETATION)?;
    let value = gray.get_mut(usize::try_from(place).ok()?..)?.get_mut(..2)?;
    value.copy_from_slice(&match bytes[0] {
        b'I' => BLACK_IS_ZERO.to_le_bytes(),
        _ => BLACK_IS_ZERO.to_be_bytes(),
    });
    Some((gray, (0..256).map(color).collect()))
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Raster;

    /// Returns a picture of one pixel with three 32-bit samples.
    fn one_pixel(sample: [u8; 4], sample_format: Option<u16>) -> Vec<u8> {
        let file = |strip: u32| {
            let mut entries = vec![
                TagEntry::long(0x0100, 1),
                TagEntry::long(0x0101, 1),
                TagEntry::shorts(0x0102, &[32; 3]),
                TagEntry::shorts(0x0103, &[1]),
                TagEntry::shorts(0x0106, &[2]),
                TagEntry::long(0x0111, strip),
                TagEntry::shorts(0x0115, &[3]),
                TagEntry::long(0x0116, 1),
                TagEntry::long(0x0117, 12),
            ];
            entries.extend(sample_format.map(|n| TagEntry::shorts(SAMPLE_FORMAT, &[n; 3])));
            directory(entries)
        };
        let strip = file(0).len() as u32;
        [file(strip), sample.repeat(3)].concat()
    }

    #[test]
    fn samples_of_32_bits_are_read_only_if_they_are_floating_point_numbers() {
        let half = one_pixel(0.5_f32.to_be_bytes(), Some(FLOATING_POINT));
        assert_eq!(Raster::decode(&half, "a.tif").unwrap().color(0), [0.5; 3]);
        for format in [None, Some(1), Some(2)] {
            let gray = one_pixel((1_u32 << 31).to_be_bytes(), format);
            Raster::decode(&gray, "a.tif").expect_err("integers");
        }
    }

    #[test]
    fn a_big_tiff_is_read() {
        let mut file = b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0".to_vec();
        let entries: [[u16; 2]; 8] = [
            [0x0100, 1],
            [0x0101, 1],
            [0x0102, 8],
            [0x0103, 1],
            [0x0106, 1],
            [0x0111, 192],
            [0x0115, 1],
            [0x0117, 1],
        ];
        file.extend(8_u64.to_le_bytes());
        for [tag, value] in entries {
            file.extend([tag.to_le_bytes(), 3_u16.to_le_bytes()].concat());
            file.extend(1_u64.to_le_bytes());
            file.extend(u64::from(value).to_le_bytes());
        }
        file.extend(0_u64.to_le_bytes());
        assert_eq!(file.len(), 192);
        file.push(51);
        let raster = Raster::decode(&file, "a.tif").unwrap();
        assert_eq!(raster.color(0), [0.2; 3]);
        assert_eq!(first_short(&file, 0x0102), Some(8));
    }
}
