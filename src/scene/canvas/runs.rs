//! Faces and strips as runs of corners, by index or by count; nothing is copied.

use std::ops::Range;

use super::drawing::Canvas;
use crate::traversal::state::Coordinates;

/// The corners of a face or a strip: positions in the index, or counted from the first coordinate.
#[derive(Clone, Debug)]
pub(crate) struct Run(pub Range<usize>);

impl Run {
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn start(&self) -> usize {
        self.0.start
    }
}

/// What becomes of a run with a corner that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Broken {
    /// It counts, and has no corners.
    Empty,
    Kept,
}

/// The runs of a shape.
pub(crate) struct Runs<'a> {
    index: Option<&'a [i32]>,
    /// The coordinate at position 0, where there is no index.
    first: usize,
    pub runs: Vec<Run>,
    /// The lowest coordinate of an index, and one more than the highest.
    used: Range<usize>,
    /// Some coordinate of the index does not exist.
    missing: bool,
}

impl<'a> Runs<'a> {
    /// At −1 a run ends; those of fewer than three corners are left out. Coin gives up on the rest
    /// of a face set there when asked for its triangles, and draws it in pictures.
    pub(crate) fn by_index(
        index: &'a [i32],
        coordinates: Coordinates<'_>,
        broken: Broken,
        out: &mut dyn Canvas,
    ) -> Self {
        let mut runs = Vec::with_capacity(index.len() / 4);
        let (mut start, mut bad) = (0, 0);
        let (mut lowest, mut highest) = (usize::MAX, 0);
        while start < index.len() {
            let rest = &index[start..];
            let (mut len, mut bad_here) = (0, 0);
            for c in rest.iter().take_while(|&&i| i >= 0).map(|&i| i as usize) {
                len += 1;
                if c < coordinates.len() {
                    (lowest, highest) = (lowest.min(c), highest.max(c));
                } else {
                    bad_here += 1;
                }
            }
            let corners = rest[..len].iter().map(|&i| i as usize);
            out.bound_all(corners.filter_map(|c| coordinates.get(c)));
            if len >= 3 {
                let whole = bad_here == 0 || broken == Broken::Kept;
                runs.push(Run(start..if whole { start + len } else { start }));
            }
            bad += bad_here;
            start += len + 1;
        }
        out.census().bad_corners += bad;
        Self {
            index: Some(index),
            first: 0,
            runs,
            used: lowest.min(highest)..if lowest <= highest { highest + 1 } else { 0 },
            missing: bad > 0,
        }
    }

    /// One run of all the coordinates from one on.
    pub(crate) fn whole(first: usize, count: usize) -> Self {
        Self {
            index: None,
            first,
            runs: vec![Run(0..count)],
            used: 0..0,
            missing: false,
        }
    }

    /// Runs of so many corners each, one behind the other.
    pub(crate) fn by_count(counts: &[i32], first: usize, available: usize) -> Self {
        let runs = counted(counts, first, available).into_iter();
        Self {
            index: None,
            first,
            runs: runs
                .filter(|(_, n)| *n >= 3)
                .map(|(at, n)| Run(at - first..at - first + n))
                .collect(),
            used: 0..0,
            missing: false,
        }
    }

    pub(crate) fn coordinate(&self, position: usize) -> usize {
        match self.index {
            Some(index) => index[position] as usize,
            None => self.first + position,
        }
    }

    pub(crate) fn index(&self) -> Option<&'a [i32]> {
        self.index
    }

    /// The coordinates among which are all that are used and exist.
    pub(crate) fn used(&self) -> Range<usize> {
        match self.index {
            Some(_) => self.used.clone(),
            None => self.first..self.first + self.positions(),
        }
    }

    /// Whether some corner has no coordinate.
    pub(crate) fn is_missing(&self) -> bool {
        self.missing
    }

    pub(crate) fn coordinates(&self, run: &Run) -> impl ExactSizeIterator<Item = usize> + '_ {
        run.0.clone().map(|position| self.coordinate(position))
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.runs.iter().flat_map(|run| self.coordinates(run))
    }

    /// All positions are below this.
    pub(crate) fn positions(&self) -> usize {
        match self.index {
            Some(index) => index.len(),
            None => self.runs.last().map_or(0, |run| run.0.end),
        }
    }

    /// As many triangles at most.
    pub(crate) fn triangles(&self) -> usize {
        self.runs.iter().map(|r| r.len().saturating_sub(2)).sum()
    }
}

/// First coordinate and number of each run; −1 takes all that are left. Runs past the end are
/// cut off.
pub(crate) fn counted(counts: &[i32], start: usize, available: usize) -> Vec<(usize, usize)> {
    let mut at = start;
    let mut out = Vec::new();
    for &count in counts {
        let left = available.saturating_sub(at);
        let n = usize::try_from(count).unwrap_or(left);
        if n > left {
            break;
        }
        out.push((at, n));
        at += n;
    }
    out
}
