//! Contact sheets: numbered pictures in rows, on pages of PNG.

use std::path::Path;

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};

/// The space between pictures and around digits, in pixels.
const GAP: u32 = 4;
const GROUND: Rgb<u8> = Rgb([32, 32, 34]);
const INK: Rgb<u8> = Rgb([255, 230, 120]);

/// The digits as seven rows of five dots, the leftmost dot 16.
const DIGITS: [[u8; 7]; 10] = [
    [14, 17, 19, 21, 25, 17, 14],
    [4, 12, 4, 4, 4, 4, 14],
    [14, 17, 1, 2, 4, 8, 31],
    [31, 2, 4, 2, 1, 17, 14],
    [2, 6, 10, 18, 31, 2, 2],
    [31, 16, 30, 1, 1, 17, 14],
    [6, 8, 16, 30, 17, 17, 14],
    [31, 1, 2, 4, 8, 8, 8],
    [14, 17, 17, 14, 17, 17, 14],
    [14, 17, 17, 15, 1, 2, 12],
];

/// The layout of a contact sheet.
#[derive(Clone, Copy)]
pub(crate) struct ContactSheet {
    /// The width and height of every picture, in pixels; others are scaled.
    pub picture: (u32, u32),
    /// The number of pictures side by side in a cell.
    pub pictures: u32,
    /// The number of cells in a row.
    pub columns: u32,
    /// The number of rows on a page.
    pub rows: u32,
}

impl ContactSheet {
    /// Returns the width and height of a cell with its gaps, in pixels.
    fn cell(self) -> (u32, u32) {
        let (width, height) = self.picture;
        (self.pictures * width + 2 * GAP, height + 2 * GAP)
    }

    /// Writes cells of pictures as `NAME-1.png` and so on into a folder. Each cell has its number
    /// in the list, from 1, at its upper left corner. Returns the number of pages.
    ///
    /// # Errors
    /// Fails if a page cannot be written.
    pub(crate) fn write(
        self,
        cells: &[Vec<RgbImage>],
        folder: &Path,
        name: &str,
    ) -> image::ImageResult<usize> {
        let (width, height) = self.cell();
        let on_page = (self.columns * self.rows) as usize;
        for (page, cells_of_page) in cells.chunks(on_page.max(1)).enumerate() {
            let rows = (cells_of_page.len() as u32).div_ceil(self.columns);
            let mut sheet = RgbImage::from_pixel(self.columns * width, rows * height, GROUND);
            for (i, cell) in cells_of_page.iter().enumerate() {
                let (column, row) = (i as u32 % self.columns, i as u32 / self.columns);
                let (left, top) = (column * width + GAP, row * height + GAP);
                self.draw(&mut sheet, cell, (left, top));
                write_number(&mut sheet, page * on_page + i + 1, (left + 2, top + 2));
            }
            sheet.save(folder.join(format!("{name}-{}.png", page + 1)))?;
        }
        Ok(cells.len().div_ceil(on_page.max(1)))
    }

    fn draw(self, sheet: &mut RgbImage, cell: &[RgbImage], (left, top): (u32, u32)) {
        let (width, height) = self.picture;
        for (i, picture) in cell.iter().enumerate() {
            let scaled = imageops::resize(picture, width, height, FilterType::Triangle);
            let left = left + i as u32 * width;
            imageops::replace(sheet, &scaled, i64::from(left), i64::from(top));
        }
    }
}

/// Draws a number on a dark ground, ten by fourteen pixels a digit.
fn write_number(sheet: &mut RgbImage, number: usize, (left, top): (u32, u32)) {
    for (i, digit) in number.to_string().bytes().enumerate() {
        let rows = DIGITS[usize::from(digit - b'0')];
        for (x, y) in (0..12).flat_map(|x| (0..16).map(move |y| (x, y))) {
            let dot = (1..11).contains(&x) && (1..15).contains(&y) && {
                rows[(y as usize - 1) / 2] & (16 >> ((x - 1) / 2)) != 0
            };
            let (x, y) = (left + 12 * i as u32 + x, top + y);
            if x < sheet.width() && y < sheet.height() {
                sheet.put_pixel(x, y, if dot { INK } else { GROUND });
            }
        }
    }
}
