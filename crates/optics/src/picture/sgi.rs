//! Reads Silicon Graphics picture files (`.rgb`, `.rgba`, `.bw`, `.sgi`), uncompressed and
//! run-length encoded, and writes uncompressed ones.
//!
//! The format is Paul Haeberli's "The SGI Image File Format", version 1.00. Numbers are big-endian,
//! channels are stored one after the other, and rows from the bottom up.

use std::io::{Error, Write};

use ivcam_base::diag::{Diagnostic, Result};

use super::developed::{Depth, Picture};
use super::raster::{Raster, Samples, check_size};

/// The first two bytes of every file.
pub(super) const MAGIC: [u8; 2] = [0x01, 0xda];

/// The length of the header in bytes, padding included.
const HEADER: usize = 512;

/// The fields of the header.
struct SgiHeader {
    /// Whether rows are run-length encoded.
    coded: bool,
    bytes_per_sample: usize,
    width: usize,
    height: usize,
    channels: usize,
    color_map: u32,
}

/// Decodes a file's bytes. `ask` gets the bytes of memory that this needs.
///
/// # Errors
/// Fails if `ask` does, or if the bytes are not an SGI picture, end too early, or hold color-map
/// indices.
pub(super) fn decode(bytes: &[u8], ask: &mut dyn FnMut(u64) -> Result<()>) -> Result<Raster> {
    let header = header(bytes)?;
    // The format allows more than four channels but defines no meaning for them.
    let kept = header.channels.min(4);
    check_size(header.width, header.height)?;
    let count = header.width * header.height * kept;
    ask(3 * count as u64)?; // 16 bits for each level, then 8
    let mut levels = vec![0_u16; count];
    let mut row = vec![0_u16; header.width];
    for channel in 0..kept {
        for y in 0..header.height {
            read_row(bytes, &header, channel * header.height + y, &mut row)?;
            let top = header.height - 1 - y;
            for (x, &level) in row.iter().enumerate() {
                levels[(top * header.width + x) * kept + channel] = level;
            }
        }
    }
    let samples = if header.bytes_per_sample == 1 {
        Samples::U8(levels.into_iter().map(|l| l as u8).collect())
    } else {
        Samples::U16(levels)
    };
    let raster = Raster {
        width: header.width as u32,
        height: header.height as u32,
        channels: kept,
        samples,
    };
    Ok(match header.color_map {
        1 => from_dithered(raster),
        _ => raster,
    })
}

/// The place of the image's name in the header, and its length with the zero at its end.
const NAME: (usize, usize) = (24, 80);

/// Writes a picture in red, green and blue, without compression. The command is the image's name
/// if it fits into 79 characters of ASCII; otherwise the program's name is.
///
/// # Errors
/// Fails if the picture has more than 65,535 pixels in a row or a column.
pub(super) fn write(picture: &Picture, depth: Depth, to: &mut dyn Write) -> std::io::Result<()> {
    let side = |pixels: u32| {
        let too_large = "an SGI picture has at most 65535 pixels in a row or a column";
        u16::try_from(pixels).map_err(|_| Error::other(too_large))
    };
    let (bytes, largest) = match depth {
        Depth::Eight => (1_usize, 255_u32),
        Depth::Sixteen => (2, 65_535),
    };
    let mut header = MAGIC.to_vec();
    header.extend([0, bytes as u8, 0, 3]);
    for size in [side(picture.width)?, side(picture.height)?, 3] {
        header.extend(size.to_be_bytes());
    }
    header.extend(0_u32.to_be_bytes());
    header.extend(largest.to_be_bytes());
    header.resize(HEADER, 0);
    let texts = ["Command", "Software"].map(|key| picture.provenance.get(key));
    let fits = |text: &&String| text.is_ascii() && text.len() < NAME.1;
    if let Some(name) = texts.into_iter().flatten().find(fits) {
        header[NAME.0..][..name.len()].copy_from_slice(name.as_bytes());
    }
    to.write_all(&header)?;
    let levels = picture.levels(depth);
    for channel in 0..3 {
        for row in levels
            .chunks_exact(3 * bytes * picture.width as usize)
            .rev()
        {
            let pixels = row.chunks_exact(3 * bytes);
            let plane = pixels.flat_map(|pixel| &pixel[bytes * channel..][..bytes]);
            to.write_all(&plane.copied().collect::<Vec<u8>>())?;
        }
    }
    Ok(())
}

/// Reads and checks the header.
fn header(bytes: &[u8]) -> Result<SgiHeader> {
    if bytes.len() < HEADER {
        return Err(cut_short());
    }
    if bytes[..2] != MAGIC {
        return Err(Diagnostic::error("this is not an SGI picture")
            .with_help("an SGI picture starts with the bytes 01 da"));
    }
    let short = |at: usize| usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
    let dimension = short(4);
    let header = SgiHeader {
        coded: bytes[2] == 1,
        bytes_per_sample: usize::from(bytes[3]),
        width: short(6),
        height: if dimension == 1 { 1 } else { short(8) },
        channels: if dimension < 3 { 1 } else { short(10) },
        color_map: long(bytes, 104).unwrap_or_default(),
    };
    let unsupported = |what: &str| Err(Diagnostic::error(format!("this SGI picture has {what}")));
    match &header {
        h if bytes[2] > 1 || !(1..=2).contains(&h.bytes_per_sample) => unsupported(&format!(
            "storage {} and {} bytes per sample, which the format does not define",
            bytes[2], h.bytes_per_sample
        )),
        h if h.width * h.height * h.channels == 0 || !(1..=3).contains(&dimension) => unsupported(
            &format!("{}x{} pixels, {} channels", h.width, h.height, h.channels),
        ),
        h if h.color_map > 1 => unsupported("color-map indices instead of colors"),
        _ => Ok(header),
    }
}

/// Reads one row; rows are numbered over all channels in file order.
fn read_row(bytes: &[u8], header: &SgiHeader, index: usize, row: &mut [u16]) -> Result<()> {
    let size = header.bytes_per_sample;
    if !header.coded {
        let start = HEADER + index * header.width * size;
        let data = bytes.get(start..start + header.width * size);
        let samples = data.ok_or_else(cut_short)?.chunks_exact(size);
        row.iter_mut().zip(samples).for_each(|(r, s)| *r = level(s));
        return Ok(());
    }
    let start = long(bytes, HEADER + 4 * index).ok_or_else(cut_short)? as usize;
    let table = header.height * header.channels;
    let length = long(bytes, HEADER + 4 * (table + index)).ok_or_else(cut_short)? as usize;
    let end = start.checked_add(length).ok_or_else(cut_short)?;
    expand(bytes.get(start..end).ok_or_else(cut_short)?, size, row);
    Ok(())
}

/// Decodes a run-length encoded row. A row that ends early is filled with black, and one that is
/// too long is cut; both occur in old files.
fn expand(data: &[u8], size: usize, row: &mut [u16]) {
    row.fill(0);
    let mut samples = data.chunks_exact(size).map(level);
    let mut x = 0;
    while let Some(code) = samples.next() {
        let count = usize::from(code & 0x7f);
        if count == 0 || x == row.len() {
            return;
        }
        let end = (x + count).min(row.len());
        if code & 0x80 != 0 {
            for (slot, sample) in row[x..end].iter_mut().zip(samples.by_ref()) {
                *slot = sample;
            }
        } else {
            row[x..end].fill(samples.next().unwrap_or_default());
        }
        x = end;
    }
}

/// Converts the one or two bytes of a sample.
fn level(sample: &[u8]) -> u16 {
    sample.iter().fold(0, |l, &b| (l << 8) | u16::from(b))
}

/// Reads a 32-bit number, or returns `None` beyond the end.
fn long(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at + 4)?;
    Some(u32::from_be_bytes([four[0], four[1], four[2], four[3]]))
}

/// Converts pixels of color map 1, which hold red in the low three bits of a byte, green in the
/// next three, and blue in the highest two.
fn from_dithered(raster: Raster) -> Raster {
    let Samples::U8(levels) = &raster.samples else {
        return raster;
    };
    let spread = |bits: u8, top: u8| (u16::from(bits) * 255 / u16::from(top)) as u8;
    let colors = levels
        .iter()
        .step_by(raster.channels)
        .flat_map(|&b| [spread(b & 7, 7), spread(b >> 3 & 7, 7), spread(b >> 6, 3)]);
    Raster {
        channels: 3,
        samples: Samples::U8(colors.collect()),
        ..raster
    }
}

fn cut_short() -> Box<Diagnostic> {
    Diagnostic::error("this SGI picture ends before its last pixel")
        .with_help("the file may have been cut short while it was copied")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> Result<Raster> {
        super::decode(bytes, &mut |_| Ok(()))
    }

    /// Returns the bytes of a file with a header and a body.
    fn file(coded: u8, bytes: u8, size: [u8; 3], body: &[u8]) -> Vec<u8> {
        let [width, height, channels] = size;
        let dimension = if channels > 1 { 3 } else { 2 };
        let mut file = vec![0x01, 0xda, coded, bytes, 0, dimension, 0, width, 0, height];
        file.extend([0, channels]);
        file.resize(HEADER, 0);
        file.extend(body);
        file
    }

    #[test]
    fn rows_run_from_the_bottom_and_channels_one_after_the_other() {
        let raster = decode(&file(0, 1, [2, 2, 3], &(1..=12).collect::<Vec<u8>>())).unwrap();
        let Samples::U8(levels) = raster.samples else {
            panic!("8 bits were written");
        };
        assert_eq!(levels, [3, 7, 11, 4, 8, 12, 1, 5, 9, 2, 6, 10]);
    }

    #[test]
    fn a_coded_row_is_runs_and_copies() {
        // Two rows: 5 5 5 9 (a run of three, a copy of one), and 1 2 3 4 as a copy of four.
        let rows: [&[u8]; 2] = [&[3, 5, 0x81, 9, 0], &[0x84, 1, 2, 3, 4, 0]];
        let mut body = Vec::new();
        for start in [512 + 16_u32, 512 + 16 + 5] {
            body.extend(start.to_be_bytes());
        }
        for row in rows {
            body.extend((row.len() as u32).to_be_bytes());
        }
        rows.iter().for_each(|r| body.extend(*r));
        let raster = decode(&file(1, 1, [4, 2, 1], &body)).unwrap();
        assert!(matches!(&raster.samples,
            Samples::U8(l) if l == &[1, 2, 3, 4, 5, 5, 5, 9]));
    }

    #[test]
    fn samples_of_sixteen_bits_keep_their_precision() {
        let raster = decode(&file(0, 2, [2, 1, 1], &[0x12, 0x34, 0xff, 0xff])).unwrap();
        assert!(matches!(&raster.samples, Samples::U16(l) if l == &[0x1234, 0xffff]));
    }

    #[test]
    fn a_truncated_or_corrupted_file_does_not_panic() {
        let mut body = vec![0, 0, 2, 8, 0, 0, 0, 5];
        body.extend([3, 5, 0x81, 9, 0]);
        let whole = file(1, 1, [4, 1, 1], &body);
        assert!(decode(&whole).is_ok());
        for cut in 0..whole.len() {
            let _ = decode(&whole[..cut]);
        }
        for at in (0..12).chain(104..108).chain(HEADER..whole.len()) {
            for byte in [0, 1, 2, 0x7f, 0x80, 0xff] {
                let mut broken = whole.clone();
                broken[at] = byte;
                let _ = decode(&broken);
            }
        }
    }
}
