//! Triangles by the places of their corners, handed over many at once.

/// A triangle by the places of its corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndexedTriangle {
    /// Positions in the shape's index, or numbers of its corners where it has none.
    pub corners: [u32; 3],
    /// What goes by face or by part goes by these for all three corners.
    pub face: u32,
    pub part: u32,
}

/// So many triangles are handed over at once: their places fit in the nearest cache.
const AT_ONCE: usize = 512;

/// Collects triangles, and hands them over whenever there are many.
pub(crate) struct TriangleList<'f> {
    triangles: Vec<IndexedTriangle>,
    take: &'f mut dyn FnMut(&mut Vec<IndexedTriangle>),
}

impl<'f> TriangleList<'f> {
    /// Lets `cut` add triangles, and hands all of them to `take`, which may change the list.
    pub(crate) fn fill(
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
        take: &'f mut dyn FnMut(&mut Vec<IndexedTriangle>),
    ) {
        let triangles = Vec::with_capacity(AT_ONCE);
        let mut list = TriangleList { triangles, take };
        cut(&mut list);
        list.hand_over();
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, corners: [usize; 3], face: usize, part: usize) {
        self.triangles.push(IndexedTriangle {
            corners: corners.map(|c| c as u32),
            face: face as u32,
            part: part as u32,
        });
        if self.triangles.len() == AT_ONCE {
            self.hand_over();
        }
    }

    #[cold]
    fn hand_over(&mut self) {
        (self.take)(&mut self.triangles);
        self.triangles.clear();
    }
}
