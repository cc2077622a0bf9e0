//! Picture files in: PNG, JPEG, TIFF, GIF, BMP, PNM, TGA, SGI and EXR, as rows of samples.
//!
//! Nothing is said here about what the numbers mean: textures, old photographs and exposures all
//! come through it as they are in the file. Of an animated file, the first frame is read.

pub mod sgi;

use std::io::Cursor;
use std::path::Path;

use ::exr::prelude::{self as exr, ReadChannels as _, ReadLayers as _};
use image::{DynamicImage, ImageFormat};

use crate::diag::{Diagnostic, Result};

/// Pixels in a file above this are a slip or an attack, not a picture.
const MOST_PIXELS: usize = 1 << 28;

/// A picture as its file holds it: rows from the top, channels interleaved.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    pub width: u32,
    pub height: u32,
    /// 1 gray, 2 gray and alpha, 3 color, 4 color and alpha: an Inventor texture's components.
    pub channels: usize,
    pub samples: Samples,
}

/// Samples in the file's own precision.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    /// Exposure, not levels: may be beyond 1.
    F32(Vec<f32>),
}

impl Raster {
    /// Reads a file of any known format; the content decides, and the name only where the
    /// content can't (TGA).
    ///
    /// # Errors
    /// What the disk says, or a file that is no picture.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(path.display(), &e))?;
        Self::decode(&bytes, &path.to_string_lossy())
    }

    /// Reads a file's bytes; `name` is for messages and for formats without a signature.
    ///
    /// # Errors
    /// Bytes that are no picture, or one that is broken or too large.
    pub fn decode(bytes: &[u8], name: &str) -> Result<Self> {
        let decoded = if bytes.starts_with(&sgi::MAGIC) {
            sgi::decode(bytes)
        } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            decode_exr(bytes)
        } else {
            decode_other(bytes, name)
        };
        decoded.map_err(|mut e| {
            e.message = format!("`{name}`: {}", e.message);
            e.in_file(name)
        })
    }

    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// One sample, with 1 for a full level.
    pub fn sample(&self, pixel: usize, channel: usize) -> f32 {
        let at = pixel * self.channels + channel;
        match &self.samples {
            Samples::U8(s) => f32::from(s[at]) / 255.0,
            Samples::U16(s) => f32::from(s[at]) / 65_535.0,
            Samples::F32(s) => s[at],
        }
    }

    /// Red, green, blue of a pixel, alpha left out.
    pub fn color(&self, pixel: usize) -> [f32; 3] {
        match self.channels {
            1 | 2 => [self.sample(pixel, 0); 3],
            _ => [0, 1, 2].map(|c| self.sample(pixel, c)),
        }
    }

    /// Opacity of a pixel; 1 where the file has none.
    pub fn alpha(&self, pixel: usize) -> f32 {
        match self.channels {
            2 => self.sample(pixel, 1),
            4 => self.sample(pixel, 3),
            _ => 1.0,
        }
    }

    /// Whether the samples are levels of a file format rather than exposures.
    pub fn is_levels(&self) -> bool {
        !matches!(self.samples, Samples::F32(_))
    }
}

/// Refuses a picture of more pixels than any real one has.
fn check_size(width: usize, height: usize) -> Result<()> {
    match width.checked_mul(height) {
        Some(pixels) if (1..=MOST_PIXELS).contains(&pixels) => Ok(()),
        _ => Err(Diagnostic::error(format!(
            "a picture of {width}x{height} pixels is not read"
        ))),
    }
}

fn decode_other(bytes: &[u8], name: &str) -> Result<Raster> {
    let by_content = image::guess_format(bytes).ok();
    let by_name = || ImageFormat::from_path(name).ok();
    // Only TGA has no signature; any other format has to look like itself.
    let format = by_content.or_else(|| by_name().filter(|f| *f == ImageFormat::Tga));
    let Some(format) = format else {
        return Err(Diagnostic::error("this is no picture that can be read")
            .with_help("png, jpeg, tiff, gif, bmp, pnm, tga, sgi (rgb, rgba, bw) and exr are"));
    };
    let sized = image::ImageReader::with_format(Cursor::new(bytes), format);
    if let Ok((width, height)) = sized.into_dimensions() {
        check_size(width as usize, height as usize)?;
    }
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(1 << 16);
    limits.max_image_height = Some(1 << 16);
    limits.max_alloc = Some(4 << 30);
    reader.limits(limits);
    let picture = reader
        .decode()
        .map_err(|e| Diagnostic::error(e.to_string()))?;
    check_size(picture.width() as usize, picture.height() as usize)?;
    Ok(from_image(picture))
}

fn from_image(picture: DynamicImage) -> Raster {
    let (width, height) = (picture.width(), picture.height());
    let channels = usize::from(picture.color().channel_count());
    let samples = match picture {
        DynamicImage::ImageLuma8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLumaA8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgb8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgba8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLuma16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageLumaA16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgb16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgba16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgb32F(p) => Samples::F32(p.into_raw()),
        DynamicImage::ImageRgba32F(p) => Samples::F32(p.into_raw()),
        other => {
            return Raster {
                width,
                height,
                channels: 4,
                samples: Samples::F32(other.into_rgba32f().into_raw()),
            };
        }
    };
    Raster {
        width,
        height,
        channels,
        samples,
    }
}

/// The first layer: R, G, B where it has them, otherwise its first channel as gray.
fn decode_exr(bytes: &[u8]) -> Result<Raster> {
    let image = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| Diagnostic::error(format!("this EXR is not readable: {e}")))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(format: ImageFormat) -> Vec<u8> {
        let picture = image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([x as u8 * 80, 0, y as u8]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn the_content_decides_and_the_name_only_for_tga() {
        let formats = [
            (ImageFormat::Png, "a.txt"),
            (ImageFormat::Bmp, "a.png"),
            (ImageFormat::Tiff, "a"),
            (ImageFormat::Pnm, "a.jpg"),
            (ImageFormat::Tga, "a.tga"),
        ];
        for (format, name) in formats {
            let raster = Raster::decode(&encoded(format), name).unwrap();
            assert_eq!((raster.width, raster.height), (3, 2), "{format:?}");
            assert_eq!(raster.color(5), [160.0 / 255.0, 0.0, 1.0 / 255.0]);
        }
    }

    #[test]
    fn what_is_no_picture_is_refused_with_the_formats_that_are() {
        let error = Raster::decode(b"#Inventor V2.1 ascii\n", "room.iv").unwrap_err();
        assert!(error.message.contains("room.iv"));
        assert!(error.help.unwrap_or_default().contains("sgi"));
        assert!(Raster::open(Path::new("no/such/file.png")).is_err());
    }

    #[test]
    fn a_broken_file_of_any_format_is_an_error_and_no_panic() {
        for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tiff] {
            let whole = encoded(format);
            for cut in [4, 20, whole.len() / 2] {
                assert!(Raster::decode(&whole[..cut], "x").is_err(), "{format:?}");
            }
        }
    }

    #[test]
    fn an_exr_comes_back_as_it_was_written() {
        let path = std::env::temp_dir().join(format!("ivcam-raster-{}.exr", std::process::id()));
        let pixels = vec![[0.0, 0.5, 7.0], [1e-3, -1.0, 0.25]];
        let picture = crate::picture::Picture {
            width: 2,
            height: 1,
            pixels: pixels.clone(),
            response: crate::film::Response::Linear,
            provenance: indexmap::IndexMap::new(),
        };
        picture.save(&path, crate::picture::Depth::Eight).unwrap();
        let raster = Raster::open(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!([raster.color(0), raster.color(1)].to_vec(), pixels);
        assert!(!raster.is_levels());
    }
}
