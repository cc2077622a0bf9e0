//! The film of a picture and its pixels.

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result};

/// The number of pixels across, if none is given.
const WIDTH: u32 = 1920;
/// The greatest number of pixels of a picture.
pub(super) const MAX_PIXELS: u64 = 64 << 20;

/// The size of a film and its number of pixels. Pixels are square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The width and the height of the film, in millimeters.
    pub film: DVec2,
    /// The number of pixels across.
    pub width: u32,
    /// The number of pixels down.
    pub height: u32,
}

impl Frame {
    /// The frame of a film, given by its sides or its diagonal in millimeters, and a number of
    /// pixels. A diagonal alone gets the shape of the pixels, or 3 to 2.
    ///
    /// # Errors
    ///
    /// Returns an error if film and pixels have different shapes, for a film of 0, or for more than
    /// 64 Mi pixels.
    pub fn of(sides: Option<[f64; 2]>, diagonal: f64, pixels: Option<[u32; 2]>) -> Result<Self> {
        let film = match (sides, pixels) {
            (Some(sides), _) => DVec2::from(sides),
            (None, Some(pixels)) => diagonal * DVec2::from(pixels.map(f64::from)).normalize(),
            (None, None) => diagonal * DVec2::new(3.0, 2.0).normalize(),
        };
        if !(film.x > 0.0 && film.y > 0.0) {
            let error = "the lens states no field beyond its axis, which is no picture";
            return Err(Diagnostic::error(error).with_help("give `--film`"));
        }
        let rows = |width: u32| (f64::from(width) * film.y / film.x).round().max(1.0);
        let [width, height] = pixels.unwrap_or([WIDTH, rows(WIDTH) as u32]);
        if (rows(width) - f64::from(height)).abs() > 1.0 {
            return Err(Diagnostic::error(format!(
                "a film of {} x {} mm has not the shape of {width} x {height} pixels",
                film.x, film.y
            ))
            .with_help(format!(
                "give --size {width}x{} or another --film",
                rows(width)
            )));
        }
        if u64::from(width) * u64::from(height) > MAX_PIXELS || film.x > 1e3 * film.y {
            return Err(Diagnostic::error(format!(
                "a picture of {width} x {height} pixels is too large"
            ))
            .with_help(format!("the limit is {} million pixels", MAX_PIXELS >> 20)));
        }
        Ok(Self {
            film,
            width,
            height,
        })
    }

    /// The number of pixels per millimeter.
    pub(crate) fn density(&self) -> f64 {
        f64::from(self.width) / self.film.x
    }

    /// The picture's middle in pixels, from the center of the first pixel.
    pub(crate) fn middle(&self) -> DVec2 {
        0.5 * (self.size() - 1.0)
    }

    /// The number of pixels across and down.
    pub(crate) fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// The distance from the middle to a corner, in millimeters.
    pub(crate) fn corner(&self) -> f64 {
        0.5 * self.film.length()
    }
}
