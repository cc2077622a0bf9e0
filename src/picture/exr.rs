//! Reads and writes OpenEXR files: linear exposure values, with the provenance as attributes.

use std::io::{Cursor, Write};

use ::exr::meta::MetaData;
use ::exr::prelude::{self as exr, ReadChannels as _, ReadLayers as _};
use indexmap::IndexMap;

use super::channels::ChannelImage;
use super::developed::Picture;
use super::raster::{Raster, Samples, check_size};
use crate::diag::{Diagnostic, Result};

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

/// Writes a picture as one layer of R, G and B.
pub(super) fn write(picture: &Picture, file: &mut dyn Write) -> std::io::Result<()> {
    let plane = |c: usize| picture.pixels.iter().map(|p| p[c]).collect();
    let channels = ["R", "G", "B"].into_iter().zip([0, 1, 2].map(plane));
    let size = (picture.width as usize, picture.height as usize);
    write_layer(size, channels, &picture.provenance, file)
}

/// Writes an image as one layer of its channels.
pub(super) fn write_channels(image: &ChannelImage, file: &mut dyn Write) -> std::io::Result<()> {
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
    use exr::{Text, WritableImage};
    let channel = |(name, values)| exr::AnyChannel::new(name, exr::FlatSamples::F32(values));
    let mut layer = exr::Layer::new(
        size,
        exr::LayerAttributes::named(""),
        exr::Encoding::SMALL_LOSSLESS,
        exr::AnyChannels::sort(channels.map(channel).collect()),
    );
    layer.attributes.layer_name = None;
    // UTF-8, as readers expect. The library's own conversion writes Latin-1.
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    let attributes = &mut layer.attributes.other;
    for (key, value) in provenance {
        attributes.insert(text(key), exr::AttributeValue::Text(text(value)));
    }
    let mut bytes = std::io::Cursor::new(Vec::new());
    exr::Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(std::io::Error::other)?;
    file.write_all(bytes.get_ref())
}
