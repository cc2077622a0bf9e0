//! Which entry of a list each corner of a triangle has, by the bindings in force.

use crate::scene::canvas::{IndexedTriangle, Runs};
use crate::traversal::state::Binding;

/// Which entry of a list a corner has.
pub(super) enum Numbers<'v> {
    Same,
    Position,
    Listed(&'v [i32]),
    /// By the corners before each position.
    Counted(Vec<u32>),
    Face,
    FaceListed(&'v [i32]),
    Part,
    PartListed(&'v [i32]),
}

/// An entry of an index; where it has none, the first.
#[inline(always)]
pub(super) fn listed(list: &[i32], at: u32) -> u32 {
    let entry = list.get(at as usize).copied().unwrap_or(0);
    entry.max(0) as u32
}

/// What three corners have each.
#[inline(always)]
pub(super) fn three<T>([a, b, c]: [u32; 3], entry: impl Fn(u32) -> T) -> [T; 3] {
    [entry(a), entry(b), entry(c)]
}

impl Numbers<'_> {
    /// Appends what each triangle's three corners have.
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

    /// Corners before each position: the position itself where nothing but corners is there.
    fn counted(runs: &Runs<'_>) -> Self {
        let corners: usize = runs.runs.iter().map(|r| r.len()).sum();
        if corners == runs.positions() {
            return Self::Position;
        }
        Self::Counted(counts(runs))
    }
}

pub(super) fn counts(runs: &Runs<'_>) -> Vec<u32> {
    let mut counts = vec![0; runs.positions()];
    let mut count = 0;
    for run in &runs.runs {
        for place in &mut counts[run.0.clone()] {
            *place = count;
            count += 1;
        }
    }
    counts
}
