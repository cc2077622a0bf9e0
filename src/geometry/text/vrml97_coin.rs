//! VRML97's `Text` as Coin sets it, for holding pictures and boxes against Coin's.
//!
//! Seen in Coin 4 and not as the standard (6.47, 6.22) has it: a minor justification in the middle
//! or at the end stacks the lines upward; a `length` is added to a line, spread over its letters; a
//! `maxExtent` presses the steps between letters together, not the letters; columns begin a unit
//! below the text's point.

use glam::Vec2;

use super::glyph::{MAX_GLYPHS, Typeface};
use super::layout::Layout;
use super::style::{Align, Vrml97Style};
use super::vrml97_bounds::Lines;

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
