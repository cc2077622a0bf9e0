//! An uninterpreted picture: the samples of a picture file.

use ivcam_base::diag::{Diagnostic, Result};

/// The largest number of pixels that is read. It bounds memory for broken or hostile files.
const MOST_PIXELS: usize = 1 << 28;

/// A picture as stored in its file: rows from the top, channels interleaved.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The number of channels, as in an Inventor texture: 1 gray, 2 gray and alpha, 3 color, 4
    /// color and alpha.
    pub channels: usize,
    /// The samples of all pixels.
    pub samples: Samples,
}

/// Samples in the precision of the file.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Levels from 0 to 255.
    U8(Vec<u8>),
    /// Levels from 0 to 65,535.
    U16(Vec<u16>),
    /// Linear exposures, which may exceed 1.
    F32(Vec<f32>),
}

impl Raster {
    /// Returns the number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns one sample; the largest level is 1.
    pub fn sample(&self, pixel: usize, channel: usize) -> f32 {
        let at = pixel * self.channels + channel;
        match &self.samples {
            Samples::U8(s) => f32::from(s[at]) / 255.0,
            Samples::U16(s) => f32::from(s[at]) / 65_535.0,
            Samples::F32(s) => s[at],
        }
    }

    /// Returns red, green and blue of a pixel, without alpha.
    pub fn color(&self, pixel: usize) -> [f32; 3] {
        match self.channels {
            1 | 2 => [self.sample(pixel, 0); 3],
            _ => [0, 1, 2].map(|c| self.sample(pixel, c)),
        }
    }

    /// Returns the opacity of a pixel, or 1 if the file has no alpha.
    pub fn alpha(&self, pixel: usize) -> f32 {
        match self.channels {
            2 => self.sample(pixel, 1),
            4 => self.sample(pixel, 3),
            _ => 1.0,
        }
    }
}

/// Refuses a picture without pixels or with more than [`MOST_PIXELS`].
pub(super) fn check_size(width: usize, height: usize) -> Result<()> {
    match width.checked_mul(height) {
        Some(pixels) if (1..=MOST_PIXELS).contains(&pixels) => Ok(()),
        _ => Err(Diagnostic::error(format!(
            "a picture of {width}x{height} pixels cannot be read"
        ))),
    }
}
