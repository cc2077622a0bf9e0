//! Triangulates flat texts in the plane z = 0.

use glam::{Vec2, Vec3};

use super::batch::{GlyphBatch, TextOutput};
use super::face::Face;
use super::glyph::GlyphCache;
use super::layout::{Layout, ascii_layout};
use super::style::{TextStyle, Vrml97Style};
use super::vrml97::vrml97_layout;

/// Draws the triangles of an `AsciiText`, and returns the layout of its glyphs.
pub fn ascii_text<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    widths: &[f32],
    output: TextOutput<'_>,
) -> Layout {
    let laid = ascii_layout(strings, style, widths);
    flat(&laid, style.face, style.size, style.complexity, output);
    laid
}

/// Draws the triangles of laid-out glyphs. One unit of the texture coordinates is one font size.
fn flat(laid: &Layout, face: Face<'_>, size: f32, complexity: f32, output: TextOutput<'_>) {
    let mut glyphs = GlyphCache::new(face, complexity);
    let mut batch = GlyphBatch::new(output);
    let per_unit = if size > 0.0 { 1.0 / size } else { 0.0 };
    for glyph in &laid.glyphs {
        batch.add(glyph, |origin, mesh| {
            let cut = glyphs.get(glyph.character);
            let first = mesh.positions.len() as u32;
            for &p in &cut.points {
                let p = origin + size * p * Vec2::new(glyph.stretch, 1.0);
                mesh.vertex(p.extend(0.0), Vec3::Z, p * per_unit);
            }
            let triangles = cut.triangles.iter();
            mesh.triangles
                .extend(triangles.map(|t| t.map(|i| first + i)));
        });
    }
    batch.finish();
}

/// Draws the triangles of a VRML97 `Text`, laid out by the standard, and returns the layout of its
/// glyphs.
pub fn vrml97_text<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style<'_>,
    lengths: &[f32],
    max_extent: f32,
    output: TextOutput<'_>,
) -> Layout {
    let laid = vrml97_layout(strings, style, lengths, max_extent);
    flat(&laid, style.face, style.size, style.complexity, output);
    laid
}
