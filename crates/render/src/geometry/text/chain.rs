//! Finds the typeface that has the glyph of a character.
//!
//! The typeface of the text is searched first. Others are opened only for a character that it
//! lacks: those of `--fonts` whatever their names, then the shipped ones.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use glam::Vec2;
use skrifa::charmap::Charmap;
use skrifa::metrics::GlyphMetrics;
use skrifa::outline::{
    DrawSettings, HintingInstance, HintingOptions, OutlineGlyphCollection, OutlineGlyphFormat,
};
use skrifa::prelude::{FontRef, LocationRef, Size};
use skrifa::{GlyphId, MetadataProvider};

use super::face::Face;
use super::fallback;
use super::flattener::Flattener;
use super::library::UserFont;

/// The typefaces that are searched after the text's own one, in this order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum FaceSource {
    /// A typeface of the user, by its number in the library.
    User(usize),
    /// The shipped typeface that the user's one replaces.
    Replaced,
    /// The other Latin letters of the shipped typeface.
    Latin,
    /// The Greek and Cyrillic letters of the family.
    GreekAndCyrillic,
    /// Everything else that is shipped.
    Any,
}

/// A glyph and the typeface that has it.
pub(super) type Found<'a> = (Rc<OpenFace<'a>>, GlyphId);

/// The typefaces of a text.
pub(super) struct FaceChain<'a> {
    face: Face<'a>,
    /// The size in pixels at which glyphs are hinted.
    pixels: f32,
    /// The typeface of the text.
    first: Option<Rc<OpenFace<'a>>>,
    /// The other typefaces that a character needed.
    others: RefCell<BTreeMap<FaceSource, Option<Rc<OpenFace<'a>>>>>,
    /// Where the characters are that the first typeface lacks.
    found: RefCell<BTreeMap<char, Option<Found<'a>>>>,
}

impl<'a> FaceChain<'a> {
    /// Opens the typeface of a text.
    pub(super) fn open(face: Face<'a>, pixels: f32) -> Self {
        let hinted = (!face.built_in).then_some(pixels);
        let first = face.font().map(|font| {
            let open = OpenFace::new(&font, face.scale(), hinted);
            Rc::new(OpenFace {
                is_built_in: face.built_in,
                ..open
            })
        });
        Self {
            face,
            pixels,
            first,
            others: RefCell::default(),
            found: RefCell::default(),
        }
    }

    /// Returns the glyph of a character, or `None` if no typeface has it.
    pub(super) fn find(&self, character: char) -> Option<Found<'a>> {
        if let Some(first) = &self.first
            && let Some(glyph) = first.glyph(character)
        {
            return Some((first.clone(), glyph));
        }
        let known = self.found.borrow().get(&character).cloned();
        known.unwrap_or_else(|| {
            let found = self.search(character);
            self.found.borrow_mut().insert(character, found.clone());
            found
        })
    }

    /// Searches the other typefaces.
    fn search(&self, character: char) -> Option<Found<'a>> {
        let Face { bold, italic, .. } = self.face;
        let fonts = self.face.fonts;
        let user = fonts.and_then(|fonts| fonts.with_character(character, bold, italic));
        let shipped = [
            FaceSource::Replaced,
            FaceSource::Latin,
            FaceSource::GreekAndCyrillic,
            FaceSource::Any,
        ];
        let sources = user.iter().map(|(number, _)| FaceSource::User(*number));
        sources.chain(shipped).find_map(|source| {
            let mut others = self.others.borrow_mut();
            let open = others
                .entry(source)
                .or_insert_with(|| match (source, user) {
                    (FaceSource::User(_), Some((_, font))) => self.user(font),
                    _ => self.shipped(source),
                });
            let open = open.as_ref()?;
            Some((open.clone(), open.glyph(character)?))
        })
    }

    /// Opens a typeface of the user.
    fn user(&self, font: UserFont<'a>) -> Option<Rc<OpenFace<'a>>> {
        let hinted = (!self.face.built_in).then_some(self.pixels);
        let open = OpenFace::new(&font.open()?, self.face.scale(), hinted);
        Some(Rc::new(OpenFace {
            is_rounded: false,
            ..open
        }))
    }

    /// Opens a shipped typeface. Those of another design have no hints.
    fn shipped(&self, source: FaceSource) -> Option<Rc<OpenFace<'a>>> {
        let Face {
            family,
            bold,
            italic,
            built_in,
            ..
        } = self.face;
        let hinted = (!built_in).then_some(self.pixels);
        let foreign = |font| OpenFace {
            is_rounded: false,
            ..OpenFace::new(&font, self.face.scale() * fallback::scale(family), None)
        };
        let open = match source {
            FaceSource::User(_) => return None,
            FaceSource::Replaced => {
                self.face.own?;
                let font = Face::plain(family, bold, italic).font()?;
                OpenFace::new(&font, self.face.scale(), hinted)
            }
            FaceSource::Latin => OpenFace {
                is_built_in: built_in,
                ..OpenFace::new(
                    &fallback::latin(family, bold, italic)?,
                    self.face.scale(),
                    hinted,
                )
            },
            FaceSource::GreekAndCyrillic => foreign(fallback::greek_and_cyrillic(family, bold)?),
            FaceSource::Any => foreign(fallback::any()?),
        };
        Some(Rc::new(open))
    }

    /// Returns the number of typefaces that were opened besides the text's own one.
    #[cfg(test)]
    pub(super) fn others_opened(&self) -> usize {
        self.others.borrow().len()
    }
}

/// A typeface that was opened, and how its glyphs are drawn.
pub(super) struct OpenFace<'a> {
    charmap: Charmap<'a>,
    metrics: GlyphMetrics<'a>,
    glyphs: OutlineGlyphCollection<'a>,
    /// The number of font units in the font's size.
    units: f32,
    /// The size of the glyphs relative to the font's size.
    scale: f32,
    hinting: Option<HintingInstance>,
    /// The size of a unit of the outlines, relative to the font's size.
    per_unit: f32,
    /// Whether glyphs are spaced by their outlines, as in Coin's built-in font.
    pub is_built_in: bool,
    /// Whether advances are rounded to fractions of the font's size as in Coin. Joined letters of
    /// other scripts would come apart.
    pub is_rounded: bool,
}

impl<'a> OpenFace<'a> {
    /// Opens a typeface whose glyphs have a scale, and are hinted at a size in pixels or not at
    /// all.
    fn new(font: &FontRef<'a>, scale: f32, hinted: Option<f32>) -> Self {
        let place = LocationRef::default();
        let glyphs = font.outline_glyphs();
        let hinting = hinted.and_then(|pixels| {
            let options = HintingOptions::default();
            HintingInstance::new(&glyphs, Size::new(pixels), place, options).ok()
        });
        let units = font.metrics(Size::unscaled(), place).units_per_em.max(1);
        let units = f32::from(units);
        let per_unit = match (&hinting, hinted) {
            (Some(_), Some(pixels)) => 1.0 / pixels,
            _ => scale / units,
        };
        Self {
            charmap: font.charmap(),
            metrics: font.glyph_metrics(Size::unscaled(), place),
            glyphs,
            units,
            scale,
            hinting,
            per_unit,
            is_built_in: false,
            is_rounded: true,
        }
    }

    /// Returns the glyph of a character, if the typeface has it.
    fn glyph(&self, character: char) -> Option<GlyphId> {
        let glyph = self.charmap.map(character)?;
        (glyph != GlyphId::NOTDEF).then_some(glyph)
    }

    /// Returns the advance of a glyph for a font size.
    pub(super) fn advance(&self, glyph: GlyphId, size: f32) -> f32 {
        let scale = size * self.scale / self.units;
        self.metrics.advance_width(glyph).unwrap_or(0.0) * scale
    }

    /// Returns a glyph's outlines as closed polylines with the fill on the right, at size 1.
    pub(super) fn outlines(&self, glyph: GlyphId, tolerance: f32) -> Vec<Vec<Vec2>> {
        let mut pen = Flattener::new(self.per_unit, tolerance);
        if let Some(glyph) = self.glyphs.get(glyph) {
            // Unscaled outlines are in the font's units. At size 1 they would be rounded to 64ths.
            let settings = match &self.hinting {
                Some(hinting) => DrawSettings::hinted(hinting, false),
                None => DrawSettings::unhinted(Size::unscaled(), LocationRef::default()),
            };
            if glyph.draw(settings, &mut pen).is_err() {
                return Vec::new();
            }
        }
        let mut outlines = pen.outlines;
        outlines.retain(|o| o.len() > 2);
        let all = outlines.iter().flatten();
        let left = all.map(|p| p.x).fold(f32::INFINITY, f32::min);
        let is_truetype = self.glyphs.format() == Some(OutlineGlyphFormat::Glyf);
        for outline in &mut outlines {
            if !is_truetype {
                outline.reverse(); // PostScript fills on the left
            }
            if self.is_built_in {
                outline.iter_mut().for_each(|p| p.x -= left);
            }
        }
        outlines
    }
}
