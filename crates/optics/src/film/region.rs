//! A rectangle of a picture's pixels.

use ivcam_base::diag::{Diagnostic, Result};
use serde::{Deserialize, Serialize};

use super::format::Resolution;

/// The pixels of a picture that are rendered, counted from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// The column of the leftmost pixels.
    pub left: u32,
    /// The row of the top pixels.
    pub top: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Region {
    /// Returns the pixels from a column and a row on, so many across and down.
    pub const fn new([left, top]: [u32; 2], [width, height]: [u32; 2]) -> Self {
        Self {
            left,
            top,
            width,
            height,
        }
    }

    /// Returns all pixels of a picture.
    pub fn whole(picture: Resolution) -> Self {
        Self::new([0, 0], [picture.width, picture.height])
    }

    /// Checks that a region has pixels and is inside a picture.
    ///
    /// # Errors
    /// Returns an error that names the region and the picture's size.
    pub fn check(self, picture: Resolution) -> Result<()> {
        let Self {
            left,
            top,
            width,
            height,
        } = self;
        let fits = |from: u32, size: u32, limit: u32| {
            size > 0 && from.checked_add(size).is_some_and(|end| end <= limit)
        };
        if fits(left, width, picture.width) && fits(top, height, picture.height) {
            return Ok(());
        }
        let message = format!(
            "`--region {self}` is not inside a picture of {}x{} pixels",
            picture.width, picture.height
        );
        Err(Diagnostic::error(message)
            .with_help("the numbers are the left column, the top row, the width and the height"))
    }

    /// Returns whether two regions have pixels in common.
    pub fn overlaps(self, other: Self) -> bool {
        let meet = |a: u32, length: u32, b: u32, other: u32| a < b + other && b < a + length;
        meet(self.left, self.width, other.left, other.width)
            && meet(self.top, self.height, other.top, other.height)
    }

    /// Returns the smallest region around two.
    pub fn around(self, other: Self) -> Self {
        let (left, top) = (self.left.min(other.left), self.top.min(other.top));
        let right = (self.left + self.width).max(other.left + other.width);
        let bottom = (self.top + self.height).max(other.top + other.height);
        Self {
            left,
            top,
            width: right - left,
            height: bottom - top,
        }
    }

    /// Replaces the values of the pixels of a region inside this one, whose values are in `values`.
    pub fn paste<T: Copy>(self, values: &mut [T], part: &[T], region: Self) {
        let width = region.width as usize;
        for (y, row) in (region.top - self.top..).zip(part.chunks_exact(width)) {
            let start = y as usize * self.width as usize + (region.left - self.left) as usize;
            values[start..start + width].copy_from_slice(row);
        }
    }

    /// Returns the size of the region.
    pub fn resolution(self) -> Resolution {
        Resolution::of(self.width, self.height)
    }

    /// Returns the region's part of the values of a picture's pixels, row by row.
    pub fn cut<T: Copy>(self, values: &[T], picture: Resolution) -> Vec<T> {
        let row = |y: u32| {
            let start = (y * picture.width + self.left) as usize;
            &values[start..start + self.width as usize]
        };
        (self.top..self.top + self.height)
            .flat_map(row)
            .copied()
            .collect()
    }
}

impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{},{},{},{}",
            self.left, self.top, self.width, self.height
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Resolution = Resolution::of(4, 3);

    #[test]
    fn a_region_cuts_its_own_pixels() {
        let region = Region::new([1, 1], [2, 2]);
        let numbers: Vec<u32> = (0..12).collect();
        assert_eq!(region.cut(&numbers, PICTURE), [5, 6, 9, 10]);
    }

    #[test]
    fn a_region_outside_the_picture_or_without_pixels_is_refused() {
        for (left, top, width, height) in [
            (0, 0, 5, 1),
            (0, 3, 1, 1),
            (1, 1, 0, 1),
            (1, 1, u32::MAX, 1),
        ] {
            let region = Region::new([left, top], [width, height]);
            assert!(region.check(PICTURE).is_err(), "{region}");
        }
        assert!(Region::whole(PICTURE).check(PICTURE).is_ok());
    }
}
