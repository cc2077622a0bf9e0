//! VRML97's `Text` (6.47) with its `FontStyle` (6.22).

use glam::Vec2;

use super::face::Face;
use super::glyph::Typeface;
use super::{Layout, coin97, fit, flat};
use crate::geometry::Mesh;

/// VRML97's justification along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    Begin,
    First,
    Middle,
    End,
}

impl Align {
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "BEGIN" => Some(Self::Begin),
            "FIRST" => Some(Self::First),
            "MIDDLE" => Some(Self::Middle),
            "END" => Some(Self::End),
            _ => None,
        }
    }
}

/// How VRML97 sets a text: `FontStyle`'s fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vrml97Style<'a> {
    pub face: Face<'a>,
    pub size: f32,
    pub spacing: f32,
    pub horizontal: bool,
    pub left_to_right: bool,
    pub top_to_bottom: bool,
    pub major: Align,
    pub minor: Align,
    pub complexity: f32,
}

impl Vrml97Style<'_> {
    pub const DEFAULT: Self = Self {
        face: Face::DEFAULT,
        size: 1.0,
        spacing: 1.0,
        horizontal: true,
        left_to_right: true,
        top_to_bottom: true,
        major: Align::Begin,
        minor: Align::First,
        complexity: 0.5,
    };

    /// Sets major and minor from the field `justify`; an empty string is `BEGIN`, silence `FIRST`.
    pub fn justified<S: AsRef<str>>(mut self, justify: &[S]) -> Self {
        let named = |i: usize| justify.get(i).and_then(|s| Align::named(s.as_ref()));
        self.major = named(0).unwrap_or(Align::Begin);
        self.minor = named(1).unwrap_or(Align::First);
        self
    }
}

/// How far a line reaches above its baseline, as a share of the size; the rest is below.
pub(super) const ABOVE: f32 = 0.8;

/// Where the glyphs of a VRML97 `Text` stand (section 6.47 with 6.22). The standard leaves the
/// height of a line open; here it is the size, four fifths of it above the baseline.
pub fn vrml97_layout<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
    max_extent: f32,
) -> Layout {
    let font = Typeface::open(style.face);
    let lines: Vec<Line> = strings
        .iter()
        .enumerate()
        .map(|(i, s)| Line::new(&font, s.as_ref(), style, lengths.get(i).copied()))
        .collect();
    let longest = lines.iter().map(|l| l.length).fold(0.0, f32::max);
    let squeeze = if max_extent > 0.0 && longest > max_extent {
        max_extent / longest
    } else {
        1.0
    };
    let mut out = Layout::default();
    for (i, line) in lines.iter().enumerate() {
        line.place(i, lines.len(), squeeze, style, &mut out);
    }
    out
}

/// A string of a VRML97 text with its steps along the major axis.
struct Line {
    advances: Vec<(char, f32)>,
    gap: f32,
    stretch: f32,
    length: f32,
}

impl Line {
    fn new(font: &Typeface<'_>, text: &str, style: &Vrml97Style<'_>, wanted: Option<f32>) -> Self {
        let advances = font.advances(text, style.size);
        let natural: f32 = if style.horizontal {
            advances.iter().map(|a| a.1).sum()
        } else {
            advances.len() as f32 * style.size
        };
        let wanted = wanted.unwrap_or(0.0);
        let (gap, stretch) = fit(natural, wanted, advances.len());
        let length = if wanted > 0.0 { wanted } else { natural };
        Self {
            advances,
            gap,
            stretch,
            length,
        }
    }

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
        for &(character, advance) in &self.advances {
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
            out.push(character, origin, stretch);
            out.extend(origin.x, origin.x + advance * stretch);
            along += (width * self.stretch + self.gap) * squeeze;
        }
    }
}

/// The baseline of the line that is `across` past the first, in a block of that height.
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

/// The left edge of the column that is `across` past the first.
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

/// A VRML97 `Text`: flat, in z = 0; set as the standard says or as Coin does.
pub fn vrml97_text<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
    max_extent: f32,
    as_coin: bool,
) -> Mesh {
    let laid = if as_coin {
        coin97::layout(strings, style, lengths, max_extent)
    } else {
        vrml97_layout(strings, style, lengths, max_extent)
    };
    flat(&laid, style.face, style.size, style.complexity)
}
