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
use super::rows::{Heading, LATE_LENGTH, ROWS, RowSource, cut_off, fill_placeholder};

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

type Layer = exr::Layer<exr::AnyChannels<exr::FlatSamples>>;
type Channel = exr::AnyChannel<exr::FlatSamples>;
/// The channels of a picture, and the part of the file that has them.
type Choice<'a> = (&'a Layer, Vec<&'a Channel>);

/// Decodes the picture of a file: see [`picture_of`]. It has the size of the display window, and is
/// black where that has no data. `ask` gets the bytes of memory that this needs.
pub(super) fn decode(bytes: &[u8], ask: &mut dyn FnMut(u64) -> Result<()>) -> Result<Raster> {
    let unreadable =
        |e: ::exr::error::Error| Diagnostic::error(format!("this EXR is not readable: {e}"));
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(unreadable)?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.0, header.layer_size.1);
        check_size(width, height)?;
        // The samples of the file, and planes of 32 bits.
        let bytes = 8 * header.channels.list.len();
        ask((width * height) as u64 * bytes as u64)?;
    }
    let image = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    let window = image.attributes.display_window;
    check_size(window.size.0, window.size.1)?;
    let (layer, channels) = picture_of(&image.layer_data)?;
    ask((window.size.0 * window.size.1) as u64 * 4 * channels.len() as u64)?;
    let planes: Vec<Vec<f32>> = channels
        .iter()
        .map(|c| c.sample_data.values_as_f32().collect())
        .collect();
    let (width, height) = (layer.size.0, layer.size.1);
    if planes.iter().any(|p| p.len() != width * height) {
        return Err(Diagnostic::error(
            "this EXR has no channel of full size to read",
        ));
    }
    Ok(Raster {
        width: window.size.0 as u32,
        height: window.size.1 as u32,
        channels: planes.len(),
        samples: Samples::F32(in_window(&planes, layer, window)),
    })
}

/// Returns the samples of the planes of a layer in a window, 0 where the layer has none.
fn in_window(planes: &[Vec<f32>], layer: &Layer, window: exr::IntegerBounds) -> Vec<f32> {
    // The place in the planes of a column or row of the display window.
    let place = |at: usize, window: i32, data: i32, size: usize| {
        let place = at as i64 + i64::from(window) - i64::from(data);
        usize::try_from(place).ok().filter(|place| *place < size)
    };
    let (from, to) = (window.position, layer.attributes.layer_position);
    let pixel = |i: usize| {
        let x = place(i % window.size.0, from.0, to.0, layer.size.0)?;
        let y = place(i / window.size.0, from.1, to.1, layer.size.1)?;
        Some(y * layer.size.0 + x)
    };
    let mut samples = Vec::with_capacity(window.size.0 * window.size.1 * planes.len());
    for i in 0..window.size.0 * window.size.1 {
        let at = pixel(i);
        samples.extend(planes.iter().map(|plane| at.map_or(0.0, |at| plane[at])));
    }
    samples
}

fn channels(layer: &Layer) -> &[Channel] {
    &layer.channel_data.list
}

/// Returns a channel by its name in any letter case.
fn channel<'a>(layer: &'a Layer, name: &str) -> Option<&'a Channel> {
    let mut channels = channels(layer).iter();
    channels.find(|c| c.name.to_string().eq_ignore_ascii_case(name))
}

/// Returns the channels R, G, B and perhaps A behind a prefix.
fn colors<'a>(layer: &'a Layer, prefix: &str) -> Option<Choice<'a>> {
    let named = |letter| channel(layer, &format!("{prefix}{letter}"));
    let rgb: Option<Vec<_>> = ["R", "G", "B"].into_iter().map(named).collect();
    Some((layer, rgb?.into_iter().chain(named("A")).collect()))
}

/// Finds the channels that are the picture of a file: R, G, B and perhaps A of the first part with
/// these, otherwise those of the only layer with a name, such as `Combined.R`. Without either they
/// are Y, or the only channel. Names may be in any letter case.
///
/// # Errors
/// Returns an error that lists the channels if they are not known to be a picture.
fn picture_of(layers: &[Layer]) -> Result<Choice<'_>> {
    if let Some(found) = layers.iter().find_map(|layer| colors(layer, "")) {
        return Ok(found);
    }
    let of_layer = |layer| channels(layer).iter().map(move |channel| (layer, channel));
    let all: Vec<(&Layer, &Channel)> = layers.iter().flat_map(of_layer).collect();
    let mut named = all.iter().filter_map(|(layer, channel)| {
        let name = channel.name.to_string();
        let prefix = name.strip_suffix(['R', 'r'])?;
        colors(layer, prefix.strip_suffix('.').map(|_| prefix)?)
    });
    if let (Some(found), None) = (named.next(), named.next()) {
        return Ok(found);
    }
    if all.iter().any(|(layer, _)| channel(layer, "RY").is_some()) {
        let message = "this EXR has luminance and chroma (Y, RY and BY), which are not read";
        return Err(Diagnostic::unsupported(message).with_help("save the picture as R, G and B"));
    }
    let luminance = layers
        .iter()
        .find_map(|layer| Some((layer, channel(layer, "Y")?)));
    let only = match all[..] {
        [only] => Some(only),
        _ => None,
    };
    if let Some((layer, channel)) = luminance.or(only) {
        return Ok((layer, vec![channel]));
    }
    let names: Vec<String> = all.iter().map(|(_, c)| format!("`{}`", c.name)).collect();
    let error = format!(
        "this EXR has no channels that are known to be its picture: it has {}",
        names.join(", ")
    );
    Err(Diagnostic::unsupported(error).with_help("save the picture as R, G and B, or as Y"))
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
            let start = format!("{key}\0string\0");
            let late = late_attribute(cut_off(&rows.late()));
            fill_placeholder(file, &head, start.as_bytes(), &late)
        }
    }
}

/// Returns the size and the value of the late entry's attribute. Another attribute takes the rest
/// of the place, if that has room for its name, its type and the size of its value.
fn late_attribute(late: &str) -> Vec<u8> {
    let sized = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let rest = LATE_LENGTH - late.len();
    let filler = b"ivcam:filler\0string\0";
    match rest.checked_sub(filler.len() + 4) {
        Some(blanks) => [&sized(late)[..], filler, &sized(&" ".repeat(blanks))].concat(),
        None => sized(&format!("{late}{}", " ".repeat(rest))),
    }
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

#[cfg(test)]
mod tests {
    use ::exr::prelude::WritableImage as _;

    use super::*;

    fn written_and_read(
        attributes: exr::ImageAttributes,
        layers: exr::Layers<exr::AnyChannels<exr::FlatSamples>>,
    ) -> Result<Raster> {
        let image = exr::Image::from_layers(attributes, layers);
        let mut bytes = Cursor::new(Vec::new());
        image
            .write()
            .non_parallel()
            .to_buffered(&mut bytes)
            .unwrap();
        decode(&bytes.into_inner(), &mut |_| Ok(()))
    }

    /// Returns the channels of the picture of a file of 2x1 pixels with some parts, by the values
    /// 1, 2, 3 ... of all channels in their order, or the error.
    fn read(parts: &[&[&str]]) -> std::result::Result<Vec<f32>, String> {
        let mut value = 0.0;
        let mut channel = |name: &&str| {
            value += 1.0;
            exr::AnyChannel::new(*name, exr::FlatSamples::F32(vec![value; 2]))
        };
        let mut layer = |(i, names): (usize, &&[&str])| {
            let channels = names.iter().map(&mut channel).collect();
            let attributes = exr::LayerAttributes::named(format!("part {i}").as_str());
            let encoding = exr::Encoding::UNCOMPRESSED;
            exr::Layer::new(
                (2, 1),
                attributes,
                encoding,
                exr::AnyChannels::sort(channels),
            )
        };
        let layers: exr::Layers<_> = parts.iter().enumerate().map(&mut layer).collect();
        let window = exr::IntegerBounds::from_dimensions((2, 1));
        let raster = written_and_read(exr::ImageAttributes::new(window), layers);
        let raster = raster.map_err(|e| e.message)?;
        Ok((0..raster.channels).map(|c| raster.sample(1, c)).collect())
    }

    #[test]
    fn the_picture_of_a_file_is_found_among_parts_and_layers_or_it_is_refused() {
        let blender = [
            "V.Combined.A",
            "V.Combined.B",
            "V.Combined.G",
            "V.Combined.R",
            "V.Depth.Z",
        ];
        assert_eq!(read(&[&blender]), Ok(vec![4.0, 3.0, 2.0, 1.0]));
        assert_eq!(read(&[&["Z"], &["B", "G", "R"]]), Ok(vec![4.0, 3.0, 2.0]));
        assert_eq!(read(&[&["b", "g", "r"]]), Ok(vec![3.0, 2.0, 1.0]));
        assert_eq!(
            read(&[&["a.B", "a.G", "a.R"], &["B", "G", "R"]]),
            Ok(vec![6.0, 5.0, 4.0])
        );
        assert_eq!(read(&[&["Y", "Z"]]), Ok(vec![1.0]));
        assert_eq!(read(&[&["depth.Z"]]), Ok(vec![1.0]));
        let error = read(&[&["BY", "RY", "Y"]]).expect_err("chroma is not read");
        assert!(error.contains("RY"), "{error}");
        for parts in [
            ["G", "R"].as_slice(),
            &["a.B", "a.G", "a.R", "b.B", "b.G", "b.R"],
        ] {
            let error = read(&[parts]).expect_err("no picture");
            let names: Vec<String> = parts.iter().map(|name| format!("`{name}`")).collect();
            assert!(error.contains(&names.join(", ")), "{error}");
        }
    }

    /// The data window of a crop is smaller than the display window, that of an overscan larger.
    #[test]
    fn the_data_lie_in_the_display_window() {
        let read = |position: (i32, i32), window: exr::IntegerBounds| {
            let samples = exr::FlatSamples::F32((1..=12).map(|i| i as f32).collect());
            let channels = exr::AnyChannels::sort(vec![exr::AnyChannel::new("Y", samples)].into());
            let mut attributes = exr::LayerAttributes::named("");
            attributes.layer_position = position.into();
            let encoding = exr::Encoding::UNCOMPRESSED;
            let layer = exr::Layer::new((4, 3), attributes, encoding, channels);
            let attributes = exr::ImageAttributes::new(window);
            let raster = written_and_read(attributes, vec![layer].into()).unwrap();
            let samples: Vec<f32> = (0..raster.pixels()).map(|i| raster.sample(i, 0)).collect();
            (raster.width, raster.height, samples)
        };
        let window = exr::IntegerBounds::new((10, 20), (2, 2));
        assert_eq!(read((9, 19), window), (2, 2, vec![6.0, 7.0, 10.0, 11.0]));
        assert_eq!(read((11, 21), window), (2, 2, vec![0.0, 0.0, 0.0, 1.0]));
    }
}
