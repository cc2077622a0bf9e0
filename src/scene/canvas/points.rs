//! The points that a vertex shape uses, each moved once however many corners it has.

use glam::Vec3;

use super::runs::Runs;
use super::triangle_list::IndexedTriangle;
use super::vertices::Vertices;

/// A list with far more entries than a shape has corners is read corner by corner.
pub(crate) const FAR_MORE: usize = 2;

/// The moved points, and which of them each position has.
pub(crate) struct Points<'v> {
    pub all: Vec<Vec3>,
    pub index: Option<&'v [i32]>,
    /// The coordinate that is first among the moved.
    pub first: u32,
    /// Some corner has no coordinate.
    missing: bool,
    /// Some point cannot be drawn.
    unsound: bool,
}

impl<'v> Points<'v> {
    /// Moves the points that a shape uses into `all`, whose entries are dropped.
    pub(crate) fn of(
        runs: &Runs<'v>,
        vertices: &Vertices<'_, '_>,
        mut all: Vec<Vec3>,
        place: impl Fn(Vec3) -> Vec3,
        is_sound: impl Fn(Vec3) -> bool,
    ) -> Self {
        let (used, positions) = (runs.used(), runs.positions());
        let known = vertices.coordinates;
        let index = runs.index().filter(|_| used.len() <= FAR_MORE * positions);
        let point = |c: usize| place(known.get(c).unwrap_or_default());
        all.clear();
        if index.is_some() || runs.index().is_none() {
            all.extend(used.clone().map(point));
        } else {
            // Separators have no coordinate.
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

    /// The entry of a position.
    #[inline(always)]
    pub(crate) fn number(&self, position: u32) -> usize {
        match self.index {
            Some(index) => (index[position as usize] as u32 - self.first) as usize,
            None => position as usize,
        }
    }

    /// Takes triangles out that have a corner without a coordinate.
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

    /// Takes triangles out that have a corner which cannot be drawn. Returns how many they are.
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
