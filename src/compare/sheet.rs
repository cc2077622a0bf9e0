//! Draws the comparison sheet: the new picture, the old one and the difference, with a scale and
//! the measures.

use std::io::Cursor;
use std::path::Path;

use image::ImageFormat;
use image::codecs::jpeg::JpegEncoder;
use ivcam_base::diag::{Diagnostic, Result};

use ivcam_compare::Comparison;
use ivcam_compare::Plate;

/// The width of the border around the panels, in pixels.
const BORDER: usize = 10;
/// The height of a line of text in pixels: eight rows of dots and spacing.
const LINE: usize = 11;
/// The smallest width of a panel, in pixels. Smaller pictures are enlarged to fit the text.
const NARROWEST: usize = 240;

/// An 8-bit RGB picture with rows from the top.
pub(crate) struct ComparisonSheet {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[u8; 3]>,
}

/// A picture of a contact sheet, with two lines of text below it.
pub(crate) struct ContactPicture {
    /// Pixels across.
    pub width: usize,
    /// The levels of red, green and blue, row by row from the top.
    pub levels: Vec<u8>,
    pub lines: [String; 2],
}

/// Colors of the difference from 0 to the end of the scale.
const RAMP: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.02],
    [0.20, 0.07, 0.42],
    [0.55, 0.13, 0.50],
    [0.88, 0.31, 0.36],
    [0.99, 0.62, 0.34],
    [0.99, 0.97, 0.75],
];
const GROUND: [u8; 3] = [32, 32, 34];
const INK: [u8; 3] = [230, 230, 225];
/// The color of pixels that do not count.
pub(crate) const FAINT: [u8; 3] = [64, 64, 68];

impl ComparisonSheet {
    /// Draws the sheet of a comparison, with the names as the panels' titles.
    pub(crate) fn draw(comparison: &Comparison, new_name: &str, old_name: &str) -> Self {
        let (width, height) = (comparison.width, comparison.height);
        let zoom = NARROWEST.div_ceil(width).max(1);
        let (wide, tall) = (width * zoom, height * zoom);
        let lines = measure_lines(comparison);
        let mut sheet = Self::blank(
            4 * BORDER + 3 * wide,
            3 * BORDER + LINE + tall + LINE * (2 + lines.len()),
        );
        let top = BORDER + LINE;
        let left = |panel: usize| BORDER + panel * (wide + BORDER);
        let scale = scale_of(comparison);
        let plain = |plate: &Plate, i: usize| plate.color(i).map(level);
        for y in 0..tall {
            for x in 0..wide {
                let i = y / zoom * width + x / zoom;
                sheet.set(left(0) + x, top + y, plain(&comparison.new, i));
                let counts = comparison.mask.counts[i];
                let old = if counts {
                    plain(&comparison.old, i)
                } else {
                    FAINT
                };
                sheet.set(left(1) + x, top + y, old);
                let far = f64::from(difference(comparison, i)) / scale;
                let far = if counts { ramp(far) } else { FAINT };
                sheet.set(left(2) + x, top + y, far);
            }
        }
        for (panel, title) in [new_name, old_name, "difference"].iter().enumerate() {
            sheet.write(left(panel), BORDER - 2, &fitting(title, wide));
        }
        sheet.bar(left(2), top + tall + 4, wide, scale);
        for (i, line) in lines.iter().enumerate() {
            sheet.write(left(0), top + tall + BORDER + LINE * i, line);
        }
        sheet
    }

    /// Draws pictures in rows of `columns`, with their texts. A picture larger than the first is
    /// cut.
    pub(crate) fn of_pictures(pictures: &[ContactPicture], columns: usize) -> Self {
        let (wide, tall) = pictures.first().map_or((0, 0), |first| {
            (first.width, first.levels.len() / (3 * first.width.max(1)))
        });
        let columns = columns.min(pictures.len()).max(1);
        let rows = pictures.len().div_ceil(columns);
        let step = [wide + BORDER, tall + 2 * LINE + BORDER];
        let mut sheet = Self::blank(BORDER + columns * step[0], BORDER + rows * step[1]);
        for (number, picture) in pictures.iter().enumerate() {
            let left = BORDER + number % columns * step[0];
            let top = BORDER + number / columns * step[1];
            for (i, pixel) in picture.levels.as_chunks::<3>().0.iter().enumerate() {
                let (x, y) = (i % picture.width, i / picture.width);
                if x < wide && y < tall {
                    sheet.set(left + x, top + y, *pixel);
                }
            }
            for (i, line) in picture.lines.iter().enumerate() {
                sheet.write(left, top + tall + 3 + LINE * i, &fitting(line, wide));
            }
        }
        sheet
    }

    fn blank(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: vec![GROUND; width * height],
        }
    }

    fn set(&mut self, x: usize, y: usize, color: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = color;
        }
    }

    /// Draws the scale under the difference: a color ramp with numbers at its ends and middle.
    fn bar(&mut self, left: usize, top: usize, wide: usize, scale: f64) {
        for x in 0..wide {
            let color = ramp(x as f64 / (wide - 1).max(1) as f64);
            (0..6).for_each(|y| self.set(left + x, top + y, color));
        }
        let top = top + 9;
        self.write(left, top, "0");
        let half = number(0.5 * scale);
        self.write(left + (wide - 6 * half.len()) / 2, top, &half);
        let whole = number(scale);
        self.write(left + wide - 6 * whole.len(), top, &whole);
    }

    /// Writes a line of text, six pixels per character.
    fn write(&mut self, left: usize, top: usize, line: &str) {
        for (i, c) in line.chars().enumerate() {
            for (y, row) in glyph(c).into_iter().enumerate() {
                for x in (0..5).filter(|x| row & (16 >> x) != 0) {
                    self.set(left + 6 * i + x, top + y, INK);
                }
            }
        }
    }

    /// Encodes the sheet in the format of a file name.
    ///
    /// # Errors
    /// Fails if the extension is not that of an 8-bit format, or the encoder fails.
    pub(crate) fn encode(&self, name: &Path) -> Result<Vec<u8>> {
        let format = format_of(name)?;
        let levels = self.pixels.as_flattened().to_vec();
        let picture = image::RgbImage::from_raw(self.width as u32, self.height as u32, levels)
            .unwrap_or_default();
        let mut bytes = Cursor::new(Vec::new());
        let written = match format {
            ImageFormat::Jpeg => {
                picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, 92))
            }
            _ => picture.write_to(&mut bytes, format),
        };
        written.map_err(|e| {
            Diagnostic::error(format!("the sheet can't be written: {e}"))
                .in_file(name.display().to_string())
        })?;
        Ok(bytes.into_inner())
    }
}

/// Returns the format of a sheet's file name.
///
/// # Errors
/// Fails if sheets cannot be written in that format.
pub(crate) fn format_of(name: &Path) -> Result<ImageFormat> {
    const KNOWN: [ImageFormat; 4] = [
        ImageFormat::Png,
        ImageFormat::Jpeg,
        ImageFormat::Tiff,
        ImageFormat::Bmp,
    ];
    ImageFormat::from_path(name)
        .ok()
        .filter(|format| KNOWN.contains(format))
        .ok_or_else(|| {
            Diagnostic::unsupported(format!(
                "cannot tell the sheet's format from `{}`",
                name.display()
            ))
            .with_help(match name.extension().is_some_and(|e| e == "html" || e == "htm") {
                true => {
                    "a page is made of two folders: `ivcam compare NEW/ OLD/ -o REPORT/`; a sheet's \
                     name ends in .png, .jpg, .tiff or .bmp"
                }
                false => "end its name in .png, .jpg, .tiff or .bmp",
            })
        })
}

/// Returns the largest difference of the three channels at a pixel.
pub(crate) fn difference(comparison: &Comparison, i: usize) -> f32 {
    let (a, b) = (comparison.new.color(i), comparison.old.color(i));
    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
}

/// Returns the end of the scale: a round number that 99.5% of the pixels are below.
pub(crate) fn scale_of(comparison: &Comparison) -> f64 {
    let counted = (0..comparison.mask.counts.len()).filter(|&i| comparison.mask.counts[i]);
    let mut all: Vec<f32> = counted.map(|i| difference(comparison, i)).collect();
    all.sort_by(f32::total_cmp);
    let high = all.get(all.len() * 199 / 200).copied().unwrap_or_default();
    let round = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
    round
        .into_iter()
        .find(|r| f64::from(high) <= *r)
        .unwrap_or(1.0)
}

/// Converts to 8 bits.
pub(crate) fn level(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

/// Returns the color of a difference, 1 being the end of the scale.
pub(crate) fn ramp(far: f64) -> [u8; 3] {
    let at = far.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let i = (at as usize).min(RAMP.len() - 2);
    let t = at - i as f64;
    [0, 1, 2].map(|c| level((RAMP[i][c] * (1.0 - t) + RAMP[i + 1][c] * t) as f32))
}

/// Shortens a name to its end, so that it fits in a width in pixels.
fn fitting(name: &str, wide: usize) -> String {
    let room = wide / 6;
    let count = name.chars().count();
    if count <= room {
        return name.to_owned();
    }
    let end = name.chars().skip(count + 2 - room.max(2));
    format!("..{}", end.collect::<String>())
}

/// Formats a number with up to four decimals, without an exponent.
pub(crate) fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    short.to_owned()
}

/// Returns the measures of a comparison, one per line.
pub(crate) fn measure_lines(comparison: &Comparison) -> Vec<String> {
    let m = &comparison.measures;
    let mut lines = vec![
        format!("MSE {:.6}  PSNR {:.2} dB", m.mse, m.psnr),
        format!("SSIM {:.4}  FLIP {:.4}", m.ssim, m.flip),
    ];
    lines.push(match m.edges {
        Some(e) => format!(
            "edges {:.2} px apart, 95% within {:.2} px, {:.1}% matched",
            e.mean,
            e.p95,
            100.0 * e.matched
        ),
        None => "edges: none to compare".into(),
    });
    if let Some(a) = &comparison.alignment {
        lines.push(format!(
            "old: {}shift {:+.2} {:+.2} px, scale {:.4}, rotation {:+.3} deg",
            if a.mirrored { "mirrored, " } else { "" },
            a.shift[0],
            a.shift[1],
            a.scale,
            a.rotation
        ));
    }
    let [r, g, b] = comparison.tones;
    if r == g && g == b {
        lines.push(format!("old: {}", tone_words(r)));
    } else {
        for (name, tone) in ["red", "green", "blue"].iter().zip([r, g, b]) {
            lines.push(format!("old {name}: {}", tone_words(tone)));
        }
    }
    lines
}

/// Formats a tone curve.
fn tone_words(tone: ivcam_compare::Tone) -> String {
    format!(
        "gain {:.4}, offset {:+.4}, gamma {:.4}",
        tone.gain, tone.offset, tone.gamma
    )
}

/// Returns a character as eight rows of five dots, the leftmost dot 16. The last row is for
/// descenders.
fn glyph(c: char) -> [u8; 8] {
    let [a, b, c, d, e, f, g] = match c {
        'g' | 'j' | 'p' | 'q' | 'y' => return hanging(c),
        _ => upright(c),
    };
    [a, b, c, d, e, f, g, 0]
}

/// Returns the letters with descenders.
fn hanging(c: char) -> [u8; 8] {
    match c {
        'g' => [0, 0, 15, 17, 17, 15, 1, 14],
        'j' => [2, 0, 6, 2, 2, 2, 18, 12],
        'p' => [0, 0, 30, 17, 17, 30, 16, 16],
        'q' => [0, 0, 15, 17, 17, 15, 1, 1],
        _ => [0, 0, 17, 17, 17, 15, 1, 14],
    }
}

/// Returns the characters without descenders.
fn upright(c: char) -> [u8; 7] {
    match c {
        'a' => [0, 0, 14, 1, 15, 17, 15],
        'b' => [16, 16, 22, 25, 17, 17, 30],
        'c' => [0, 0, 14, 16, 16, 17, 14],
        'd' => [1, 1, 13, 19, 17, 17, 15],
        'e' => [0, 0, 14, 17, 31, 16, 14],
        'f' => [6, 9, 8, 28, 8, 8, 8],
        'h' => [16, 16, 22, 25, 17, 17, 17],
        'i' => [4, 0, 12, 4, 4, 4, 14],
        'k' => [16, 16, 18, 20, 24, 20, 18],
        'l' => [12, 4, 4, 4, 4, 4, 14],
        'm' => [0, 0, 26, 21, 21, 17, 17],
        'n' => [0, 0, 22, 25, 17, 17, 17],
        'o' => [0, 0, 14, 17, 17, 17, 14],
        'r' => [0, 0, 22, 25, 16, 16, 16],
        's' => [0, 0, 14, 16, 14, 1, 30],
        't' => [8, 8, 28, 8, 8, 9, 6],
        'u' => [0, 0, 17, 17, 17, 19, 13],
        'v' => [0, 0, 17, 17, 17, 10, 4],
        'w' => [0, 0, 17, 17, 21, 21, 10],
        'x' => [0, 0, 17, 10, 4, 10, 17],
        'z' => [0, 0, 31, 2, 4, 8, 31],
        '=' => [0, 0, 31, 0, 31, 0, 0],
        '(' => [2, 4, 8, 8, 8, 4, 2],
        ')' => [8, 4, 2, 2, 2, 4, 8],
        '~' => [0, 0, 8, 21, 2, 0, 0],
        '@' => [14, 17, 1, 13, 21, 21, 14],
        '0' => [14, 17, 19, 21, 25, 17, 14],
        '1' => [4, 12, 4, 4, 4, 4, 14],
        '2' => [14, 17, 1, 2, 4, 8, 31],
        '3' => [31, 2, 4, 2, 1, 17, 14],
        '4' => [2, 6, 10, 18, 31, 2, 2],
        '5' => [31, 16, 30, 1, 1, 17, 14],
        '6' => [6, 8, 16, 30, 17, 17, 14],
        '7' => [31, 1, 2, 4, 8, 8, 8],
        '8' => [14, 17, 17, 14, 17, 17, 14],
        '9' => [14, 17, 17, 15, 1, 2, 12],
        'A' => [14, 17, 17, 31, 17, 17, 17],
        'B' => [30, 17, 17, 30, 17, 17, 30],
        'C' => [14, 17, 16, 16, 16, 17, 14],
        'D' => [28, 18, 17, 17, 17, 18, 28],
        'E' => [31, 16, 16, 30, 16, 16, 31],
        'F' => [31, 16, 16, 30, 16, 16, 16],
        'G' => [14, 17, 16, 23, 17, 17, 15],
        'H' => [17, 17, 17, 31, 17, 17, 17],
        'I' => [14, 4, 4, 4, 4, 4, 14],
        'J' => [7, 2, 2, 2, 2, 18, 12],
        'K' => [17, 18, 20, 24, 20, 18, 17],
        'L' => [16, 16, 16, 16, 16, 16, 31],
        'M' => [17, 27, 21, 21, 17, 17, 17],
        'N' => [17, 25, 21, 19, 17, 17, 17],
        'O' => [14, 17, 17, 17, 17, 17, 14],
        'P' => [30, 17, 17, 30, 16, 16, 16],
        'Q' => [14, 17, 17, 17, 21, 18, 13],
        'R' => [30, 17, 17, 30, 20, 18, 17],
        'S' => [15, 16, 16, 14, 1, 1, 30],
        'T' => [31, 4, 4, 4, 4, 4, 4],
        'U' => [17, 17, 17, 17, 17, 17, 14],
        'V' => [17, 17, 17, 17, 17, 10, 4],
        'W' => [17, 17, 17, 21, 21, 27, 17],
        'X' => [17, 17, 10, 4, 10, 17, 17],
        'Y' => [17, 17, 10, 4, 4, 4, 4],
        'Z' => [31, 1, 2, 4, 8, 16, 31],
        '.' => [0, 0, 0, 0, 0, 12, 12],
        ',' => [0, 0, 0, 0, 12, 4, 8],
        ':' => [0, 12, 12, 0, 12, 12, 0],
        '+' => [0, 4, 4, 31, 4, 4, 0],
        '-' => [0, 0, 0, 31, 0, 0, 0],
        '_' => [0, 0, 0, 0, 0, 0, 31],
        '/' => [1, 1, 2, 4, 8, 16, 16],
        '%' => [24, 25, 2, 4, 8, 19, 3],
        ' ' => [0; 7],
        _ => [31, 17, 17, 17, 17, 17, 31],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_compare::{Options, Plane, compare};

    #[test]
    fn equal_pictures_have_a_dark_difference_and_the_sheet_has_the_format_of_its_name() {
        let plane = Plane::from_fn(60, 40, |x, y| (x + y) as f32 / 100.0);
        let plate = Plate::from_planes([plane.clone(), plane.clone(), plane]);
        let comparison = compare(&plate, &plate, &Options::default()).unwrap();
        let sheet = ComparisonSheet::draw(
            &comparison,
            "new.png",
            "a/very/long/name/of/the/old/picture.rgb",
        );
        let middle = sheet.pixels[(BORDER + LINE + 50) * sheet.width + 3 * BORDER + 2 * 240 + 100];
        assert_eq!(middle, ramp(0.0));
        for (name, magic) in [
            ("a.png", &b"\x89PNG"[..]),
            ("a.JPG", b"\xff\xd8"),
            ("a.bmp", b"BM"),
        ] {
            let bytes = sheet.encode(Path::new(name)).unwrap();
            assert!(bytes.starts_with(magic), "{name}");
            let raster = ivcam_optics::picture::Raster::decode(&bytes, name).unwrap();
            assert_eq!(
                (raster.width as usize, raster.height as usize),
                (sheet.width, sheet.height)
            );
        }
        assert!(
            sheet
                .encode(Path::new("a.xyz"))
                .unwrap_err()
                .message
                .contains("a.xyz")
        );
    }

    #[test]
    fn every_character_of_the_numbers_has_a_shape_of_its_own() {
        let text = ('a'..='z')
            .chain('A'..='Z')
            .chain('0'..='9')
            .chain("+-.,:%/_()=".chars());
        let shapes: Vec<_> = text.map(glyph).collect();
        for (i, shape) in shapes.iter().enumerate() {
            assert_ne!(*shape, glyph('\u{1}'));
            assert!(!shapes[..i].contains(shape), "number {i}");
        }
    }

    #[test]
    fn a_long_name_keeps_its_end() {
        assert_eq!(fitting("scenes/livroom.png", 60), "..room.png");
        assert_eq!(fitting("new", 60), "new");
    }
}
