//! Tiles: the parts of a picture that threads render.

use ivcam_optics::film::{Region, Resolution};
use serde::{Deserialize, Serialize};

/// Pixels on a side of a tile. It is small enough to share the work evenly among threads and for a
/// tile's rays to stay in the cache.
const TILE: u32 = 8;

/// The pixels in columns `x0..x1` and rows `y0..y1` of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Tile {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl Tile {
    /// The number of pixels of a whole tile.
    pub(super) const PIXELS: usize = (TILE * TILE) as usize;

    /// Returns the parts of all tiles inside a region of the picture, row by row.
    pub(super) fn inside(region: Region) -> impl Iterator<Item = Self> {
        let columns = cuts(region.left, region.width);
        cuts(region.top, region.height).flat_map(move |(y0, y1)| {
            let tile = move |(x0, x1)| Self { x0, y0, x1, y1 };
            columns.clone().map(tile)
        })
    }

    /// Returns the number of tiles with a part inside a region of the picture.
    pub(super) fn count(region: Region) -> u64 {
        let columns = cuts(region.left, region.width).count() as u64;
        columns * cuts(region.top, region.height).count() as u64
    }

    /// Cuts a region of the picture into its rows of tiles.
    pub(super) fn rows(region: Region) -> impl Iterator<Item = Region> {
        cuts(region.top, region.height).map(move |(y0, y1)| Region {
            top: y0,
            height: y1 - y0,
            ..region
        })
    }

    /// Returns the number of the row of tiles with a pixel row, counted from the one with `top`.
    pub(super) fn rows_between(top: u32, y: u32) -> usize {
        (y / TILE - top / TILE) as usize
    }

    /// Returns the column and row of each pixel of the tile, row by row.
    pub(super) fn pixels(self) -> impl Iterator<Item = (u32, u32)> {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| (x, y)))
    }
}

/// Returns the parts into which the sides of tiles cut `size` columns or rows from `from`.
fn cuts(from: u32, size: u32) -> impl Iterator<Item = (u32, u32)> + Clone {
    let end = from + size;
    let tiles = from / TILE..end.div_ceil(TILE);
    tiles.map(move |tile| ((tile * TILE).max(from), ((tile + 1) * TILE).min(end)))
}

/// Cuts a region into strips of whole rows of tiles with at most a number of pixels, or of two rows
/// of tiles if that is more. Strips are a multiple of 16 rows high, except for the last one.
pub(super) fn strips(region: Region, most_pixels: usize) -> impl Iterator<Item = Region> {
    let rows = (most_pixels / region.width as usize).min(Resolution::LIMIT as usize) as u32;
    let rows = (rows / (2 * TILE)).max(1) * 2 * TILE;
    let tops = (0..region.height).step_by(rows as usize);
    tops.map(move |top| Region {
        top: region.top + top,
        height: rows.min(region.height - top),
        ..region
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_cover_the_region() {
        let region = Region::new([3, 5], [10, 57]);
        let cut =
            |most| -> Vec<(u32, u32)> { strips(region, most).map(|s| (s.top, s.height)).collect() };
        assert_eq!(cut(479), [(5, 32), (37, 25)]);
        assert_eq!(cut(1), [(5, 16), (21, 16), (37, 16), (53, 9)]);
        assert_eq!(cut(usize::MAX), [(5, 57)]);
    }
}
