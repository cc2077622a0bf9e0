//! A picture as its file holds it: rows of samples, without a word on what they mean.

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
}

/// Refuses a picture of more pixels than any real one has.
pub(super) fn check_size(width: usize, height: usize) -> Result<()> {
    match width.checked_mul(height) {
        Some(pixels) if (1..=MOST_PIXELS).contains(&pixels) => Ok(()),
        _ => Err(Diagnostic::error(format!(
            "a picture of {width}x{height} pixels is not read"
        ))),
    }
}
