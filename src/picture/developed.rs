//! A developed picture, and the formats that it is written in.

use std::path::Path;

use indexmap::IndexMap;

use crate::diag::{Diagnostic, Result};
use crate::film::{Film, Response};

/// A picture in linear exposure values, rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Red, green, blue of each pixel; 1 is white on film.
    pub pixels: Vec<[f32; 3]>,
    pub response: Response,
    /// How it was made: key and value, written into PNG text and EXR attributes.
    pub provenance: IndexMap<String, String>,
}

/// Bits a channel in an integer format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    Eight,
    Sixteen,
}

/// What an output's name asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    Png,
    Exr,
    Ppm,
}

impl PictureFormat {
    /// By the extension.
    ///
    /// # Errors
    /// An extension that is none of png, exr, ppm.
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
            _ => Err(Diagnostic::error(format!(
                "cannot tell the picture's format from `{}`",
                path.display()
            ))
            .with_help("end the output's name in .png, .exr or .ppm")),
        }
    }
}

impl Picture {
    /// The picture of an exposed film, as its response shows it.
    pub fn develop(film: &Film, response: Response) -> Self {
        let pixels = (0..film.pixels.len())
            .map(|i| film.level(i).as_vec3().to_array())
            .collect();
        let (width, height) = (film.resolution.width, film.resolution.height);
        Self {
            width,
            height,
            pixels,
            response,
            provenance: IndexMap::new(),
        }
    }

    /// Big-endian levels, as both PNG and PPM want them.
    pub fn levels(&self, depth: Depth) -> Vec<u8> {
        let channels = self.pixels.iter().flatten().enumerate();
        let levels = channels.map(|(i, x)| self.response.level(f64::from(*x), i % 3));
        match depth {
            Depth::Eight => levels.map(|x| (x * 255.0).round() as u8).collect(),
            Depth::Sixteen => levels
                .flat_map(|x| ((x * 65_535.0).round() as u16).to_be_bytes())
                .collect(),
        }
    }
}
