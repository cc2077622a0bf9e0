//! Tiles: the parts of a picture that threads render.

use crate::film::{Region, Resolution};

/// Pixels on a side of a tile. It is small enough to share the work evenly among threads and for a
/// tile's rays to stay in the cache.
const TILE: u32 = 8;

/// The pixels in columns `x0..x1` and rows `y0..y1` of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl Tile {
    /// Returns all tiles of a picture, row by row.
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

    /// Returns the parts of all tiles inside a region of the picture, row by row.
    pub(super) fn inside(region: Region, resolution: Resolution) -> Vec<Self> {
        let right = region.left + region.width;
        let bottom = region.top + region.height;
        let part = |tile: Self| Self {
            x0: tile.x0.max(region.left),
            y0: tile.y0.max(region.top),
            x1: tile.x1.min(right),
            y1: tile.y1.min(bottom),
        };
        let parts = Self::all(resolution).into_iter().map(part);
        parts.filter(|t| t.x0 < t.x1 && t.y0 < t.y1).collect()
    }

    /// Returns the column and row of each pixel of the tile, row by row.
    pub(super) fn pixels(self) -> impl Iterator<Item = (u32, u32)> {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| (x, y)))
    }
}
