//! Faces and strips as runs of corners, by index or by count; nothing is copied.

use std::ops::Range;

use crate::graph::state::Coordinates;
use crate::scene::Builder;

/// The corners of a face or a strip: positions in the index, or counted from the first coordinate.
#[derive(Clone, Debug)]
pub struct Run(pub Range<usize>);

impl Run {
    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn start(&self) -> usize {
        self.0.start
    }
}

/// What becomes of a run with a corner that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Broken {
    /// It counts, and has no corners.
    Empty,
    Kept,
}

/// The runs of a shape.
pub struct Runs<'a> {
    index: Option<&'a [i32]>,
    /// The coordinate at position 0, where there is no index.
    first: usize,
    pub runs: Vec<Run>,
}

impl<'a> Runs<'a> {
    /// At −1 a run ends; those of fewer than three corners are left out (Coin gives up on the rest
    /// of the shape there).
    pub fn by_index(
        index: &'a [i32],
        coordinates: Coordinates<'_>,
        broken: Broken,
        out: &mut Builder<'_>,
    ) -> Self {
        let mut runs = Vec::with_capacity(index.len() / 4);
        let mut start = 0;
        while start < index.len() {
            let rest = &index[start..];
            let len = rest.iter().position(|&i| i < 0).unwrap_or(rest.len());
            let corners = rest[..len].iter().map(|&i| i as usize);
            let bad = corners.clone().filter(|&c| c >= coordinates.len()).count();
            out.census_mut().bad_corners += bad as u64;
            out.bound_all(corners.filter_map(|c| coordinates.get(c)));
            if len >= 3 {
                let whole = bad == 0 || broken == Broken::Kept;
                runs.push(Run(start..if whole { start + len } else { start }));
            }
            start += len + 1;
        }
        Self {
            index: Some(index),
            first: 0,
            runs,
        }
    }

    /// Runs of so many corners each, one behind the other.
    pub fn by_count(counts: &[i32], first: usize, available: usize) -> Self {
        let runs = counted(counts, first, available).into_iter();
        Self {
            index: None,
            first,
            runs: runs
                .filter(|(_, n)| *n >= 3)
                .map(|(at, n)| Run(at - first..at - first + n))
                .collect(),
        }
    }

    pub fn coordinate(&self, position: usize) -> usize {
        match self.index {
            Some(index) => index[position] as usize,
            None => self.first + position,
        }
    }

    pub fn coordinates(&self, run: &Run) -> impl ExactSizeIterator<Item = usize> + '_ {
        run.0.clone().map(|position| self.coordinate(position))
    }

    pub fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.runs.iter().flat_map(|run| self.coordinates(run))
    }

    /// All positions are below this.
    pub fn positions(&self) -> usize {
        match self.index {
            Some(index) => index.len(),
            None => self.runs.last().map_or(0, |run| run.0.end),
        }
    }

    /// As many triangles at most.
    pub fn triangles(&self) -> usize {
        self.runs.iter().map(|r| r.len().saturating_sub(2)).sum()
    }
}

/// First coordinate and number of each run; −1 takes all that are left. Runs past the end are
/// cut off.
pub fn counted(counts: &[i32], start: usize, available: usize) -> Vec<(usize, usize)> {
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
