//! Lays out the glyphs of Inventor's texts.

use glam::Vec2;

use super::glyph::{LineGlyph, Typeface, length};
use super::letters::LetterOrder;
use super::letters::MAX_GLYPHS;
use super::missing::MissingCharacters;
use super::style::{Justify, TextStyle};

/// A glyph at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlacedGlyph {
    /// The character.
    pub character: char,
    /// The position of the glyph's origin.
    pub origin: Vec2,
    /// The scale of the glyph's width.
    pub stretch: f32,
}

/// The glyphs of a text at their places, with Coin's bounding box.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// The glyphs, line by line.
    pub(crate) glyphs: Vec<PlacedGlyph>,
    /// The smallest x of the lines, by advances and not by outlines.
    pub left: f32,
    /// The largest x of the lines, by advances and not by outlines.
    pub right: f32,
    /// The lower end of the box.
    pub bottom: f32,
    /// The upper end of the box, for solid text only.
    pub top: f32,
    /// Whether the text has more characters than are drawn.
    pub is_cut: bool,
    /// The characters that are not drawn as written.
    pub(crate) missing: MissingCharacters,
}

/// Lays out the glyphs of a `Text3`. The baseline of line n is at y = −n · spacing · size.
pub(crate) fn layout<S: AsRef<str>>(strings: &[S], style: &TextStyle<'_>) -> Layout {
    let font = Typeface::open(style.face);
    let mut out = Layout::default();
    let (mut low, mut high) = (0.0f32, 0.0f32);
    for (i, line) in strings.iter().enumerate() {
        let line = font.line(line.as_ref(), LetterOrder::Visual, style.size);
        // A slanted last glyph may extend beyond its advance.
        let width = length(&line).max(font.ink_width(&line, style.size));
        let left = start(style.justify, width);
        let y = -(i as f32) * style.spacing * style.size;
        out.set(&line, Vec2::new(left, y), 1.0);
        out.extend(left, left + width);
        (low, high) = (0.0, 0.0);
        for glyph in &line {
            let reach = font.reach(glyph.character);
            low = low.min(style.size * reach.0.y);
            high = high.max(style.size * reach.1.y);
        }
    }
    // Coin's box contains the glyphs of the last line at the first line, and at the place that the
    // last line would have with spacing 1.
    let before = strings.len().saturating_sub(1) as f32 * style.size;
    out.bottom = (-before * style.spacing).min(low - before).min(low);
    out.top = high;
    out.missing = font.missing();
    out
}

/// Lays out the glyphs of an `AsciiText`.
///
/// A line with a positive width is compressed or expanded to it, glyphs and advances alike (VRML
/// 1.0, AsciiText); Coin scales the advances alone, so that letters overlap. A line ends at the end
/// of its last glyph's outline, so that `RIGHT` is flush.
pub(crate) fn ascii_layout<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    widths: &[f32],
) -> Layout {
    let font = Typeface::open(style.face);
    let mut out = Layout::default();
    let mut low = 0.0f32;
    for (i, line) in strings.iter().enumerate() {
        let line = font.line(line.as_ref(), LetterOrder::Visual, style.size);
        let wanted = widths.get(i).copied().filter(|w| *w > 0.0 && w.is_finite());
        let natural = font.ink_width(&line, style.size);
        let (stretch, width) = match wanted.filter(|_| natural > 0.0) {
            Some(wanted) => (wanted / natural, wanted),
            None => (1.0, natural),
        };
        let left = start(style.justify, width);
        let origin = Vec2::new(left, -(i as f32) * style.spacing * style.size);
        out.set(&line, origin, stretch);
        for glyph in line.iter().filter(|glyph| glyph.is_spacing()) {
            let (reach, _) = font.reach(glyph.character);
            low = low.min(style.size * reach.min_element());
        }
        out.extend(left, left + width);
    }
    // Coin's box ends where the glyphs of the last line would end at spacing 1. It also treats the
    // extent of a glyph to the left of its origin as if it were below the origin.
    let below = strings.len().saturating_sub(1) as f32 * style.size;
    out.bottom = (-below * style.spacing).min(low - below);
    out.missing = font.missing();
    out
}

/// Returns the beginning of a line of a given width.
fn start(justify: Justify, width: f32) -> f32 {
    match justify {
        Justify::Left => 0.0,
        Justify::Right => -width,
        Justify::Center => -0.5 * width,
    }
}

impl Layout {
    /// Adds a line of glyphs, whose widths and advances are scaled.
    fn set(&mut self, line: &[LineGlyph], origin: Vec2, stretch: f32) {
        let (mut x, mut letter) = (origin.x, origin.x);
        for glyph in line {
            if glyph.is_spacing() {
                letter = x;
            }
            let x_of_glyph = glyph.over.map_or(x, |over| letter + over * stretch);
            self.push(glyph.character, Vec2::new(x_of_glyph, origin.y), stretch);
            x += glyph.advance * stretch;
        }
    }

    /// Adds a glyph, unless the text is too long or the place is not finite.
    pub(super) fn push(&mut self, character: char, origin: Vec2, stretch: f32) {
        self.is_cut |= self.glyphs.len() == MAX_GLYPHS;
        if !self.is_cut && origin.is_finite() {
            self.glyphs.push(PlacedGlyph {
                character,
                origin,
                stretch,
            });
        }
    }

    /// Extends the box to the ends of a line.
    pub(super) fn extend(&mut self, left: f32, right: f32) {
        self.left = self.left.min(left);
        self.right = self.right.max(right);
    }
}
