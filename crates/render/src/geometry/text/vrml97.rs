//! Lays out the glyphs of a VRML97 `Text` (6.47) with its `FontStyle` (6.22).

use glam::Vec2;

use super::glyph::{LineGlyph, Typeface, length};
use super::layout::Layout;
use super::letters::LetterOrder;
use super::style::{Align, Vrml97Style};

/// The fraction of a line's height above its baseline. The standard does not specify it.
pub(super) const ABOVE: f32 = 0.8;

/// Lays out the glyphs of a VRML97 `Text`. The standard does not specify the height of a line; here
/// it is the font's size.
pub(crate) fn vrml97_layout<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
    max_extent: f32,
) -> Layout {
    let font = Typeface::open(style.face);
    let lines: Vec<MeasuredString> = strings
        .iter()
        .enumerate()
        .map(|(i, s)| MeasuredString::new(&font, s.as_ref(), style, lengths.get(i).copied()))
        .collect();
    let longest = lines.iter().map(|l| l.length).fold(0.0, f32::max);
    let squeeze = if max_extent > 0.0 && longest > max_extent {
        max_extent / longest
    } else {
        1.0
    };
    let mut out = Layout {
        missing: font.missing(),
        ..Layout::default()
    };
    for (i, line) in lines.iter().enumerate() {
        line.place(i, lines.len(), squeeze, style, &mut out);
    }
    out
}

/// A string of a VRML97 text, measured along the major axis.
struct MeasuredString {
    /// The glyphs, in the order in which the text advances.
    glyphs: Vec<LineGlyph>,
    /// The space added between two characters.
    gap: f32,
    /// The scale of the characters' widths.
    stretch: f32,
    length: f32,
}

impl MeasuredString {
    fn new(font: &Typeface<'_>, text: &str, style: &Vrml97Style<'_>, wanted: Option<f32>) -> Self {
        let glyphs = font.line(text, order(style), style.size);
        let count = glyphs.iter().filter(|glyph| glyph.is_spacing()).count();
        let natural = if style.horizontal {
            length(&glyphs)
        } else {
            count as f32 * style.size
        };
        let wanted = wanted.unwrap_or(0.0);
        let (gap, stretch) = fit(natural, wanted, count);
        let length = if wanted > 0.0 { wanted } else { natural };
        Self {
            glyphs,
            gap,
            stretch,
            length,
        }
    }

    /// Adds the glyphs of line `i` of `count` to a layout.
    fn place(
        &self,
        i: usize,
        count: usize,
        squeeze: f32,
        style: &Vrml97Style<'_>,
        out: &mut Layout,
    ) {
        let step = style.spacing * style.size;
        let length = self.length * squeeze;
        let begin = match style.major {
            Align::Begin | Align::First => 0.0,
            Align::Middle => -0.5 * length,
            Align::End => -length,
        };
        let block = style.size + step * count.saturating_sub(1) as f32;
        let across = i as f32 * step;
        let mut along = begin;
        let mut letter = Vec2::ZERO;
        for &LineGlyph {
            character,
            advance,
            over,
        } in &self.glyphs
        {
            let width = if style.horizontal {
                advance
            } else {
                style.size
            };
            let origin = if style.horizontal {
                let x = if style.left_to_right {
                    along
                } else {
                    -along - width * self.stretch * squeeze
                };
                Vec2::new(x, row(across, block, style))
            } else {
                let top = if style.top_to_bottom {
                    -along
                } else {
                    along + style.size
                };
                Vec2::new(column(across, block, style), top - ABOVE * style.size)
            };
            let stretch = if style.horizontal {
                self.stretch * squeeze
            } else {
                1.0
            };
            if let Some(over) = over {
                out.push(character, letter + Vec2::new(over * stretch, 0.0), stretch);
                continue;
            }
            letter = origin;
            out.push(character, origin, stretch);
            out.extend(origin.x, origin.x + advance * stretch);
            along += (width * self.stretch + self.gap) * squeeze;
        }
    }
}

/// Returns the order in which a text advances. A text that advances to the right is reordered for
/// reading; other directions place the characters as they are in the string.
pub(super) fn order(style: &Vrml97Style<'_>) -> LetterOrder {
    if style.horizontal && style.left_to_right {
        LetterOrder::Visual
    } else {
        LetterOrder::Logical
    }
}

/// Returns the baseline of a line at the distance `across` from the first line. `block` is the
/// height of all lines.
fn row(across: f32, block: f32, style: &Vrml97Style<'_>) -> f32 {
    let below = (1.0 - ABOVE) * style.size;
    let above = ABOVE * style.size;
    if style.top_to_bottom {
        let first = match style.minor {
            Align::First => 0.0,
            Align::Begin => -above,
            Align::Middle => 0.5 * block - above,
            Align::End => block - above,
        };
        first - across
    } else {
        let first = match style.minor {
            Align::First => 0.0,
            Align::Begin => below,
            Align::Middle => below - 0.5 * block,
            Align::End => below - block,
        };
        first + across
    }
}

/// Returns the left edge of a column at the distance `across` from the first column. `block` is the
/// width of all columns.
fn column(across: f32, block: f32, style: &Vrml97Style<'_>) -> f32 {
    let begin = match style.minor {
        Align::First | Align::Begin => 0.0,
        Align::Middle => -0.5 * block,
        Align::End => -block,
    };
    if style.left_to_right {
        begin + across
    } else {
        -begin - across - style.size
    }
}

/// Returns the space to add between characters and the scale of their widths for a line of the
/// wanted width. A line is extended by spaces and shortened by the scale.
fn fit(natural: f32, wanted: f32, count: usize) -> (f32, f32) {
    if !(wanted > 0.0 && natural > 0.0 && wanted.is_finite()) {
        (0.0, 1.0)
    } else if wanted > natural && count > 1 {
        ((wanted - natural) / (count - 1) as f32, 1.0)
    } else {
        (0.0, wanted / natural)
    }
}
