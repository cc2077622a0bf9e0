//! Strings to triangles: `Text3`, `AsciiText`, VRML97's `Text`, and `Text2` in pixels.
//!
//! Twelve typefaces stand for every font a file may name (`fonts/LICENSE.txt`), so that a picture
//! is the same on every machine; folders of the user's own go first where they are given
//! (`library`). The twelve have the metrics of Times, Helvetica and Courier, which is
//! what SGI's and Coin's libraries draw for those names. Glyph outlines are cut into lines once a
//! call; nothing here is touched by a scene without text.
//!
//! Not done: kerning, ligatures, right-to-left scripts, anything past Latin-1.

mod coin97;
mod face;
mod glyph;
mod library;
mod pixels;
mod solid;
mod vrml97;

use glam::{Vec2, Vec3};

pub use coin97::rectangle as coin97_rectangle;
pub use face::{Face, Family};
pub use library::{Fonts, Own};
pub use pixels::{PixelText, pixel_text};
pub use solid::{BACK, FRONT, SIDES, text3};
pub use vrml97::{Align, Vrml97Style, vrml97_layout, vrml97_text};

use crate::geometry::Mesh;
use glyph::{Glyphs, Typeface};

/// Characters drawn a call; a file with more in one node is cut off there.
pub const MAX_GLYPHS: usize = 50_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Justify {
    Left,
    Right,
    Center,
}

impl Justify {
    /// From the value of an Inventor `justification` (`LEFT` 1, `RIGHT` 2, `CENTER` 3).
    pub fn from_value(value: i32) -> Self {
        match value {
            2 => Self::Right,
            3 => Self::Center,
            _ => Self::Left,
        }
    }
}

/// How Inventor and VRML 1.0 set a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle<'a> {
    pub face: Face<'a>,
    /// Distance between baselines at spacing 1: the font's size.
    pub size: f32,
    pub spacing: f32,
    pub justify: Justify,
    /// Inventor's complexity, 0 to 1: how finely curves are cut.
    pub complexity: f32,
}

/// A character and where its origin stands; `stretch` scales its width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedGlyph {
    pub character: char,
    pub origin: Vec2,
    pub stretch: f32,
}

/// The characters of a text in place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    pub glyphs: Vec<PlacedGlyph>,
    /// What the lines take up in x: advances, not ink. Coin's bounding boxes are these in x.
    pub left: f32,
    pub right: f32,
    /// Where Coin's box ends below, and of solid text above.
    pub bottom: f32,
    pub top: f32,
}

/// Where the glyphs of an Inventor text stand: line n's baseline is at y = −n · spacing · size.
pub fn layout<S: AsRef<str>>(strings: &[S], style: &TextStyle<'_>) -> Layout {
    let font = Typeface::open(style.face);
    let mut out = Layout::default();
    let (mut low, mut high) = (0.0f32, 0.0f32);
    for (i, line) in strings.iter().enumerate() {
        let advances = font.advances(line.as_ref(), style.size);
        let full: f32 = advances.iter().map(|a| a.1).sum();
        // A slanted last letter may reach past its advance.
        let width = full.max(font.ink_width(&advances, style.size));
        let left = start(style.justify, width);
        let y = -(i as f32) * style.spacing * style.size;
        out.set(&advances, Vec2::new(left, y));
        out.extend(left, left + width);
        (low, high) = (0.0, 0.0);
        for &(character, _) in &advances {
            let reach = font.reach(character);
            low = low.min(style.size * reach.0.y);
            high = high.max(style.size * reach.1.y);
        }
    }
    // Coin's box: the last line's letters, from the first line and from the last as if lines had no
    // spacing.
    let before = strings.len().saturating_sub(1) as f32 * style.size;
    out.bottom = (-before * style.spacing).min(low - before).min(low);
    out.top = high;
    out
}

/// Where the glyphs of an `AsciiText` stand. A line with a positive width is spread out or pressed
/// together to it by the steps between its letters, never by the letters themselves (Coin); a width
/// below that of a letter puts them all in one place. A line ends where its last letter's ink
/// ends, so that `RIGHT` is flush.
pub fn ascii_layout<S: AsRef<str>>(strings: &[S], style: &TextStyle<'_>, widths: &[f32]) -> Layout {
    let font = Typeface::open(style.face);
    let mut out = Layout::default();
    let mut low = 0.0f32;
    for (i, line) in strings.iter().enumerate() {
        let advances = font.advances(line.as_ref(), style.size);
        let wanted = widths.get(i).copied().filter(|w| *w > 0.0 && w.is_finite());
        let (stretch, width) = stretch(&font, &advances, style.size, wanted);
        let left = start(style.justify, width);
        let mut at = Vec2::new(left, -(i as f32) * style.spacing * style.size);
        for &(character, advance) in &advances {
            out.push(character, at, 1.0);
            at.x += advance * stretch;
            let (reach, _) = font.reach(character);
            low = low.min(style.size * reach.min_element());
        }
        out.extend(left, left + width);
    }
    // Coin lets letters reach below the last line as if lines had no spacing, and takes what is
    // left of a letter's origin for what is below it.
    let below = strings.len().saturating_sub(1) as f32 * style.size;
    out.bottom = (-below * style.spacing).min(low - below);
    out
}

/// How much longer the steps between letters get, and how long the line is then. The letter that
/// ends last keeps its width (Coin).
fn stretch(
    font: &Typeface<'_>,
    advances: &[(char, f32)],
    size: f32,
    wanted: Option<f32>,
) -> (f32, f32) {
    let natural = font.ink_width(advances, size);
    let Some(wanted) = wanted.filter(|_| natural > 0.0) else {
        return (1.0, natural);
    };
    let (mut from, mut last, mut width) = (0.0, 0.0, 0.0);
    let mut end = 0.0;
    for &(character, advance) in advances {
        let own = size * font.width(character);
        let ends = from * wanted / natural + own;
        if ends > end {
            (end, last, width) = (ends, from, own);
        }
        from += advance;
    }
    if natural <= width || wanted <= width {
        return (0.0, width);
    }
    let stretch = (wanted - width) / (natural - width);
    (stretch, stretch * last + width)
}

/// Space to add between characters and a scale of their widths that bring a line to a width.
fn fit(natural: f32, wanted: f32, count: usize) -> (f32, f32) {
    if !(wanted > 0.0 && natural > 0.0 && wanted.is_finite()) {
        (0.0, 1.0)
    } else if wanted > natural && count > 1 {
        ((wanted - natural) / (count - 1) as f32, 1.0)
    } else {
        (0.0, wanted / natural)
    }
}

fn start(justify: Justify, width: f32) -> f32 {
    match justify {
        Justify::Left => 0.0,
        Justify::Right => -width,
        Justify::Center => -0.5 * width,
    }
}

impl Layout {
    fn set(&mut self, advances: &[(char, f32)], origin: Vec2) {
        let mut x = origin.x;
        for &(character, advance) in advances {
            self.push(character, Vec2::new(x, origin.y), 1.0);
            x += advance;
        }
    }

    fn push(&mut self, character: char, origin: Vec2, stretch: f32) {
        if self.glyphs.len() < MAX_GLYPHS && origin.is_finite() {
            self.glyphs.push(PlacedGlyph {
                character,
                origin,
                stretch,
            });
        }
    }

    fn extend(&mut self, left: f32, right: f32) {
        self.left = self.left.min(left);
        self.right = self.right.max(right);
    }
}

/// An `AsciiText`: flat, in z = 0.
pub fn ascii_text<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    widths: &[f32],
) -> (Mesh, Layout) {
    let laid = ascii_layout(strings, style, widths);
    (flat(&laid, style.face, style.size, style.complexity), laid)
}

fn flat(laid: &Layout, face: Face<'_>, size: f32, complexity: f32) -> Mesh {
    let mut glyphs = Glyphs::new(face, complexity);
    let mut mesh = Mesh::default();
    let per_unit = if size > 0.0 { 1.0 / size } else { 0.0 };
    for glyph in &laid.glyphs {
        let cut = glyphs.get(glyph.character);
        let first = mesh.positions.len() as u32;
        for &p in &cut.points {
            let p = glyph.origin + size * p * Vec2::new(glyph.stretch, 1.0);
            mesh.vertex(p.extend(0.0), Vec3::Z, p * per_unit);
        }
        let triangles = cut.triangles.iter();
        mesh.triangles
            .extend(triangles.map(|t| t.map(|i| first + i)));
    }
    mesh
}

#[cfg(test)]
mod tests;
