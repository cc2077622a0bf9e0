//! The glyphs of a typeface as polylines and triangles.

use std::cell::RefCell;
use std::collections::BTreeMap;

use glam::Vec2;
use lyon_tessellation::{
    BuffersBuilder, FillOptions, FillTessellator, FillVertex, VertexBuffers, math::point,
    path::Path,
};

use super::chain::FaceChain;
use super::face::Face;
use super::letters::{LetterOrder, is_mark, letters};
use super::missing::MissingCharacters;

/// A glyph as polylines and triangles, at a font size of 1.
#[derive(Clone, Debug, Default)]
pub(super) struct FlatGlyph {
    /// Closed polylines, with the fill on the right of each edge (TrueType's rule).
    pub outlines: Vec<Vec<Vec2>>,
    /// The vertices of the triangles.
    pub points: Vec<Vec2>,
    /// The vertex indices of each triangle, counterclockwise.
    pub triangles: Vec<[u32; 3]>,
}

impl FlatGlyph {
    /// Fills outlines by the nonzero rule. lyon's tolerances are absolute, so the outlines are
    /// scaled to 2048 units for the font's size, as in TrueType fonts.
    pub(super) fn fill(outlines: Vec<Vec<Vec2>>) -> Self {
        const UNITS: f32 = 2048.0;
        let mut builder = Path::builder();
        for outline in &outlines {
            let mut points = outline.iter().map(|p| point(UNITS * p.x, UNITS * p.y));
            if let Some(first) = points.next() {
                builder.begin(first);
                points.for_each(|p| {
                    builder.line_to(p);
                });
                builder.close();
            }
        }
        let mut buffers: VertexBuffers<Vec2, u32> = VertexBuffers::new();
        let filled = FillTessellator::new().tessellate_path(
            &builder.build(),
            &FillOptions::non_zero(),
            &mut BuffersBuilder::new(&mut buffers, |v: FillVertex| {
                Vec2::new(v.position().x, v.position().y) / UNITS
            }),
        );
        if filled.is_err() {
            buffers.clear();
        }
        let points = buffers.vertices;
        let triangles = buffers
            .indices
            .chunks_exact(3)
            .map(|t| counterclockwise(&points, [t[0], t[1], t[2]]))
            .collect();
        Self {
            outlines,
            points,
            triangles,
        }
    }
}

/// Returns a triangle with its corners in counterclockwise order.
fn counterclockwise(points: &[Vec2], [a, b, c]: [u32; 3]) -> [u32; 3] {
    let p = |i: u32| points[i as usize];
    if (p(b) - p(a)).perp_dot(p(c) - p(a)) < 0.0 {
        [a, c, b]
    } else {
        [a, b, c]
    }
}

/// The glyphs that a text has used so far.
pub(super) struct GlyphCache<'a> {
    font: Typeface<'a>,
    tolerance: f32,
    cuts: BTreeMap<char, FlatGlyph>,
}

impl<'a> GlyphCache<'a> {
    /// Opens a typeface. The flattening error is at most 0.01 · 0.005^complexity of the size: 0.01
    /// at complexity 0, 0.0007 at 0.5, and 0.00005 at 1. Coin's error at 0.5 is 0.0012, with 32
    /// lines for Helvetica's o.
    pub(super) fn new(face: Face<'a>, complexity: f32) -> Self {
        let c = complexity.clamp(0.0, 1.0);
        Self {
            font: Typeface::open(face),
            tolerance: if c.is_nan() {
                7e-4
            } else {
                0.01 * libm::powf(0.005, c)
            },
            cuts: BTreeMap::new(),
        }
    }

    /// Returns the glyph of a character, which is made when it is first used.
    pub(super) fn get(&mut self, character: char) -> &FlatGlyph {
        let (font, tolerance) = (&self.font, self.tolerance);
        self.cuts
            .entry(character)
            .or_insert_with(|| FlatGlyph::fill(font.outlines(character, tolerance)))
    }
}

/// The size in pixels at which glyphs of solid and flat text are hinted, as FreeType does for Coin.
/// Hinting aligns stems to the pixel grid.
const HINTED_PIXELS: f32 = 40.0;

/// A glyph of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineGlyph {
    /// The character.
    pub character: char,
    /// The distance to the next glyph; 0 for a combining mark on a letter.
    pub advance: f32,
    /// For a combining mark, the distance of its origin from that of the letter before it.
    pub over: Option<f32>,
}

impl LineGlyph {
    /// Whether the glyph has a place of its own in the line, which combining marks do not have.
    pub(super) fn is_spacing(&self) -> bool {
        self.over.is_none()
    }
}

/// Returns the sum of the advances of a line.
pub(super) fn length(line: &[LineGlyph]) -> f32 {
    line.iter().map(|glyph| glyph.advance).sum()
}

/// The typeface of a text, with the others that have what it lacks.
pub(super) struct Typeface<'a> {
    faces: FaceChain<'a>,
    /// The size of the glyphs relative to the size in the file.
    scale: f32,
    /// The boxes of the outlines so far, by character; `None` for a space.
    boxes: RefCell<BTreeMap<char, Option<(Vec2, Vec2)>>>,
    /// The characters of the lines so far that are not drawn as written.
    missing: RefCell<MissingCharacters>,
}

/// The advances of the built-in font that are not the width of the outline plus a gap (measured in
/// Coin), relative to the size.
const ODD_ADVANCES: [(char, f32); 14] = [
    (' ', 1.0 / 3.0),
    ('"', 0.29),
    ('$', 0.47),
    ('&', 0.7867),
    (')', 0.295),
    ('*', 0.41),
    ('3', 0.441),
    ('9', 0.4866),
    ('A', 0.787),
    ('D', 0.7433),
    ('G', 0.76),
    ('H', 0.76),
    (']', 0.2344),
    ('j', 0.303),
];

/// The width of the box that stands for a missing glyph, with its margins, relative to the size.
const BOX_ADVANCE: f32 = 0.6;
/// The lower left and upper right corner of that box, relative to the size.
const BOX: (Vec2, Vec2) = (Vec2::new(0.06, 0.0), Vec2::new(0.54, 0.7));
/// The width of its lines, relative to the size.
const BOX_LINE: f32 = 0.05;

impl<'a> Typeface<'a> {
    /// Opens a typeface for solid and flat text.
    pub(super) fn open(face: Face<'a>) -> Self {
        Self::open_at(face, HINTED_PIXELS)
    }

    /// Opens a typeface for glyphs of a size in pixels.
    pub(super) fn open_at(face: Face<'a>, pixels: f32) -> Self {
        Self {
            faces: FaceChain::open(face, pixels),
            scale: face.scale(),
            boxes: RefCell::default(),
            missing: RefCell::default(),
        }
    }

    /// Returns the glyphs of a line with their advances.
    pub(super) fn line(&self, text: &str, order: LetterOrder, size: f32) -> Vec<LineGlyph> {
        self.glyphs(text, order, size, |c| size * self.advance(c))
    }

    /// Returns the glyphs of a line with their advances in pixels, for a size in pixels.
    pub(super) fn pixel_line(&self, text: &str, size: f32) -> Vec<LineGlyph> {
        self.glyphs(text, LetterOrder::Visual, size, |c| {
            (self.unrounded_advance(c, size) + 0.5).floor()
        })
    }

    /// Returns the glyphs of a line, whose advances a function returns.
    fn glyphs(
        &self,
        text: &str,
        order: LetterOrder,
        size: f32,
        advance: impl Fn(char) -> f32,
    ) -> Vec<LineGlyph> {
        let has = |c| self.faces.find(c).is_some();
        let mut under: Option<(char, f32)> = None;
        let glyph = |character: char| {
            let is_drawn = character.is_whitespace() || has(character);
            self.missing.borrow_mut().see(character, is_drawn);
            let over = under.filter(|_| is_mark(character) && is_drawn);
            let over = over.map(|(letter, width)| self.mark_offset(character, letter, width, size));
            let advance = over.map_or_else(|| advance(character), |_| 0.0);
            if over.is_none() {
                under = Some((character, advance));
            }
            LineGlyph {
                character,
                advance,
                over,
            }
        };
        letters(text, order, &has).into_iter().map(glyph).collect()
    }

    /// Returns how far a combining mark's origin is from that of a letter with an advance, so that
    /// their outlines have one center.
    fn mark_offset(&self, mark: char, letter: char, advance: f32, size: f32) -> f32 {
        let center = |c| {
            let (left, right) = self.ink(c)?;
            Some(0.5 * size * (left + right))
        };
        center(letter).unwrap_or(0.5 * advance) - center(mark).unwrap_or(0.0)
    }

    /// Returns the characters of the lines so far that are not drawn as written.
    pub(super) fn missing(self) -> MissingCharacters {
        self.missing.into_inner()
    }

    /// Returns the advance of a character at size 1. In Coin FreeType scales glyphs to 40 pixels,
    /// which rounds the advances to fortieths of the size. They are rounded here too, so that lines
    /// have the same length.
    fn advance(&self, character: char) -> f32 {
        match self.faces.find(character) {
            Some((face, _)) if face.is_built_in => self.built_in_advance(character),
            Some((face, glyph)) if face.is_rounded => {
                (face.advance(glyph, HINTED_PIXELS) + 0.5).floor() / HINTED_PIXELS
            }
            _ => self.unrounded_advance(character, 1.0),
        }
    }

    /// Returns the advance of a character for a size. A space that no typeface has is as wide as
    /// the usual one.
    fn unrounded_advance(&self, character: char, size: f32) -> f32 {
        match self.faces.find(character) {
            Some((face, glyph)) => face.advance(glyph, size),
            None if character.is_whitespace() && character != ' ' => {
                self.unrounded_advance(' ', size)
            }
            None => BOX_ADVANCE * self.scale * size,
        }
    }

    /// Returns an advance of the built-in font: the width of the outline, rounded down to
    /// thousandths of the size, plus a gap of 0.01 (measured in Coin).
    fn built_in_advance(&self, character: char) -> f32 {
        let odd = ODD_ADVANCES.iter().find(|(c, _)| *c == character);
        odd.map_or_else(
            || {
                let (left, right) = self.ink(character).unwrap_or((0.0, 0.0));
                (1000.0 * (right - left) + 0.01).floor() / 1000.0 + 0.01
            },
            |(_, advance)| *advance,
        )
    }

    /// Returns the smallest and the largest x of a glyph's outline, or `None` for a space.
    fn ink(&self, character: char) -> Option<(f32, f32)> {
        let (low, high) = self.outline_box(character)?;
        Some((low.x, high.x))
    }

    /// Returns the box of a glyph's outline, or `None` for a space. An outline is made once for
    /// each character, because hinting takes much longer than everything else in a layout.
    fn outline_box(&self, character: char) -> Option<(Vec2, Vec2)> {
        let find = || {
            let outlines = self.outlines(character, 1e-3);
            let mut points = outlines.iter().flatten().copied();
            let first = points.next()?;
            let grow = |(low, high): (Vec2, Vec2), p: Vec2| (low.min(p), high.max(p));
            Some(points.fold((first, first), grow))
        };
        let mut boxes = self.boxes.borrow_mut();
        *boxes.entry(character).or_insert_with(find)
    }

    /// Returns the number of typefaces that were opened besides the text's own one.
    #[cfg(test)]
    pub(super) fn others_opened(&self) -> usize {
        self.faces.others_opened()
    }

    /// Returns the bounding box of a glyph's outline and its origin, at size 1.
    pub(super) fn reach(&self, character: char) -> (Vec2, Vec2) {
        let found = self.outline_box(character);
        found.map_or((Vec2::ZERO, Vec2::ZERO), |(low, high)| {
            (low.min(Vec2::ZERO), high.max(Vec2::ZERO))
        })
    }

    /// Returns the width of the box of [`Typeface::reach`].
    pub(super) fn width(&self, character: char) -> f32 {
        let (low, high) = self.reach(character);
        high.x - low.x
    }

    /// Returns the length of a line, with the last glyph's width instead of its advance.
    pub(super) fn ink_width(&self, line: &[LineGlyph], size: f32) -> f32 {
        let full = length(line);
        let last = line.iter().rfind(|glyph| glyph.is_spacing());
        last.map_or(full, |last| {
            full - last.advance + self.width(last.character) * size
        })
    }

    /// Returns the outlines of a character's glyph as closed polylines with the fill on the right.
    /// A box stands for a glyph that no typeface has.
    pub(super) fn outlines(&self, character: char, tolerance: f32) -> Vec<Vec<Vec2>> {
        match self.faces.find(character) {
            Some((face, glyph)) => face.outlines(glyph, tolerance),
            None if character.is_whitespace() => Vec::new(),
            None => missing_glyph(self.scale).into(),
        }
    }
}

/// Returns the outlines of the box that stands for a missing glyph, for a size.
fn missing_glyph(size: f32) -> [Vec<Vec2>; 2] {
    let corners = |low: Vec2, high: Vec2| {
        let upper_left = Vec2::new(low.x, high.y);
        [low, upper_left, high, Vec2::new(high.x, low.y)].map(|p| size * p)
    };
    let (low, high) = BOX;
    let outer = corners(low, high);
    let mut inner = corners(low + BOX_LINE, high - BOX_LINE);
    inner.reverse();
    [outer.to_vec(), inner.to_vec()]
}
