//! The glyphs of a typeface as polylines and triangles.

use std::cell::RefCell;
use std::collections::BTreeMap;

use glam::Vec2;
use lyon_tessellation::{
    BuffersBuilder, FillOptions, FillTessellator, FillVertex, VertexBuffers, math::point,
    path::Path,
};
use skrifa::outline::{
    DrawSettings, HintingInstance, HintingOptions, OutlineGlyphFormat, OutlinePen,
};
use skrifa::prelude::{FontRef, LocationRef, Size};
use skrifa::{GlyphId, MetadataProvider};

use super::face::Face;

/// The largest number of characters of one text. The rest of a longer text is not drawn.
pub(crate) const MAX_GLYPHS: usize = 250_000;

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

/// An opened typeface.
pub(super) struct Typeface<'a> {
    font: Option<FontRef<'a>>,
    scale: f32,
    built_in: bool,
    /// The hinting; `None` for the built-in font.
    hinting: Option<HintingInstance>,
    /// The size in pixels at which glyphs are hinted.
    pixels: f32,
    /// The boxes of the outlines so far, by character; `None` for a space.
    boxes: RefCell<BTreeMap<char, Option<(Vec2, Vec2)>>>,
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

impl<'a> Typeface<'a> {
    /// Opens a typeface for solid and flat text.
    pub(super) fn open(face: Face<'a>) -> Self {
        Self::open_at(face, HINTED_PIXELS)
    }

    /// Opens a typeface for glyphs of a size in pixels.
    pub(super) fn open_at(face: Face<'a>, pixels: f32) -> Self {
        let font = face.font();
        let hinting = font.as_ref().filter(|_| !face.built_in).and_then(|font| {
            let (size, place) = (Size::new(pixels), LocationRef::default());
            let options = HintingOptions::default();
            HintingInstance::new(&font.outline_glyphs(), size, place, options).ok()
        });
        Self {
            font,
            scale: face.scale(),
            built_in: face.built_in,
            hinting,
            pixels,
            boxes: RefCell::default(),
        }
    }

    fn glyph(&self, font: &FontRef<'_>, character: char) -> GlyphId {
        font.charmap().map(character).unwrap_or_default()
    }

    /// Returns the characters with their advances. In Coin FreeType scales glyphs to 40 pixels,
    /// which rounds the advances to fortieths of the size. They are rounded here too, so that lines
    /// have the same length.
    pub(super) fn advances(&self, text: &str, size: f32) -> Vec<(char, f32)> {
        let mut advances = self.advances_at(text, HINTED_PIXELS);
        for (character, advance) in &mut advances {
            *advance = size
                * if self.built_in {
                    self.built_in_advance(*character)
                } else {
                    (*advance + 0.5).floor() / HINTED_PIXELS
                };
        }
        advances
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

    /// Returns the characters with their advances, rounded to pixels, for a size in pixels.
    pub(super) fn pixel_advances(&self, text: &str, size: f32) -> Vec<(char, f32)> {
        let mut advances = self.advances_at(text, size);
        for (_, advance) in &mut advances {
            *advance = (*advance + 0.5).floor();
        }
        advances
    }

    /// Returns the characters with their unrounded advances.
    fn advances_at(&self, text: &str, size: f32) -> Vec<(char, f32)> {
        let Some(font) = &self.font else {
            return Vec::new();
        };
        let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
        let scale = size * self.scale / f32::from(metrics_units(font));
        text.chars()
            .filter(|c| !c.is_control() || *c == '\t')
            .take(MAX_GLYPHS + 1) // so that the layout finds that a line is too long
            .map(|c| {
                let shown = if c == '\t' { ' ' } else { c };
                let units = metrics.advance_width(self.glyph(font, shown));
                (shown, units.unwrap_or(0.0) * scale)
            })
            .collect()
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
    pub(super) fn ink_width(&self, advances: &[(char, f32)], size: f32) -> f32 {
        let full: f32 = advances.iter().map(|a| a.1).sum();
        advances.last().map_or(full, |&(last, advance)| {
            full - advance + self.width(last) * size
        })
    }

    /// Returns a glyph's outlines as closed polylines with the fill on the right.
    pub(super) fn outlines(&self, character: char, tolerance: f32) -> Vec<Vec<Vec2>> {
        let Some(font) = &self.font else {
            return Vec::new();
        };
        let per_unit = match &self.hinting {
            Some(_) => 1.0 / self.pixels,
            None => self.scale / f32::from(metrics_units(font)),
        };
        let mut pen = Flattener {
            scale: per_unit,
            tolerance,
            outlines: Vec::new(),
        };
        if let Some(glyph) = font.outline_glyphs().get(self.glyph(font, character)) {
            // Unscaled outlines are in the font's units. At size 1 they would be rounded to 64ths.
            let settings = match &self.hinting {
                Some(hinting) => DrawSettings::hinted(hinting, false),
                None => DrawSettings::unhinted(Size::unscaled(), LocationRef::default()),
            };
            if glyph.draw(settings, &mut pen).is_err() {
                return Vec::new();
            }
        }
        pen.outlines.retain(|o| o.len() > 2);
        let all = pen.outlines.iter().flatten();
        let left = all.map(|p| p.x).fold(f32::INFINITY, f32::min);
        let is_truetype = font.outline_glyphs().format() == Some(OutlineGlyphFormat::Glyf);
        for outline in &mut pen.outlines {
            if !is_truetype {
                outline.reverse(); // PostScript fills on the left
            }
            if self.built_in {
                outline.iter_mut().for_each(|p| p.x -= left);
            }
        }
        pen.outlines
    }
}

/// Flattens a glyph's curves to lines.
struct Flattener {
    scale: f32,
    tolerance: f32,
    outlines: Vec<Vec<Vec2>>,
}

impl Flattener {
    fn last(&self) -> Vec2 {
        let last = self.outlines.last().and_then(|o| o.last());
        last.copied().unwrap_or_default()
    }

    fn add(&mut self, p: Vec2) {
        let distinct = p != self.last();
        if let Some(outline) = self.outlines.last_mut()
            && (distinct || outline.is_empty())
        {
            outline.push(p);
        }
    }

    /// Returns the number of lines with which a curve is within the tolerance, if its middle is at
    /// most `sag` from its chord. Doubling the number of lines divides the error by four.
    fn pieces(&self, sag: f32) -> usize {
        ((sag / self.tolerance).sqrt().ceil() as usize).clamp(1, 64)
    }
}

impl OutlinePen for Flattener {
    fn move_to(&mut self, x: f32, y: f32) {
        self.outlines.push(vec![Vec2::new(x, y) * self.scale]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.add(Vec2::new(x, y) * self.scale);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (a, b) = (self.last(), Vec2::new(cx, cy) * self.scale);
        let c = Vec2::new(x, y) * self.scale;
        let pieces = self.pieces(0.25 * (a - 2.0 * b + c).length());
        for i in 1..=pieces {
            let t = i as f32 / pieces as f32;
            self.add(a.lerp(b, t).lerp(b.lerp(c, t), t));
        }
    }

    fn curve_to(&mut self, bx: f32, by: f32, cx: f32, cy: f32, x: f32, y: f32) {
        let a = self.last();
        let [b, c, d] = [(bx, by), (cx, cy), (x, y)].map(|(x, y)| Vec2::new(x, y) * self.scale);
        let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
        let pieces = self.pieces(0.75 * bend);
        for i in 1..=pieces {
            let t = i as f32 / pieces as f32;
            let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
            self.add(ab.lerp(bc, t).lerp(bc.lerp(cd, t), t));
        }
    }

    fn close(&mut self) {
        if let Some(outline) = self.outlines.last_mut()
            && outline.len() > 1
            && outline.first() == outline.last()
        {
            outline.pop();
        }
    }
}

/// Returns the number of font units in the font's size.
fn metrics_units(font: &FontRef<'_>) -> u16 {
    let metrics = font.metrics(Size::unscaled(), LocationRef::default());
    metrics.units_per_em.max(1)
}
