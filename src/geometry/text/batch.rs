//! Passes the triangles of a text on in batches, so that a long text is never in memory as a whole.

use crate::geometry::mesh::Mesh;

/// The number of triangles from which a batch is passed on. Larger ones are not faster.
const ENOUGH: usize = 1 << 13;

/// Collects the triangles of glyphs.
pub(super) struct Batch<'f> {
    mesh: Mesh,
    draw: &'f mut dyn FnMut(&Mesh),
}

impl<'f> Batch<'f> {
    /// Creates an empty batch. `draw` is called with each that is full.
    pub(super) fn new(draw: &'f mut dyn FnMut(&Mesh)) -> Self {
        Self {
            mesh: Mesh::default(),
            draw,
        }
    }

    /// Returns the mesh to which the next glyph is added.
    pub(super) fn mesh(&mut self) -> &mut Mesh {
        if self.mesh.triangles.len() >= ENOUGH {
            (self.draw)(&self.mesh);
            self.mesh.clear();
        }
        &mut self.mesh
    }

    /// Passes the rest on.
    pub(super) fn finish(self) {
        (self.draw)(&self.mesh);
    }
}
