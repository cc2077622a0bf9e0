//! Tiles: the parts of a picture that threads render, and the rows of pixels they are cut from.

use serde::{Deserialize, Serialize};

use crate::film::{Exposed, Region, Resolution};

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

/// The pixels of a film that belong to one tile, as parts of the film's rows.
pub(super) struct TilePixels<'a> {
    pub tile: Tile,
    rows: Vec<&'a mut [Exposed]>,
}

impl TilePixels<'_> {
    /// Returns a copy of the pixels, row by row.
    pub(super) fn copied(&self) -> Vec<Exposed> {
        self.rows
            .iter()
            .flat_map(|row| row.iter().copied())
            .collect()
    }

    /// Replaces the pixels.
    pub(super) fn set(&mut self, pixels: &[Exposed]) {
        let width = (self.tile.x1 - self.tile.x0) as usize;
        for (row, pixels) in self.rows.iter_mut().zip(pixels.chunks_exact(width)) {
            row.copy_from_slice(pixels);
        }
    }
}

/// A row of tiles with its part of a film.
pub(super) struct Band<'a> {
    /// The part of the region that the row of tiles covers.
    region: Region,
    pixels: &'a mut [Exposed],
}

impl<'a> Band<'a> {
    /// Cuts the pixels of a region of the picture into its rows of tiles.
    pub(super) fn all(region: Region, mut pixels: &'a mut [Exposed]) -> Vec<Self> {
        let band = |(y0, y1)| {
            let size = (y1 - y0) as usize * region.width as usize;
            let (band, rest) = std::mem::take(&mut pixels).split_at_mut(size);
            pixels = rest;
            Self {
                region: Region {
                    top: y0,
                    height: y1 - y0,
                    ..region
                },
                pixels: band,
            }
        };
        cuts(region.top, region.height).map(band).collect()
    }

    /// Cuts the row into its tiles.
    pub(super) fn tiles(self) -> Vec<TilePixels<'a>> {
        let empty = |tile| TilePixels {
            tile,
            rows: Vec::with_capacity(TILE as usize),
        };
        let mut tiles: Vec<TilePixels<'a>> = Tile::inside(self.region).map(empty).collect();
        for mut row in self.pixels.chunks_exact_mut(self.region.width as usize) {
            for tile in &mut tiles {
                let (part, rest) = row.split_at_mut((tile.tile.x1 - tile.tile.x0) as usize);
                tile.rows.push(part);
                row = rest;
            }
        }
        tiles
    }
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
    fn the_tiles_of_a_region_share_out_its_pixels() {
        let region = Region {
            left: 13,
            top: 5,
            width: 20,
            height: 17,
        };
        let mut pixels = vec![Exposed::default(); region.resolution().pixels()];
        let bands = Band::all(region, &mut pixels);
        let tiles: Vec<TilePixels<'_>> = bands.into_iter().flat_map(Band::tiles).collect();
        assert_eq!(tiles.len() as u64, Tile::count(region));
        assert!(tiles.iter().map(|t| t.tile).eq(Tile::inside(region)));
        for mut tile in tiles {
            let (x, y) = (tile.tile.x0 / TILE, tile.tile.y0 / TILE);
            assert_eq!(
                ((tile.tile.x1 - 1) / TILE, (tile.tile.y1 - 1) / TILE),
                (x, y)
            );
            let mut own = tile.copied();
            own.iter_mut()
                .zip(tile.tile.pixels())
                .for_each(|(pixel, (x, y))| {
                    pixel.count += 100 * y + x;
                });
            tile.set(&own);
        }
        let places = (5..22).flat_map(|y| (13..33).map(move |x| 100 * y + x));
        assert!(pixels.iter().map(|p| p.count).eq(places));
    }

    #[test]
    fn strips_cover_the_region() {
        let region = Region {
            left: 3,
            top: 5,
            width: 10,
            height: 57,
        };
        let cut =
            |most| -> Vec<(u32, u32)> { strips(region, most).map(|s| (s.top, s.height)).collect() };
        assert_eq!(cut(479), [(5, 32), (37, 25)]);
        assert_eq!(cut(1), [(5, 16), (21, 16), (37, 16), (53, 9)]);
        assert_eq!(cut(usize::MAX), [(5, 57)]);
    }
}
