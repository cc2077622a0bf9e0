//! The points of a vertex-based shape, each transformed once however many corners it has.

use glam::Vec3;

use super::runs::Runs;
use super::triangle_list::IndexedTriangle;
use super::vertices::Vertices;

/// If the used range of a list has more than this many entries for each corner of a shape, the
/// entries are transformed corner by corner instead of all. The points are the same either way. No
/// search is recorded: it bounds the work to twice that of the corners.
pub(crate) const SPARSE_RATIO: usize = 2;

/// The transformed points, with the mapping from positions to them.
pub(crate) struct Points<'v> {
    /// The transformed points.
    pub all: Vec<Vec3>,
    /// The shape's index if points are by coordinate; otherwise points are by position.
    pub index: Option<&'v [i32]>,
    /// The coordinate of the first transformed point.
    pub first: u32,
    /// Whether some corner has no coordinate.
    missing: bool,
    /// Whether some point cannot be drawn.
    unsound: bool,
}

impl<'v> Points<'v> {
    /// Transforms the points that a shape uses by `place`. `all` is a buffer for the result.
    pub(crate) fn of(
        runs: &Runs<'v>,
        vertices: &Vertices<'_, '_>,
        mut all: Vec<Vec3>,
        place: impl Fn(Vec3) -> Vec3,
        is_sound: impl Fn(Vec3) -> bool,
    ) -> Self {
        let (used, positions) = (runs.used(), runs.positions());
        let known = vertices.coordinates;
        let index = runs
            .index()
            .filter(|_| used.len() <= SPARSE_RATIO * positions);
        let point = |c: usize| place(known.get(c).unwrap_or_default());
        all.clear();
        if index.is_some() || runs.index().is_none() {
            all.extend(used.clone().map(point));
        } else {
            // The separators −1 are positions without a coordinate.
            all.extend((0..positions).map(|p| point(runs.coordinate(p))));
        }
        Self {
            unsound: !all.iter().fold(true, |sound, p| sound & is_sound(*p)),
            all,
            index,
            first: used.start as u32,
            missing: runs.is_missing(),
        }
    }

    /// The index in `all` of the point at a position.
    #[inline(always)]
    pub(crate) fn number(&self, position: u32) -> usize {
        match self.index {
            Some(index) => (index[position as usize] as u32 - self.first) as usize,
            None => position as usize,
        }
    }

    /// Removes triangles with a corner that has no coordinate.
    pub(crate) fn drop_missing(
        &self,
        triangles: &mut Vec<IndexedTriangle>,
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
    ) {
        if self.missing {
            let known = vertices.coordinates.len();
            let exists = |&p: &u32| runs.coordinate(p as usize) < known;
            triangles.retain(|t| t.corners.iter().all(exists));
        }
    }

    /// Removes triangles with a corner that cannot be drawn, and returns their number.
    pub(crate) fn drop_unsound(
        &self,
        triangles: &mut Vec<IndexedTriangle>,
        is_sound: impl Fn(Vec3) -> bool,
    ) -> u64 {
        let before = triangles.len();
        if self.unsound {
            let sound = |&p: &u32| is_sound(self.all[self.number(p)]);
            triangles.retain(|t| t.corners.iter().all(sound));
        }
        (before - triangles.len()) as u64
    }
}
