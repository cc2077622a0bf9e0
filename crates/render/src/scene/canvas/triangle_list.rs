//! Triangles as positions of their corners, which are passed on in batches.

/// A triangle as positions of its corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndexedTriangle {
    /// The positions in the shape's index, or the numbers of the corners if it has no index.
    pub corners: [u32; 3],
    /// The face, for bindings by face.
    pub face: u32,
    /// The part, for bindings by part.
    pub part: u32,
}

/// The number of triangles in a batch, whose positions fit in the first-level cache.
const BATCH: usize = 512;

/// Collects triangles, and passes them on in batches.
pub(crate) struct TriangleList<'f> {
    triangles: Vec<IndexedTriangle>,
    take: &'f mut dyn FnMut(&mut Vec<IndexedTriangle>),
}

impl<'f> TriangleList<'f> {
    /// Calls `cut` to add triangles, and `take` with each batch, which may change the batch.
    pub(crate) fn fill(
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
        take: &'f mut dyn FnMut(&mut Vec<IndexedTriangle>),
    ) {
        let triangles = Vec::with_capacity(BATCH);
        let mut list = TriangleList { triangles, take };
        cut(&mut list);
        list.flush();
    }

    /// Adds a triangle.
    #[inline(always)]
    pub(crate) fn add(&mut self, corners: [usize; 3], face: usize, part: usize) {
        self.triangles.push(IndexedTriangle {
            corners: corners.map(|c| c as u32),
            face: face as u32,
            part: part as u32,
        });
        if self.triangles.len() == BATCH {
            self.flush();
        }
    }

    /// Passes the batch on.
    #[cold]
    fn flush(&mut self) {
        (self.take)(&mut self.triangles);
        self.triangles.clear();
    }
}
