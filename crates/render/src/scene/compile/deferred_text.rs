//! The glyphs of a text, until they are stored.

use glam::{DMat4, Vec2};

use crate::geometry::TriangleMesh;
use crate::scene::canvas::MaterialsBy;

/// The different glyphs of a text and their places.
pub(super) struct DeferredText {
    /// How the materials of all glyphs are distributed.
    pub materials: MaterialsBy,
    /// The different glyphs, each around its origin.
    pub glyphs: Vec<TriangleMesh>,
    /// The index of each glyph in `glyphs`, with the place of its origin, in order of drawing.
    pub placed: Vec<(u32, Vec2)>,
}

impl DeferredText {
    /// Returns a text without glyphs.
    pub(super) fn new() -> Self {
        Self {
            materials: MaterialsBy::Vertex,
            glyphs: Vec::new(),
            placed: Vec::new(),
        }
    }

    /// Adds a glyph with its number in order of first use.
    pub(super) fn add(
        &mut self,
        (number, mesh): (usize, &TriangleMesh),
        at: Vec2,
        materials: MaterialsBy,
    ) {
        self.materials = materials;
        if number == self.glyphs.len() {
            self.glyphs.push(mesh.clone());
        }
        self.placed.push((number as u32, at));
    }
}

/// Returns the matrix of a glyph with its origin at a place.
pub(super) fn glyph_offset(at: Vec2) -> DMat4 {
    DMat4::from_translation(at.extend(0.0).as_dvec3())
}
