//! Faces and strips as runs of corners, by index or by count, without copies.

use std::ops::Range;

use ivcam_inventor::traversal::state::Coordinates;

use super::drawing::Canvas;
use super::mistake::Mistake;

/// The corners of a face or a strip, as positions. A position is an index into the shape's index,
/// or counts from the first coordinate if there is no index.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    start: u32,
    end: u32,
}

impl Run {
    /// Makes a run of positions, which are less than 2^32 like the numbers of triangles.
    fn new(positions: Range<usize>) -> Self {
        Self {
            start: positions.start as u32,
            end: positions.end as u32,
        }
    }

    /// The positions.
    pub(crate) fn positions(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    /// The number of corners.
    pub(crate) fn len(&self) -> usize {
        self.positions().len()
    }

    /// The first position.
    pub(crate) fn start(&self) -> usize {
        self.start as usize
    }
}

/// The numbers of corners, faces and parts of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeSize {
    /// The number of corners.
    pub corners: usize,
    /// The number of faces, or of segments of lines.
    pub faces: usize,
    /// The number of strips, lines or faces.
    pub parts: usize,
}

/// How a run is treated if one of its coordinates does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Broken {
    /// The run is counted, and has no corners.
    Empty,
    /// The run keeps its corners.
    Kept,
}

/// The runs of a shape.
pub(crate) struct Runs<'a> {
    index: Option<&'a [i32]>,
    /// The coordinate at position 0 if there is no index.
    first: usize,
    /// The runs in order.
    pub runs: Vec<Run>,
    /// The range of the existing coordinates in the index.
    used: Range<usize>,
    /// Whether some coordinate of the index does not exist.
    missing: bool,
}

impl<'a> Runs<'a> {
    /// Finds the runs of an index. A run ends at −1, and runs of fewer than three corners are left
    /// out. At such a run Coin's triangle callback skips the rest of a face set, but Coin's
    /// pictures do not.
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
                runs.push(Run::new(start..if whole { start + len } else { start }));
            }
            bad += bad_here;
            start += len + 1;
            if index.get(start - 1).is_some_and(|&end| end < -1) {
                out.note(Mistake::NegativeIndex);
            }
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

    /// Makes one run of `count` coordinates.
    pub(crate) fn whole(first: usize, count: usize) -> Self {
        Self {
            index: None,
            first,
            runs: vec![Run::new(0..count)],
            used: 0..0,
            missing: false,
        }
    }

    /// Makes consecutive runs with the given numbers of corners.
    pub(crate) fn by_count(
        counts: &[i32],
        first: usize,
        available: usize,
        out: &mut dyn Canvas,
    ) -> Self {
        check_counts(counts, first, available, out);
        let runs = counted(counts, first, available).into_iter();
        Self {
            index: None,
            first,
            runs: runs
                .filter(|(_, n)| *n >= 3)
                .map(|(at, n)| Run::new(at - first..at - first + n))
                .collect(),
            used: 0..0,
            missing: false,
        }
    }

    /// The coordinate at a position.
    pub(crate) fn coordinate(&self, position: usize) -> usize {
        match self.index {
            Some(index) => index[position] as usize,
            None => self.first + position,
        }
    }

    /// The shape's index, if it has one.
    pub(crate) fn index(&self) -> Option<&'a [i32]> {
        self.index
    }

    /// A range that contains all coordinates that are used and exist.
    pub(crate) fn used(&self) -> Range<usize> {
        match self.index {
            Some(_) => self.used.clone(),
            None => self.first..self.first + self.positions(),
        }
    }

    /// Whether some coordinate does not exist.
    pub(crate) fn is_missing(&self) -> bool {
        self.missing
    }

    /// The coordinates of a run.
    pub(crate) fn coordinates(&self, run: &Run) -> impl ExactSizeIterator<Item = usize> + '_ {
        run.positions().map(|position| self.coordinate(position))
    }

    /// The coordinates of all runs.
    pub(crate) fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.runs.iter().flat_map(|run| self.coordinates(run))
    }

    /// The end of the range of positions.
    pub(crate) fn positions(&self) -> usize {
        match self.index {
            Some(index) => index.len(),
            None => self.runs.last().map_or(0, |run| run.positions().end),
        }
    }

    /// The number of corners before each position, without separators.
    pub(crate) fn counts(&self) -> Vec<u32> {
        let mut counts = vec![0; self.positions()];
        let mut count = 0;
        for run in &self.runs {
            for place in &mut counts[run.positions()] {
                *place = count;
                count += 1;
            }
        }
        counts
    }

    /// The numbers of corners, faces and runs, of which each is a face.
    pub(crate) fn size(&self) -> ShapeSize {
        ShapeSize {
            corners: self.runs.iter().map(Run::len).sum(),
            faces: self.runs.len(),
            parts: self.runs.len(),
        }
    }

    /// The largest possible number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        self.runs.iter().map(|r| r.len().saturating_sub(2)).sum()
    }
}

/// Returns the first coordinate and the length of each run. A count of −1 means all remaining
/// coordinates. The list ends before a run that does not fit.
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

/// Notes the mistakes in a list of numbers of corners, of which −1 means all remaining coordinates.
pub(crate) fn check_counts(counts: &[i32], start: usize, available: usize, out: &mut dyn Canvas) {
    let takes_rest = counts.last() == Some(&-1);
    let stated = &counts[..counts.len() - usize::from(takes_rest)];
    if stated.iter().any(|&n| n < 0) {
        out.note(Mistake::NegativeCount);
        return;
    }
    let needed = stated
        .iter()
        .fold(start, |sum, &n| sum.saturating_add(n as usize));
    if needed > available && !stated.is_empty() {
        out.note(Mistake::FewCoordinates);
    }
}
