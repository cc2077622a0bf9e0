//! The size of the film in millimeters, and of the picture in pixels.

use ivcam_base::diag::{Diagnostic, Result};
use serde::{Deserialize, Serialize};

/// The size of the exposed film, in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmFormat {
    /// Millimeters across.
    pub width: f64,
    /// Millimeters down.
    pub height: f64,
}

impl FilmFormat {
    /// The format of 35 mm still film, 36×24 mm, which the paper uses.
    pub const STANDARD: Self = Self {
        width: 36.0,
        height: 24.0,
    };

    /// Returns half of the diagonal, in millimeters.
    pub fn half_diagonal(self) -> f64 {
        0.5 * self.width.hypot(self.height)
    }
}

/// The size of a picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resolution {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Resolution {
    /// The size of the 1999 program's pictures: ten pixels per millimeter of film.
    pub const VINTAGE: Self = Self::of(360, 240);
    /// The largest number of pixels on a side. A larger one is taken for a typing error.
    pub const LIMIT: u32 = 65_536;

    /// Returns a size, which is not checked.
    pub const fn of(width: u32, height: u32) -> Self {
        Self { width, height }
    }

    /// Returns a size that a picture can have.
    ///
    /// # Errors
    /// Fails if a side is 0 or exceeds [`Resolution::LIMIT`], or if there are more than 2^30
    /// pixels.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(
                Diagnostic::error(format!("a picture of {width}x{height} has no pixels"))
                    .with_help("give a size such as `--size 360x240`"),
            );
        }
        let pixels = u64::from(width) * u64::from(height);
        if width > Self::LIMIT || height > Self::LIMIT || pixels > 1 << 30 {
            return Err(Diagnostic::beyond_limit(format!(
                "a picture of {width}x{height} is too large"
            ))
            .with_help("the limit is 65536 pixels a side and 2^30 in all"));
        }
        Ok(Self { width, height })
    }

    /// Returns the number of pixels.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns the width over the height.
    pub fn aspect(self) -> f64 {
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
