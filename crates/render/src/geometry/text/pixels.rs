//! Rasterizes `Text2` to gray pixels, with glyphs at integer positions.
//!
//! Glyphs are rasterized as FreeType does for Coin: from hinted outlines, with the coverage of each
//! pixel in 256ths. Without a named font Coin uses its own bitmaps, which look like Courier in four
//! sizes. Here these glyphs are rasterized from Courier with the same width.

use glam::{IVec2, Vec2};

use super::face::{Face, Family};
use super::glyph::{LineGlyph, Typeface};
use super::missing::MissingCharacters;
use super::style::{Justify, TextStyle};

/// A rasterized text or glyph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelText {
    /// The x of the left edge relative to the origin of the text, in pixels.
    pub left: i32,
    /// The y of the bottom edge relative to the origin of the text, in pixels.
    pub bottom: i32,
    /// The width in pixels.
    pub width: usize,
    /// The height in pixels.
    pub height: usize,
    /// The coverage of each pixel, row by row from the bottom.
    pub coverage: Vec<u8>,
    /// The position of the text's origin from the beginning of the longest line, in pixels.
    pub anchor: f32,
    /// Whether the text is centered.
    pub is_centered: bool,
    /// The lower left and upper right corner of Inventor's rectangle of the text, as if it were
    /// justified to the left, in pixels.
    pub rectangle: (IVec2, IVec2),
    /// The characters that are not drawn as written.
    pub(crate) missing: MissingCharacters,
}

impl PixelText {
    /// Returns whether a pixel is covered. A text of spaces has none.
    pub(crate) fn has_ink(&self) -> bool {
        self.coverage.iter().any(|&covered| covered > 0)
    }
}

/// The largest font size in pixels, which bounds memory. A larger glyph would be larger than a
/// picture.
const MAX_SIZE: f32 = 2048.0;
/// The largest number of pixels of one text, which bounds its memory.
const MAX_PIXELS: usize = 1 << 24;

/// The smallest coverage, in 256ths, at which a pixel of a bitmap glyph is set. No search is
/// recorded: a smaller value makes strokes thicker, and a larger one breaks thin strokes.
const INKED: u8 = 80;

/// A rasterized glyph, and its advance in pixels.
struct Letter {
    picture: PixelText,
    advance: i32,
}

/// Coin's built-in bitmap fonts: the font size below which each is used, and the width and height
/// of its glyphs in pixels.
const BUILT_IN: [(f32, i32, usize); 4] = [
    (14.0, 7, 14),
    (18.0, 10, 18),
    (26.0, 14, 27),
    (f32::INFINITY, 19, 36),
];

/// Rasterizes the strings of a `Text2`. The distance between lines is the font's size, rounded down
/// to pixels, times the spacing.
pub fn pixel_text<S: AsRef<str>>(strings: &[S], style: &TextStyle<'_>) -> PixelText {
    let font = PixelFont::open(style);
    let mut room = MAX_PIXELS;
    let lines: Vec<Vec<Letter>> = strings
        .iter()
        .map(|s| font.letters(s.as_ref(), &mut room))
        .collect();
    let width = |line: &Vec<Letter>| line.iter().map(|l| l.advance).sum::<i32>();
    let longest = lines.iter().map(width).max().unwrap_or(0);
    let step = (style.size.floor() * style.spacing) as i32;
    let mut placed: Vec<(i32, i32, &PixelText)> = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let mut x = match style.justify {
            Justify::Left => 0,
            Justify::Right => longest - width(line),
            Justify::Center => (longest - width(line)) / 2,
        };
        let y = (i as i32).saturating_mul(step.saturating_neg());
        for letter in line {
            let (left, bottom) = (letter.picture.left, letter.picture.bottom);
            placed.push((x + left, y.saturating_add(bottom), &letter.picture));
            x += letter.advance;
        }
    }
    let mut all = around(&placed);
    all.anchor = match style.justify {
        Justify::Left => 0.0,
        Justify::Right => longest as f32,
        Justify::Center => 0.5 * longest as f32,
    };
    all.is_centered = style.justify == Justify::Center;
    for (x, y, letter) in placed {
        all.put(x, y, letter);
    }
    all.rectangle = rectangle(&lines, step, font.cell());
    all.missing = font.typeface.missing();
    all
}

/// Returns Inventor's rectangle of a text as if it were justified to the left. For each line there
/// is the distance from the end of its advances to the end of its glyphs. The largest of these
/// distances is added to the end of the longest line (Coin).
fn rectangle(lines: &[Vec<Letter>], step: i32, cell: Option<IVec2>) -> (IVec2, IVec2) {
    let (mut low, mut high) = (IVec2::MAX, IVec2::MIN);
    let (mut longest, mut behind) = (0, i32::MIN);
    for (i, line) in lines.iter().enumerate() {
        let mut at = IVec2::new(0, (i as i32).saturating_mul(step.saturating_neg()));
        let mut end = i32::MIN;
        for Letter { picture, advance } in line {
            let (corner, size) = match cell {
                Some(size) => (at, size),
                None => (
                    at + IVec2::new(picture.left, picture.bottom),
                    IVec2::new(picture.width as i32, picture.height as i32),
                ),
            };
            (low, high) = (low.min(corner), high.max(corner + size));
            end = end.max(corner.x + size.x);
            at.x += advance;
        }
        longest = longest.max(at.x);
        behind = behind.max(end.saturating_sub(at.x));
    }
    high.x = high.x.max(longest.saturating_add(behind));
    (low, high)
}

/// Returns an empty raster that is large enough for all glyphs.
fn around(placed: &[(i32, i32, &PixelText)]) -> PixelText {
    let Some(&(x, y, _)) = placed.first() else {
        return PixelText::default();
    };
    let mut sides = (i64::from(x), i64::from(y), i64::from(x), i64::from(y));
    for &(x, y, letter) in placed {
        let (x, y) = (i64::from(x), i64::from(y));
        let (right, top) = (x + letter.width as i64, y + letter.height as i64);
        sides = (
            sides.0.min(x),
            sides.1.min(y),
            sides.2.max(right),
            sides.3.max(top),
        );
    }
    let (width, height) = ((sides.2 - sides.0) as usize, (sides.3 - sides.1) as usize);
    if width.saturating_mul(height) > MAX_PIXELS {
        return PixelText::default();
    }
    PixelText {
        left: sides.0 as i32,
        bottom: sides.1 as i32,
        width,
        height,
        coverage: vec![0; width * height],
        ..PixelText::default()
    }
}

impl PixelText {
    /// Composites a glyph over the text.
    fn put(&mut self, x: i32, y: i32, letter: &Self) {
        let (x, y) = ((x - self.left) as usize, (y - self.bottom) as usize);
        if self.coverage.is_empty() || letter.width == 0 {
            return;
        }
        for (row, levels) in letter.coverage.chunks_exact(letter.width).enumerate() {
            let from = (y + row) * self.width + x;
            let under = &mut self.coverage[from..from + letter.width];
            for (under, &level) in under.iter_mut().zip(levels) {
                let (old, new) = (u32::from(*under), u32::from(level));
                *under = ((old * (256 - new) + 256 * new) >> 8).min(255) as u8;
            }
        }
    }
}

/// A typeface at a size in pixels.
struct PixelFont<'a> {
    typeface: Typeface<'a>,
    pixels: f32,
    /// The height of the baseline in the cells of a bitmap font, and that of the cells, in pixels.
    cell: Option<(i32, usize)>,
}

impl<'a> PixelFont<'a> {
    fn open(style: &TextStyle<'a>) -> Self {
        let size = style.size.clamp(0.0, MAX_SIZE).floor();
        if !style.face.built_in {
            return Self {
                typeface: Typeface::open_at(style.face, size),
                pixels: size,
                cell: None,
            };
        }
        let fits = |(below, _, _): &&(f32, i32, usize)| size < *below;
        let (_, width, height) = BUILT_IN.iter().find(fits).copied().unwrap_or(BUILT_IN[3]);
        // The advance of Courier is 0.6 of its size, so it is the width again.
        let pixels = (width as f32 / 0.6 + 0.5).floor();
        let courier = Face {
            fonts: style.face.fonts,
            ..Face::plain(Family::Mono, false, false)
        };
        Self {
            typeface: Typeface::open_at(courier, pixels),
            pixels,
            cell: Some((height as i32 / 4, height)),
        }
    }

    /// Rasterizes the glyphs of a line, until `room` for their pixels is used up.
    fn letters(&self, line: &str, room: &mut usize) -> Vec<Letter> {
        if self.pixels < 1.0 {
            return Vec::new();
        }
        let glyphs = self.typeface.pixel_line(line, self.pixels);
        let mut last = 0.0;
        let letter = |glyph: LineGlyph| {
            let LineGlyph {
                character,
                advance,
                over,
            } = glyph;
            let tolerance = 1.0 / 64.0 / self.pixels.max(1.0);
            let outlines = self.typeface.outlines(character, tolerance);
            let mut picture = filled(&outlines, self.pixels);
            if let Some(over) = over {
                picture.left += (over - last + 0.5).floor() as i32;
            } else {
                last = advance;
            }
            if let Some((baseline, _)) = self.cell {
                picture
                    .coverage
                    .iter_mut()
                    .for_each(|c| *c = if *c < INKED { 0 } else { 255 });
                picture.bottom += baseline;
            }
            let advance = advance as i32;
            Letter { picture, advance }
        };
        let fits = |letter: &Letter| {
            let pixels = letter.picture.coverage.len();
            *room = room.saturating_sub(pixels);
            *room > 0
        };
        glyphs.into_iter().map(letter).take_while(fits).collect()
    }

    /// Returns the size of Inventor's rectangle for each glyph of a bitmap font: a cell that is 32
    /// pixels wide (Coin).
    fn cell(&self) -> Option<IVec2> {
        self.cell.map(|(_, height)| IVec2::new(32, height as i32))
    }
}

/// Rasterizes outlines, which have the font size 1, at a size in pixels.
fn filled(outlines: &[Vec<Vec2>], pixels: f32) -> PixelText {
    let points = || outlines.iter().flatten().map(|p| *p * pixels);
    let Some(first) = points().next() else {
        return PixelText::default();
    };
    let (low, high) = points().fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let (low, high) = (low.floor(), high.ceil());
    let (width, height) = ((high.x - low.x) as usize, (high.y - low.y) as usize);
    if width == 0 || height == 0 {
        return PixelText::default();
    }
    let mut areas = CoverageSteps::new(width, height);
    for outline in outlines {
        for (i, &a) in outline.iter().enumerate() {
            let b = outline[(i + 1) % outline.len()];
            areas.edge(a * pixels - low, b * pixels - low);
        }
    }
    PixelText {
        left: low.x as i32,
        bottom: low.y as i32,
        width,
        height,
        coverage: areas.levels(),
        ..PixelText::default()
    }
}

/// Accumulates the signed area to the right of edges. Each entry is the difference in coverage
/// between a pixel and the one on its left.
struct CoverageSteps {
    width: usize,
    steps: Vec<f32>,
}

impl CoverageSteps {
    fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            steps: vec![0.0; (width + 1) * height],
        }
    }

    /// Adds an edge.
    fn edge(&mut self, a: Vec2, b: Vec2) {
        let (low, high, sign) = if a.y < b.y { (a, b, 1.0) } else { (b, a, -1.0) };
        let slope = (high.x - low.x) / (high.y - low.y);
        if !slope.is_finite() {
            return; // a horizontal edge bounds no area
        }
        let at = |y: f32| low.x + (y - low.y) * slope;
        let rows = low.y as usize..(high.y.ceil() as usize).min(self.rows());
        for row in rows {
            let (y0, y1) = (low.y.max(row as f32), high.y.min(row as f32 + 1.0));
            self.step(row, at(y0), at(y1), sign * (y1 - y0));
        }
    }

    fn rows(&self) -> usize {
        self.steps.len() / (self.width + 1)
    }

    /// Adds the part of an edge within a row. Each column that it crosses gets its share of the
    /// height.
    fn step(&mut self, row: usize, x0: f32, x1: f32, height: f32) {
        let (left, right) = (x0.min(x1).max(0.0), x0.max(x1).min(self.width as f32));
        let row = &mut self.steps[row * (self.width + 1)..][..=self.width];
        let last = self.width - 1;
        let (from, to) = ((left as usize).min(last), (right as usize).min(last));
        for column in from..=to {
            let (l, r) = (left.max(column as f32), right.min(column as f32 + 1.0));
            let share = if right > left {
                (r - l) / (right - left)
            } else {
                1.0
            };
            // This is the part of the pixel to the right of the middle of the piece.
            let covered = column as f32 + 1.0 - 0.5 * (l + r);
            row[column] += height * share * covered;
            row[column + 1] += height * share * (1.0 - covered);
        }
    }

    /// Returns the coverage of all pixels.
    fn levels(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(self.width * self.rows());
        for row in self.steps.chunks_exact(self.width + 1) {
            let mut sum = 0.0;
            out.extend(row[..self.width].iter().map(|step| {
                sum += step;
                (256.0 * sum.abs() + 1e-2) as u8
            }));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_covers_its_share_of_every_pixel() {
        let triangle = vec![vec![Vec2::ZERO, Vec2::new(2.0, 0.0), Vec2::new(0.0, 2.0)]];
        let picture = filled(&triangle, 1.0);
        assert_eq!((picture.width, picture.height), (2, 2));
        assert_eq!(picture.coverage, [255, 128, 128, 0]);
    }

    #[test]
    fn a_slope_over_several_pixels_sums_to_its_area() {
        let slope = vec![vec![
            Vec2::new(0.3, 0.2),
            Vec2::new(6.7, 0.9),
            Vec2::new(2.1, 3.4),
        ]];
        let picture = filled(&slope, 1.0);
        let sum: f32 = picture.coverage.iter().map(|&c| f32::from(c) / 256.0).sum();
        let area = 0.5 * Vec2::new(6.4, 0.7).perp_dot(Vec2::new(1.8, 3.2));
        assert!((sum - area).abs() < 0.06, "{sum} for {area}");
    }

    #[test]
    fn the_pixels_of_a_text_of_huge_letters_are_bounded() {
        let style = TextStyle {
            face: Face::named("Courier"),
            size: 1e9,
            spacing: 1.0,
            justify: Justify::Left,
            complexity: 0.5,
        };
        let text = pixel_text(&["M".repeat(1000)], &style);
        assert!(text.coverage.len() <= 2 * MAX_PIXELS);
        let none = pixel_text(&["M"], &TextStyle { size: 0.0, ..style });
        assert!(none.coverage.is_empty());
    }

    #[test]
    fn lines_are_at_integer_pixels() {
        let style = TextStyle {
            face: Face::named("Courier"),
            size: 20.0,
            spacing: 1.5,
            justify: Justify::Center,
            complexity: 0.5,
        };
        let text = pixel_text(&["HH", "H"], &style);
        // Courier's letters are six tenths of the size wide.
        assert_eq!(text.anchor, 12.0);
        assert!(text.bottom == -30 && text.left >= 0 && text.width <= 24);
    }
}
