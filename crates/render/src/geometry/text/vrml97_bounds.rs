//! Computes the bounding box of a VRML97 `Text` as Coin does, from lines and font sizes.

use glam::Vec2;

use super::glyph::{LineGlyph, Typeface, length};
use super::style::{Align, Vrml97Style};
use super::vrml97::order;

/// The lines of a text, measured in font sizes.
struct Lines {
    /// The glyphs with their advances.
    letters: Vec<Vec<LineGlyph>>,
    /// The larger of the sum of the advances and the length up to the end of the last glyph's
    /// outline.
    widths: Vec<f32>,
}

impl Lines {
    fn of<S: AsRef<str>>(strings: &[S], font: &Typeface<'_>, style: &Vrml97Style<'_>) -> Self {
        let letters: Vec<_> = strings
            .iter()
            .map(|s| font.line(s.as_ref(), order(style), 1.0))
            .collect();
        let width = |line: &Vec<LineGlyph>| length(line).max(font.ink_width(line, 1.0));
        let widths = letters.iter().map(width).collect();
        Self { letters, widths }
    }
}

/// The font size of an Inventor text without a `Font`. Coin computes the extent of glyphs below the
/// last line at this size, whatever size they have.
const FONT_SIZE: f32 = 12.0;

/// Returns the lower left and upper right corner of Coin's box, or `None` if the text is empty. The
/// box is computed from lines and sizes, not from outlines.
pub(crate) fn vrml97_bounds<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
) -> Option<(Vec2, Vec2)> {
    let font = Typeface::open(style.face);
    let lines = Lines::of(strings, &font, style);
    let widest = lines.widths.iter().copied().fold(0.0, f32::max);
    if widest <= 0.0 {
        return None;
    }
    let added = lengths.iter().copied().fold(0.0, f32::max) * style.size;
    let before = lines.letters.len() as f32 - 1.0;
    let (mut low, mut high) = if style.horizontal {
        across_rectangle(widest, added, before, style)
    } else {
        let most = strings.iter().map(|s| s.as_ref().len()).max().unwrap_or(0) as f32;
        down_rectangle(most, added, before, style)
    };
    if style.top_to_bottom {
        let last = lines.letters.last().into_iter().flatten();
        let last = last.filter(|glyph| glyph.is_spacing());
        let reach = last.map(|glyph| font.reach(glyph.character).0.min_element());
        let below = FONT_SIZE * reach.fold(0.0, f32::min) - before * style.size * style.spacing;
        (low.y, high.y) = (low.y.min(below), high.y.max(below));
    }
    // Coin extends the box to a point on the axis, so that it contains x = 0.
    if style.top_to_bottom {
        (low.x, high.x) = (low.x.min(0.0), high.x.max(0.0));
    }
    Some((low, high))
}

/// Returns the box of a horizontal text. `before` is the number of lines before the last one.
fn across_rectangle(widest: f32, added: f32, before: f32, style: &Vrml97Style<'_>) -> (Vec2, Vec2) {
    let (size, line) = (style.size, style.spacing * style.size);
    let (full, own) = ((widest + added) * size, widest * size);
    let (left, right) = match (style.major, style.left_to_right) {
        (Align::Begin | Align::First, true) => (0.0, full),
        (Align::Begin | Align::First, false) => (-full, 0.0),
        (Align::End, true) => (-own, 0.0),
        (Align::End, false) => (0.0, own),
        (Align::Middle, _) => (-0.5 * own, full - 0.5 * own),
    };
    let (bottom, top) = if style.top_to_bottom {
        (-line * before, size)
    } else {
        (0.0, line * before)
    };
    let up = before
        * size
        * match style.minor {
            Align::Begin | Align::First => 0.0,
            Align::Middle => 0.5,
            Align::End => 1.0,
        };
    (Vec2::new(left, bottom + up), Vec2::new(right, top + up))
}

/// Returns the box of a vertical text. `most` is the number of bytes of the longest string.
fn down_rectangle(most: f32, added: f32, before: f32, style: &Vrml97Style<'_>) -> (Vec2, Vec2) {
    let (size, spacing) = (style.size, style.spacing);
    let (left, right) = if style.left_to_right {
        (0.0, before * spacing + size)
    } else {
        (
            -(before + 3.0) * spacing * 0.5,
            before * spacing * 0.5 - size,
        )
    };
    let (bottom, top) = if style.top_to_bottom {
        (-most * size - added, 0.0)
    } else {
        (0.0, most + added)
    };
    let up = most
        * match style.major {
            Align::Begin | Align::First => 0.0,
            Align::Middle => 0.5,
            Align::End => 1.0,
        };
    let back = before
        * match style.minor {
            Align::Begin | Align::First => 0.0,
            Align::Middle => 0.5,
            Align::End => 1.0,
        };
    (
        Vec2::new(left - back, bottom + up),
        Vec2::new(right - back, top + up),
    )
}
