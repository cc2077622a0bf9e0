//! The parts that a picture is shared out in.

use crate::film::Resolution;

/// Pixels on a side of a tile: enough to share out, few enough to stay in the cache.
const TILE: u32 = 8;

/// A part of the picture: pixels `x0..x1`, `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl Tile {
    /// All tiles of a picture, row by row.
    pub(crate) fn all(resolution: Resolution) -> Vec<Self> {
        let Resolution { width, height } = resolution;
        let rows = (0..height).step_by(TILE as usize);
        rows.flat_map(|y0| {
            (0..width).step_by(TILE as usize).map(move |x0| Self {
                x0,
                y0,
                x1: (x0 + TILE).min(width),
                y1: (y0 + TILE).min(height),
            })
        })
        .collect()
    }

    pub(super) fn pixels(self) -> impl Iterator<Item = (u32, u32)> {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| (x, y)))
    }
}
