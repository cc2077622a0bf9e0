//! Passes the triangles of a text on, so that a long text is never in memory as a whole.

use std::collections::HashMap;

use glam::Vec2;

use super::layout::PlacedGlyph;
use crate::geometry::mesh::TriangleMesh;

/// The number of triangles from which a batch is passed on. Larger ones are not faster.
const ENOUGH: usize = 1 << 13;

/// How the triangles of a text are passed on.
pub enum TextOutput<'f> {
    /// In batches of many glyphs at their places.
    Batches(&'f mut dyn FnMut(&TriangleMesh)),
    /// Glyph by glyph: its number, its triangles around its origin, and the place of its origin.
    /// Equal glyphs have one number. The numbers begin with 0 and are in order of first use.
    Glyphs(&'f mut dyn FnMut(usize, &TriangleMesh, Vec2)),
}

/// Collects the triangles of glyphs.
pub(super) struct GlyphBatch<'f> {
    mesh: TriangleMesh,
    output: TextOutput<'f>,
    /// The different glyphs so far, if they are passed on one by one.
    glyphs: Vec<TriangleMesh>,
    /// The number of each glyph by its character and the bits of its stretch.
    numbers: HashMap<(char, u32), usize>,
}

impl<'f> GlyphBatch<'f> {
    /// Creates an empty batch.
    pub(super) fn new(output: TextOutput<'f>) -> Self {
        Self {
            mesh: TriangleMesh::default(),
            output,
            glyphs: Vec::new(),
            numbers: HashMap::new(),
        }
    }

    /// Adds a glyph. `put` adds its triangles to a mesh, with its origin at a place.
    pub(super) fn add(&mut self, glyph: &PlacedGlyph, put: impl FnOnce(Vec2, &mut TriangleMesh)) {
        match &mut self.output {
            TextOutput::Batches(draw) => {
                if self.mesh.triangles.len() >= ENOUGH {
                    draw(&self.mesh);
                    self.mesh.clear();
                }
                put(glyph.origin, &mut self.mesh);
            }
            TextOutput::Glyphs(draw) => {
                let key = (glyph.character, glyph.stretch.to_bits());
                let number = *self.numbers.entry(key).or_insert_with(|| {
                    let mut mesh = TriangleMesh::default();
                    put(Vec2::ZERO, &mut mesh);
                    self.glyphs.push(mesh);
                    self.glyphs.len() - 1
                });
                draw(number, &self.glyphs[number], glyph.origin);
            }
        }
    }

    /// Passes the rest on.
    pub(super) fn finish(self) {
        if let TextOutput::Batches(draw) = self.output {
            draw(&self.mesh);
        }
    }
}
