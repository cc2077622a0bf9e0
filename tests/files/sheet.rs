//! Draws the changed pictures of a run on one sheet, so that a person can look at all of them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};

/// A changed picture: old, new and difference, from left to right on the sheet.
pub struct Row {
    pub name: String,
    pub message: String,
    /// `None` if there was no reference.
    pub old: Option<RgbImage>,
    pub new: RgbImage,
    /// `None` if there was no reference of the same size.
    pub difference: Option<RgbImage>,
}

/// How many pixels of the sheet, in both directions, show one pixel of a picture.
const ENLARGEMENT: u32 = 3;
/// Pixels between pictures.
const GAP: u32 = 8;
/// Pixels left of a row, for its number.
const MARGIN: u32 = 52;
const BACKGROUND: Rgb<u8> = Rgb([96, 96, 112]);
const INK: Rgb<u8> = Rgb([255, 255, 255]);

/// Writes `sheet.png` and `sheet.txt`, and returns the path of the picture.
///
/// Rows are numbered from 1. The text says for each number which scene it is and what changed.
pub fn write(rows: &[Row], folder: &Path) -> PathBuf {
    let path = folder.join("sheet.png");
    let mut text = String::from("From left to right: old, new, difference.\n");
    for (number, row) in (1..).zip(rows) {
        writeln!(text, "{number} {}: {}", row.name, row.message).unwrap();
    }
    std::fs::create_dir_all(folder).expect("the folder of the sheet is made");
    std::fs::write(folder.join("sheet.txt"), text).expect("the list of the sheet is written");
    draw(rows).save(&path).expect("the sheet is written");
    path
}

/// Removes the sheet of an older run.
pub fn remove(folder: &Path) {
    for name in ["sheet.png", "sheet.txt"] {
        // A sheet that is not there needs no removal.
        let _ = std::fs::remove_file(folder.join(name));
    }
}

/// Lays the rows out in as many columns as make the sheet about as high as it is wide.
fn draw(rows: &[Row]) -> RgbImage {
    let pictures = || rows.iter().flat_map(pictures_of).flatten();
    let width = ENLARGEMENT * pictures().map(RgbImage::width).max().unwrap_or(0);
    let height = ENLARGEMENT * pictures().map(RgbImage::height).max().unwrap_or(0);
    let (row_width, row_height) = (MARGIN + 3 * (width + GAP), height + GAP);
    let area = f64::from(row_width) * f64::from(row_height) * rows.len() as f64;
    let columns = (area.sqrt() / f64::from(row_width)).round().max(1.0) as u32;
    let lines = (rows.len() as u32).div_ceil(columns);
    let mut sheet = RgbImage::from_pixel(columns * row_width, lines * row_height + GAP, BACKGROUND);
    for (index, row) in (0..).zip(rows) {
        let x = index / lines * row_width;
        let y = index % lines * row_height + GAP;
        write_number(index + 1, x + GAP, y, &mut sheet);
        for (place, picture) in (0..).zip(pictures_of(row)) {
            let Some(picture) = picture else { continue };
            let large = imageops::resize(
                picture,
                ENLARGEMENT * picture.width(),
                ENLARGEMENT * picture.height(),
                FilterType::Nearest,
            );
            let left = x + MARGIN + place * (width + GAP);
            imageops::replace(&mut sheet, &large, left.into(), y.into());
        }
    }
    sheet
}

fn pictures_of(row: &Row) -> [Option<&RgbImage>; 3] {
    [row.old.as_ref(), Some(&row.new), row.difference.as_ref()]
}

/// Writes a number in digits of 3×5 dots, each dot three pixels wide.
fn write_number(number: u32, x: u32, y: u32, sheet: &mut RgbImage) {
    /// The lines of each digit from above, three bits each.
    const DIGITS: [[u8; 5]; 10] = [
        [0b111, 0b101, 0b101, 0b101, 0b111],
        [0b010, 0b110, 0b010, 0b010, 0b111],
        [0b111, 0b001, 0b111, 0b100, 0b111],
        [0b111, 0b001, 0b111, 0b001, 0b111],
        [0b101, 0b101, 0b111, 0b001, 0b001],
        [0b111, 0b100, 0b111, 0b001, 0b111],
        [0b111, 0b100, 0b111, 0b101, 0b111],
        [0b111, 0b001, 0b010, 0b010, 0b010],
        [0b111, 0b101, 0b111, 0b101, 0b111],
        [0b111, 0b101, 0b111, 0b001, 0b111],
    ];
    const DOT: u32 = 3;
    for (place, digit) in (0..).zip(number.to_string().bytes()) {
        for (line, bits) in (0..).zip(DIGITS[usize::from(digit - b'0')]) {
            for column in (0..3).filter(|column| bits >> (2 - column) & 1 == 1) {
                let (left, top) = (x + DOT * (4 * place + column), y + DOT * line);
                for (dx, dy) in (0..DOT * DOT).map(|dot| (dot % DOT, dot / DOT)) {
                    sheet.put_pixel(left + dx, top + dy, INK);
                }
            }
        }
    }
}
