//! The size of the film in millimeters, and of the picture in pixels.

use crate::diag::{Diagnostic, Result};

/// The size of the exposed film, in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmFormat {
    pub width: f64,
    pub height: f64,
}

impl FilmFormat {
    /// 35 mm still film: the paper's.
    pub const STANDARD: Self = Self {
        width: 36.0,
        height: 24.0,
    };

    pub(crate) fn half_diagonal(self) -> f64 {
        0.5 * self.width.hypot(self.height)
    }
}

/// Pixels across and down. Ten a millimeter in 1999: 360×240.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    pub width: u32,
    pub height: u32,
}

impl Resolution {
    pub const VINTAGE: Self = Self {
        width: 360,
        height: 240,
    };
    /// A side of more pixels than this is refused: a slip of the finger, not a wish.
    pub const LIMIT: u32 = 65_536;

    /// # Errors
    /// A picture of no pixels, or one too large to be meant.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(
                Diagnostic::error(format!("a picture of {width}x{height} has no pixels"))
                    .with_help("give a size such as `--size 360x240`"),
            );
        }
        let pixels = u64::from(width) * u64::from(height);
        if width > Self::LIMIT || height > Self::LIMIT || pixels > 1 << 30 {
            return Err(
                Diagnostic::error(format!("a picture of {width}x{height} is too large"))
                    .with_help("the limit is 65536 pixels a side and 2^30 in all"),
            );
        }
        Ok(Self { width, height })
    }

    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    pub(crate) fn aspect(self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_no_size_is_refused() {
        assert!(Resolution::new(0, 240).is_err());
        assert!(Resolution::new(100_000, 1).is_err());
    }
}
