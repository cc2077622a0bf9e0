//! VRML97's `Text` as Coin sets it, for holding pictures and boxes against Coin's.
//!
//! Seen in Coin 4 and not as the standard (6.47, 6.22) has it: a minor justification in the middle or
//! at the end stacks the lines upward; a `length` is added to a line, spread over its letters; a
//! `maxExtent` presses the steps between letters together, not the letters; columns begin a unit
//! below the text's point.

use glam::Vec2;

use super::glyph::Typeface;
use super::vrml97::{Align, Vrml97Style};
use super::{Layout, MAX_GLYPHS};

/// A text's lines, measured in font sizes.
struct Lines {
    letters: Vec<Vec<(char, f32)>>,
    /// The advances' sum, or up to the last letter's ink where that reaches farther.
    widths: Vec<f32>,
}

impl Lines {
    fn of<S: AsRef<str>>(strings: &[S], font: &Typeface<'_>) -> Self {
        let letters: Vec<_> = strings
            .iter()
            .map(|s| font.advances(s.as_ref(), 1.0))
            .collect();
        let width = |line: &Vec<(char, f32)>| {
            let full: f32 = line.iter().map(|l| l.1).sum();
            full.max(font.ink_width(line, 1.0))
        };
        let widths = letters.iter().map(width).collect();
        Self { letters, widths }
    }
}

/// Where Coin stands the letters.
pub fn layout<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
    max_extent: f32,
) -> Layout {
    let lines = Lines::of(strings, &Typeface::open(style.face));
    let mut out = Layout::default();
    let mut row = 0.0;
    for (i, letters) in lines.letters.iter().enumerate() {
        if out.glyphs.len() >= MAX_GLYPHS {
            break;
        }
        let count = letters.len().max(1) as f32;
        let extra = lengths.get(i).copied().unwrap_or(0.0) * style.size / count;
        let width = lines.widths[i];
        let squeeze = if max_extent > 0.0 && width > max_extent {
            max_extent * style.size / width
        } else {
            1.0
        };
        let step = |advance: f32| (advance + extra) * squeeze * style.size;
        if style.horizontal {
            across(
                letters,
                begin(i, lines.letters.len(), width, row, style),
                step,
                style,
                &mut out,
            );
        } else {
            down(
                letters,
                top(i, lines.letters.len(), letters.len(), style),
                style,
                &mut out,
            );
        }
        let line = style.spacing * style.size;
        row += if style.top_to_bottom { -line } else { line };
    }
    out
}

/// Where a row begins.
fn begin(i: usize, count: usize, width: f32, row: f32, style: &Vrml97Style<'_>) -> Vec2 {
    let sign = if style.left_to_right { -1.0 } else { 1.0 };
    let x = match style.major {
        Align::Begin | Align::First => 0.0,
        Align::Middle => 0.5 * sign * width * style.size,
        Align::End => sign * width * style.size,
    };
    let (i, n) = (i as f32, count as f32);
    let line = style.spacing * style.size;
    let y = match style.minor {
        Align::Begin | Align::First => row,
        Align::Middle => (i - 0.5 * n) * line,
        Align::End => (i + n - 1.0) * line,
    };
    Vec2::new(x, y)
}

fn across(
    letters: &[(char, f32)],
    mut at: Vec2,
    step: impl Fn(f32) -> f32,
    style: &Vrml97Style<'_>,
    out: &mut Layout,
) {
    for &(character, advance) in letters {
        if !style.left_to_right {
            at.x -= step(advance);
        }
        out.push(character, at, 1.0);
        if style.left_to_right {
            at.x += step(advance);
        }
    }
}

/// Where the letters of a column begin.
fn top(i: usize, count: usize, letters: usize, style: &Vrml97Style<'_>) -> Vec2 {
    let line = style.spacing * style.size;
    let (i, n, letters) = (i as f32, count as f32, letters as f32);
    let sign = if style.top_to_bottom { 1.0 } else { -1.0 };
    let y = match style.major {
        Align::Begin | Align::First => -1.0,
        Align::Middle => 0.5 * sign * letters * style.size,
        Align::End => sign * letters * line,
    };
    let back = match style.minor {
        Align::Begin | Align::First => 0.0,
        Align::Middle => 0.5 * (n - 1.0) * line * style.size,
        Align::End => (n - 1.0) * line * style.size,
    };
    let x = if style.left_to_right {
        i * line
    } else {
        -i * line
    };
    Vec2::new(x - back, y)
}

fn down(letters: &[(char, f32)], mut at: Vec2, style: &Vrml97Style<'_>, out: &mut Layout) {
    for &(character, _) in letters {
        out.push(character, at, 1.0);
        at.y += if style.top_to_bottom {
            -style.size
        } else {
            style.size
        };
    }
}

/// The size that Inventor gives a text without a `Font`, by which Coin measures what letters reach
/// below the last line, whatever the size they have.
const FONT_SIZE: f32 = 12.0;

/// The lower left and upper right corner of Coin's box, by lines and sizes rather than ink.
pub fn rectangle<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
) -> Option<(Vec2, Vec2)> {
    let font = Typeface::open(style.face);
    let lines = Lines::of(strings, &font);
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
        let reach = last.map(|&(c, _)| font.reach(c).0.min_element());
        let below = FONT_SIZE * reach.fold(0.0, f32::min) - before * style.size * style.spacing;
        (low.y, high.y) = (low.y.min(below), high.y.max(below));
    }
    // An extension to a point on the axis: the box holds x = 0 too.
    if style.top_to_bottom {
        (low.x, high.x) = (low.x.min(0.0), high.x.max(0.0));
    }
    Some((low, high))
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_justified_to_their_end_are_stacked_upward() {
        let end = Vrml97Style::DEFAULT.justified(&["BEGIN", "END"]);
        let laid = layout(&["H", "H", "H"], &end, &[], 0.0);
        let rows: Vec<f32> = laid.glyphs.iter().map(|g| g.origin.y).collect();
        assert_eq!(rows, [2.0, 3.0, 4.0]);
    }

    #[test]
    fn a_length_is_spread_over_the_letters() {
        let steps = |length: f32| {
            let laid = layout(&["HHHH"], &Vrml97Style::DEFAULT, &[length], 0.0);
            laid.glyphs[1].origin.x
        };
        assert!((steps(2.0) - steps(0.0) - 0.5).abs() < 1e-6);
    }
}
