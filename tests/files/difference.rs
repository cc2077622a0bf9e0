//! Compares two pictures value by value.

use std::fmt;

use image::{Rgb, RgbImage};

/// Where and by how much two pictures of the same size differ.
///
/// A value is one channel of one pixel, in levels from 0 to 255.
pub struct Difference {
    values: usize,
    total: usize,
    greatest: u8,
    /// Column and row of a pixel with the greatest difference.
    place: (u32, u32),
    /// The first and the last column, and the first and the last row, that hold a difference.
    columns: (u32, u32),
    rows: (u32, u32),
    /// The factor between a difference and its brightness in `picture`.
    pub amplification: u8,
    /// The absolute difference of every value, amplified so that the greatest one is bright.
    pub picture: RgbImage,
}

impl Difference {
    /// Returns `None` if no value differs by more than `allowed` levels.
    ///
    /// # Panics
    ///
    /// Panics if the pictures are not of the same size.
    pub fn between(old: &RgbImage, new: &RgbImage, allowed: u8) -> Option<Self> {
        assert_eq!(old.dimensions(), new.dimensions());
        let mut picture = RgbImage::new(new.width(), new.height());
        let (mut values, mut greatest, mut place) = (0, 0, (0, 0));
        let (mut columns, mut rows) = ((u32::MAX, 0), (u32::MAX, 0));
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            let (a, b) = (old.get_pixel(x, y), new.get_pixel(x, y));
            *pixel = Rgb([0, 1, 2].map(|channel| a[channel].abs_diff(b[channel])));
            let far = pixel.0.iter().filter(|levels| **levels > allowed);
            let (count, most) = far.fold((0, 0), |(count, most), l| (count + 1, most.max(*l)));
            if count == 0 {
                continue;
            }
            values += count;
            if most > greatest {
                (greatest, place) = (most, (x, y));
            }
            columns = (columns.0.min(x), columns.1.max(x));
            rows = (rows.0.min(y), rows.1.max(y));
        }
        if values == 0 {
            return None;
        }
        let amplification = 255 / greatest;
        for value in picture.iter_mut() {
            *value = value.saturating_mul(amplification);
        }
        Some(Self {
            values,
            total: new.len(),
            greatest,
            place,
            columns,
            rows,
            amplification,
            picture,
        })
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} values differ, by at most {} levels at column {}, row {}; all of them are in \
             columns {} to {}, rows {} to {}",
            self.values,
            self.total,
            self.greatest,
            self.place.0,
            self.place.1,
            self.columns.0,
            self.columns.1,
            self.rows.0,
            self.rows.1,
        )
    }
}
