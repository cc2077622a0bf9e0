//! Finds the entry of a list that each corner of a triangle has, by the binding in force.

use ivcam_inventor::traversal::state::Binding;

use crate::scene::canvas::{IndexedTriangle, Runs};

/// The rule by which a corner has an entry of a list.
pub(super) enum Numbers<'v> {
    /// All corners have entry 0.
    Same,
    /// The entry is the corner's position.
    Position,
    /// The entry is in an index, at the corner's position.
    Listed(&'v [i32]),
    /// The entry is in this list, at the corner's position: the number of corners before it.
    Counted(Vec<u32>),
    /// The entry is the face.
    Face,
    /// The entry is in an index, at the face.
    FaceListed(&'v [i32]),
    /// The entry is the part.
    Part,
    /// The entry is in an index, at the part.
    PartListed(&'v [i32]),
}

/// Returns an entry of an index, or 0 if it is missing or negative.
#[inline(always)]
pub(super) fn listed(list: &[i32], at: u32) -> u32 {
    let entry = list.get(at as usize).copied().unwrap_or(0);
    entry.max(0) as u32
}

/// Returns the values of three corners.
#[inline(always)]
pub(super) fn three<T>([a, b, c]: [u32; 3], entry: impl Fn(u32) -> T) -> [T; 3] {
    [entry(a), entry(b), entry(c)]
}

impl Numbers<'_> {
    /// Appends the values of each triangle's corners. `entry` returns the value of an entry.
    #[inline(always)]
    pub(super) fn each<T: Copy>(
        &self,
        triangles: &[IndexedTriangle],
        list: &mut Vec<[T; 3]>,
        entry: impl Fn(u32) -> T,
    ) {
        match self {
            Self::Same => list.extend(triangles.iter().map(|_| [entry(0); 3])),
            Self::Position => list.extend(triangles.iter().map(|t| three(t.corners, &entry))),
            Self::Listed(index) => {
                let entry = |position: u32| entry(listed(index, position));
                list.extend(triangles.iter().map(|t| three(t.corners, entry)));
            }
            Self::Counted(counts) => {
                let entry = |position: u32| entry(counts[position as usize]);
                list.extend(triangles.iter().map(|t| three(t.corners, entry)));
            }
            Self::Face => list.extend(triangles.iter().map(|t| [entry(t.face); 3])),
            Self::FaceListed(index) => {
                list.extend(triangles.iter().map(|t| [entry(listed(index, t.face)); 3]));
            }
            Self::Part => list.extend(triangles.iter().map(|t| [entry(t.part); 3])),
            Self::PartListed(index) => {
                list.extend(triangles.iter().map(|t| [entry(listed(index, t.part)); 3]));
            }
        }
    }
}

impl<'v> Numbers<'v> {
    /// Returns the rule of a binding.
    pub(super) fn of(
        binding: Binding,
        index: Option<&'v [i32]>,
        coord: Option<&'v [i32]>,
        runs: &Runs<'_>,
    ) -> Self {
        match (binding, index) {
            (Binding::Overall, _) => Self::Same,
            (Binding::PerVertex, _) => Self::counted(runs),
            (Binding::PerVertexIndexed, _) => match index.or(coord) {
                Some(index) => Self::Listed(index),
                None => Self::counted(runs),
            },
            (Binding::PerFaceIndexed, Some(index)) => Self::FaceListed(index),
            (Binding::PerFace | Binding::PerFaceIndexed, _) => Self::Face,
            (Binding::PerPartIndexed, Some(index)) => Self::PartListed(index),
            (Binding::PerPart | Binding::PerPartIndexed, _) => Self::Part,
        }
    }

    /// The rule for values in the order of corners. Without separators it is the position itself.
    fn counted(runs: &Runs<'_>) -> Self {
        let corners: usize = runs.runs.iter().map(|r| r.len()).sum();
        if corners == runs.positions() {
            return Self::Position;
        }
        Self::Counted(runs.counts())
    }
}
