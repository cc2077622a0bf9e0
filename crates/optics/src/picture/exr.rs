//! Reads and writes OpenEXR files: linear exposure values, with the provenance as attributes.

use std::io::{Cursor, Write};
use std::path::Path;

use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use ::exr::block::write as write_blocks;
use ::exr::block::writer::ChunksWriter as _;
use ::exr::meta::{MetaData, header::Header, header::LayerAttributes};
use ::exr::prelude::{self as exr, ReadChannels as _, ReadLayers as _};
use flate2::{Compression, write::ZlibEncoder};
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{WriteSeek, write_whole};
use rayon::prelude::*;

use super::channels::ChannelImage;
use super::raster::{Raster, Samples, check_size};
use super::rows::{Heading, ROWS, RowSource, fill_placeholder};

/// Returns a text that the header of an EXR file states, such as `ivcam:response`; none if it does
/// not, or if the file is of another format.
pub fn exr_text(bytes: &[u8], name: &str) -> Option<String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?;
    let stated = &meta.headers.first()?.own_attributes.other;
    match stated.get(&exr::Text::new_or_none(name)?)? {
        exr::AttributeValue::Text(text) => String::from_utf8(text.as_slice().to_vec()).ok(),
        _ => None,
    }
}

/// Decodes the first layer: R, G and B if it has them, otherwise its first channel as gray. `ask`
/// gets the bytes of memory that this needs.
pub(super) fn decode(bytes: &[u8], ask: &mut dyn FnMut(u64) -> Result<()>) -> Result<Raster> {
    let unreadable =
        |e: ::exr::error::Error| Diagnostic::error(format!("this EXR is not readable: {e}"));
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(unreadable)?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.0, header.layer_size.1);
        check_size(width, height)?;
        // The samples of the file, planes of 32 bits, and the samples of the raster.
        let bytes = 12 * header.channels.list.len();
        ask((width * height) as u64 * bytes as u64)?;
    }
    let image = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    let layer = &image.layer_data;
    let (width, height) = (layer.size.0, layer.size.1);
    check_size(width, height)?;
    let list = &layer.channel_data.list;
    let find = |name: &str| list.iter().find(|c| c.name.to_string() == name);
    let chosen: Vec<_> = match (find("R"), find("G"), find("B"), find("A")) {
        (Some(r), Some(g), Some(b), Some(a)) => vec![r, g, b, a],
        (Some(r), Some(g), Some(b), None) => vec![r, g, b],
        _ => find("Y").or(list.first()).into_iter().collect(),
    };
    let planes: Vec<Vec<f32>> = chosen
        .iter()
        .map(|c| c.sample_data.values_as_f32().collect())
        .collect();
    if planes.is_empty() || planes.iter().any(|p| p.len() != width * height) {
        return Err(Diagnostic::error(
            "this EXR has no channel of full size to read",
        ));
    }
    let samples = (0..width * height).flat_map(|i| planes.iter().map(move |p| p[i]));
    Ok(Raster {
        width: width as u32,
        height: height as u32,
        channels: planes.len(),
        samples: Samples::F32(samples.collect()),
    })
}

/// The number of blocks that are compressed before they are written.
const BLOCKS_AT_ONCE: usize = 16;

/// Writes a picture as one layer of R, G and B while its rows are made. Blocks of rows are
/// compressed on the threads of rayon's current pool.
pub(super) fn write_rows(
    heading: &Heading,
    rows: &mut dyn RowSource,
    file: &mut dyn WriteSeek,
) -> std::io::Result<()> {
    let header = rgb_header(heading);
    // The file begins with eight bytes that are not of the header.
    let mut head = vec![0; 8];
    Header::write_all(std::slice::from_ref(&header), &mut head, false).map_err(io_error)?;
    write_blocks(&mut *file, vec![header].into(), true, |_, chunks| {
        let mut number = 0;
        let width = heading.resolution.width as usize;
        while let Some(pixels) = rows.next_rows()? {
            for some in pixels.chunks(BLOCKS_AT_ONCE * ROWS as usize * width) {
                let blocks = some.par_chunks(ROWS as usize * width).enumerate();
                let compress = |(i, part): (usize, &[[f32; 3]])| {
                    compressed(part, width, (number + i) * ROWS as usize)
                };
                let made: std::io::Result<Vec<Chunk>> = blocks.map(compress).collect();
                for chunk in made? {
                    chunks.write_chunk(number, chunk)?;
                    number += 1;
                }
            }
        }
        Ok(())
    })
    .map_err(io_error)?;
    match heading.late {
        None => Ok(()),
        Some(key) => {
            // An attribute is its name, its type and the size of its value, then the value.
            let start = format!("{key}\0string\0");
            let start = [start.as_bytes(), &placeholder_size(&head, &start)?].concat();
            fill_placeholder(file, &head, &start, &rows.late())
        }
    }
}

/// Returns the bytes of the size of an attribute's value; `start` is what precedes them.
fn placeholder_size(head: &[u8], start: &str) -> std::io::Result<[u8; 4]> {
    let found = head
        .windows(start.len())
        .position(|bytes| bytes == start.as_bytes());
    let size = found.and_then(|at| head.get(at + start.len()..)?.first_chunk());
    size.copied()
        .ok_or_else(|| std::io::Error::other("the header has no place for the late entry"))
}

/// Returns a system error as itself, and any other error as text.
fn io_error(error: exr::Error) -> std::io::Error {
    match error {
        exr::Error::Io(error) => error,
        other => std::io::Error::other(other),
    }
}

/// Returns the header of a picture in R, G and B.
fn rgb_header(heading: &Heading) -> Header {
    let size = heading.resolution;
    let channel = |name| exr::ChannelDescription::named(name, exr::SampleType::F32);
    let channels = ["B", "G", "R"].into_iter().map(channel).collect();
    let mut attributes = LayerAttributes::named("");
    attributes.layer_name = None;
    attributes.other = texts(&heading.with_placeholder()).collect();
    let size = (size.width as usize, size.height as usize);
    let encoding = exr::Encoding::SMALL_LOSSLESS;
    Header::new("".into(), size, channels)
        .with_encoding(
            encoding.compression,
            ::exr::meta::BlockDescription::ScanLines,
            encoding.line_order,
        )
        .with_attributes(attributes)
}

/// Compresses a block of rows by OpenEXR's method ZIP: deflates the differences between the bytes
/// at even places, followed by those at odd ones. The library's own takes four times as long, since
/// it looks for long matches. Samples of a render have none, and its files are 1 to 4% smaller.
fn compressed(pixels: &[[f32; 3]], width: usize, row: usize) -> std::io::Result<Chunk> {
    let mut data = Vec::with_capacity(12 * pixels.len());
    for row in pixels.chunks_exact(width) {
        for channel in [2, 1, 0] {
            data.extend(row.iter().flat_map(|pixel| pixel[channel].to_le_bytes()));
        }
    }
    let apart = data.iter().step_by(2).chain(data.iter().skip(1).step_by(2));
    let mut before = 128;
    let differences: Vec<u8> = apart
        .map(|&byte| {
            byte.wrapping_sub(std::mem::replace(&mut before, byte))
                .wrapping_add(128)
        })
        .collect();
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(data.len()), Compression::fast());
    encoder.write_all(&differences)?;
    let deflated = encoder.finish()?;
    // A reader takes a block of the full size as not compressed.
    let bytes = if deflated.len() < data.len() {
        deflated
    } else {
        data
    };
    Ok(Chunk {
        layer_index: 0,
        compressed_block: CompressedBlock::ScanLine(CompressedScanLineBlock {
            y_coordinate: row as i32,
            compressed_pixels_le: bytes,
        }),
    })
}

/// Returns a provenance as attributes.
fn texts(
    provenance: &IndexMap<String, String>,
) -> impl Iterator<Item = (exr::Text, exr::AttributeValue)> {
    // UTF-8, as readers expect. The library's own conversion writes Latin-1.
    let text = |s: &str| exr::Text::from_slice_unchecked(s.as_bytes());
    let entry =
        move |(key, value): (&String, &String)| (text(key), exr::AttributeValue::Text(text(value)));
    provenance.iter().map(entry)
}

impl ChannelImage {
    /// Writes the image as OpenEXR with 32 bits in each channel.
    ///
    /// # Errors
    /// Fails if the file cannot be written, or if a channel has not a value for each pixel. A
    /// failed write leaves no file.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        write_whole(path.as_ref(), |file| write_channels(self, file))
    }
}

/// Writes an image as one layer of its channels.
fn write_channels(image: &ChannelImage, file: &mut dyn Write) -> std::io::Result<()> {
    let size = (image.width as usize, image.height as usize);
    if image.channels.values().any(|c| c.len() != size.0 * size.1) {
        return Err(std::io::Error::other(
            "a channel does not have one value for each pixel",
        ));
    }
    let channels = image.channels.iter();
    let channels = channels.map(|(name, values)| (name.as_str(), values.clone()));
    write_layer(size, channels, &image.provenance, file)
}

/// Writes one layer without a name, with the provenance as its attributes.
fn write_layer<'a>(
    size: (usize, usize),
    channels: impl Iterator<Item = (&'a str, Vec<f32>)>,
    provenance: &IndexMap<String, String>,
    file: &mut dyn Write,
) -> std::io::Result<()> {
    use exr::WritableImage;
    let channel = |(name, values)| exr::AnyChannel::new(name, exr::FlatSamples::F32(values));
    let mut layer = exr::Layer::new(
        size,
        exr::LayerAttributes::named(""),
        exr::Encoding::SMALL_LOSSLESS,
        exr::AnyChannels::sort(channels.map(channel).collect()),
    );
    layer.attributes.layer_name = None;
    layer.attributes.other.extend(texts(provenance));
    let mut bytes = std::io::Cursor::new(Vec::new());
    exr::Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(std::io::Error::other)?;
    file.write_all(bytes.get_ref())
}
