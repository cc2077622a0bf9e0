//! A developed picture, and the formats that it can be written in.

use std::path::Path;

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::SizeEstimate;

use crate::film::{Film, Resolution, Response};

/// A picture in linear exposure values, with rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green and blue of each pixel; 1 is white.
    pub pixels: Vec<[f32; 3]>,
    /// The response that levels in integer formats are computed with.
    pub response: Response,
    /// The provenance: keys and values that are written as PNG text and EXR attributes.
    pub provenance: IndexMap<String, String>,
}

/// Bits per channel in an integer format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Depth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// A format that pictures are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PictureFormat {
    /// PNG, 8 or 16 bits per channel.
    Png,
    /// OpenEXR, linear exposures in 32 bits.
    Exr,
    /// PPM (P6), 8 or 16 bits per channel.
    Ppm,
    /// Silicon Graphics' format, 8 or 16 bits per channel, without compression.
    Sgi,
    /// TIFF, 8 or 16 bits per channel. It carries no provenance.
    Tiff,
    /// JPEG, 8 bits per channel, with loss. Its EXIF data hold the command and the program.
    Jpeg,
}

impl PictureFormat {
    /// Returns the format of a path's extension.
    ///
    /// # Errors
    /// Fails if the extension is not png, exr, ppm, pnm, rgb, sgi, tif, tiff, jpg or jpeg.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        match extension.as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "ppm" | "pnm" => Ok(Self::Ppm),
            "rgb" | "sgi" => Ok(Self::Sgi),
            "tif" | "tiff" => Ok(Self::Tiff),
            "jpg" | "jpeg" => Ok(Self::Jpeg),
            _ => Err(Diagnostic::unsupported(format!(
                "cannot tell the picture's format from `{}`",
                path.display()
            ))
            .with_help("end the output's name in .png, .exr, .tif, .jpg, .rgb, .sgi or .ppm")),
        }
    }
}

impl PictureFormat {
    /// Returns the size that a file of this format may have, without its metadata. Deflate makes
    /// data smaller by a factor of at most 1032 (RFC 1951), JPEG and the codings of EXR by less.
    pub fn size(self, resolution: Resolution, depth: Depth) -> SizeEstimate {
        const LARGEST_FACTOR: u64 = 1_032;
        let per_channel = match (self, depth) {
            (Self::Exr, _) => 4,
            (Self::Jpeg, _) | (_, Depth::Eight) => 1,
            (_, Depth::Sixteen) => 2,
        };
        let plain = 3 * per_channel * resolution.pixels() as u64;
        match self {
            Self::Ppm | Self::Sgi | Self::Tiff => SizeEstimate {
                least: plain,
                most: plain + (1 << 16),
            },
            Self::Png | Self::Exr | Self::Jpeg => SizeEstimate {
                least: plain / LARGEST_FACTOR,
                most: plain + plain / 100 + (1 << 16),
            },
        }
    }
}

impl Picture {
    /// Develops an exposed film.
    pub fn develop(film: &Film, response: Response) -> Self {
        Self::of_levels(film.levels(), film.resolution, response)
    }

    /// Develops an exposed film and releases its memory meanwhile.
    pub fn develop_last(film: Film, response: Response) -> Self {
        let resolution = film.resolution;
        Self::of_levels(film.into_levels(), resolution, response)
    }

    fn of_levels(pixels: Vec<[f32; 3]>, resolution: Resolution, response: Response) -> Self {
        let Resolution { width, height } = resolution;
        Self {
            width,
            height,
            pixels,
            response,
            provenance: IndexMap::new(),
        }
    }

    /// Returns the levels of all channels as big-endian numbers, for PNG and PPM.
    pub fn levels(&self, depth: Depth) -> Vec<u8> {
        levels(&self.pixels, &self.response, depth)
    }
}

/// Returns the levels of all channels of some pixels as big-endian numbers.
pub(super) fn levels(pixels: &[[f32; 3]], response: &Response, depth: Depth) -> Vec<u8> {
    let levels = pixels
        .iter()
        .flat_map(|pixel| response.levels(pixel.map(f64::from)));
    match depth {
        Depth::Eight => levels.map(|x| (x * 255.0).round() as u8).collect(),
        Depth::Sixteen => levels
            .flat_map(|x| ((x * 65_535.0).round() as u16).to_be_bytes())
            .collect(),
    }
}
