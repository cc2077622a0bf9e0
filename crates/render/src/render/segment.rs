//! The pixels of a film while they get a range of samples, tile by tile.
//!
//! Threads take the pixels of a tile, expose them, and put them back together with what they cost.
//! A tile is open or finished at every moment, so the film can be kept while it is exposed.

use std::io::Write;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ivcam_optics::film::{Exposed, Region};

use super::exposure::Counts;
use super::tile::Tile;

/// The pixels of a region of the picture that get samples.
pub(super) struct Segment<'a> {
    /// The numbers of the samples.
    pub samples: Range<u32>,
    rows: Vec<Mutex<TileRow<'a>>>,
    /// The row of the topmost pixels.
    top: u32,
    /// The number of finished tiles.
    finished: AtomicU64,
}

/// A row of tiles with its part of a film.
struct TileRow<'a> {
    region: Region,
    pixels: &'a mut [Exposed],
    tiles: Vec<Tile>,
    is_finished: Vec<bool>,
    /// The rays of the finished tiles.
    counts: Counts,
}

impl<'a> Segment<'a> {
    /// Cuts the pixels of a region of the picture into its tiles. `finished` has the numbers of the
    /// tiles that have the samples already.
    pub(super) fn new(
        region: Region,
        samples: Range<u32>,
        mut pixels: &'a mut [Exposed],
        finished: &[u64],
    ) -> Self {
        let mut number = 0;
        let row = |region: Region| {
            let size = region.resolution().pixels();
            let (own, rest) = std::mem::take(&mut pixels).split_at_mut(size);
            pixels = rest;
            let tiles: Vec<Tile> = Tile::inside(region).collect();
            let numbers = number..number + tiles.len() as u64;
            number = numbers.end;
            Mutex::new(TileRow {
                region,
                pixels: own,
                is_finished: numbers
                    .map(|n| finished.binary_search(&n).is_ok())
                    .collect(),
                tiles,
                counts: Counts::default(),
            })
        };
        Self {
            samples,
            rows: Tile::rows(region).map(row).collect(),
            top: region.top,
            finished: AtomicU64::new(finished.len() as u64),
        }
    }

    /// Returns the open tiles of each row.
    pub(super) fn open_tiles(&self) -> Vec<Vec<Tile>> {
        let open = |row: &Mutex<TileRow<'_>>| {
            let row = locked(row);
            let states = row.tiles.iter().zip(&row.is_finished);
            states
                .filter(|(_, done)| !**done)
                .map(|(tile, _)| *tile)
                .collect()
        };
        self.rows.iter().map(open).collect()
    }

    /// Returns a copy of the pixels of a tile, row by row.
    pub(super) fn pixels(&self, tile: Tile) -> Vec<Exposed> {
        let row = self.row(tile);
        let mut pixels = Vec::with_capacity(tile.pixels().count());
        for range in row.ranges(tile) {
            pixels.extend_from_slice(&row.pixels[range]);
        }
        pixels
    }

    /// Replaces the pixels of tiles, which are then finished, and adds the rays that they took.
    /// Returns the number of finished tiles.
    pub(super) fn finish(&self, tiles: &[Tile], pixels: &[Exposed], counts: &Counts) -> u64 {
        let (mut rest, mut counts) = (pixels, Some(counts));
        for tiles in tiles.chunk_by(|a, b| a.y0 == b.y0) {
            let mut row = self.row(tiles[0]);
            for tile in tiles {
                for range in row.ranges(*tile) {
                    let (own, after) = rest.split_at(range.len().min(rest.len()));
                    row.pixels[range][..own.len()].copy_from_slice(own);
                    rest = after;
                }
                if let Some(number) = row.tiles.iter().position(|t| t == tile) {
                    row.is_finished[number] = true;
                }
            }
            if let Some(counts) = counts.take() {
                row.counts.add(counts);
            }
        }
        let count = tiles.len() as u64;
        self.finished.fetch_add(count, Ordering::Relaxed) + count
    }

    /// Returns the number of finished tiles.
    pub(super) fn finished(&self) -> u64 {
        self.finished.load(Ordering::Relaxed)
    }

    /// Returns the rays of the tiles that were finished in this segment.
    pub(super) fn counts(&self) -> Counts {
        let counts = self.rows.iter().map(|row| locked(row).counts);
        counts.fold(Counts::default(), |sum, counts| sum.plus(&counts))
    }

    /// Returns a copy of each row of tiles with its region, while threads may finish others.
    pub(super) fn rows(&self) -> impl Iterator<Item = (Region, Vec<Exposed>)> {
        let copy = |row: &Mutex<TileRow<'_>>| {
            let row = locked(row);
            (row.region, row.pixels.to_vec())
        };
        self.rows.iter().map(copy)
    }

    /// Writes the pixels and the numbers of the finished tiles, while threads may finish others.
    /// Returns the rays of the tiles that were finished in this segment.
    pub(super) fn write(&self, to: &mut dyn Write) -> std::io::Result<Counts> {
        let mut counts = Counts::default();
        for row in &self.rows {
            let row = locked(row);
            counts.add(&row.counts);
            let bytes = |eight: &[bool]| {
                let bits = eight.iter().rev();
                bits.fold(0, |byte, done| byte << 1 | u8::from(*done))
            };
            let bits: Vec<u8> = row.is_finished.chunks(8).map(bytes).collect();
            to.write_all(&bits)?;
            write_pixels(row.pixels, to)?;
        }
        Ok(counts)
    }

    fn row(&self, tile: Tile) -> MutexGuard<'_, TileRow<'a>> {
        locked(&self.rows[Tile::rows_between(self.top, tile.y0)])
    }
}

impl TileRow<'_> {
    /// Returns the places of a tile's pixels, row by row.
    fn ranges(&self, tile: Tile) -> impl Iterator<Item = Range<usize>> + use<> {
        let Region {
            left, top, width, ..
        } = self.region;
        (tile.y0..tile.y1).map(move |y| {
            let start = ((y - top) * width) as usize;
            start + (tile.x0 - left) as usize..start + (tile.x1 - left) as usize
        })
    }
}

fn locked<'m, 'a>(row: &'m Mutex<TileRow<'a>>) -> MutexGuard<'m, TileRow<'a>> {
    row.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes the pixels of a film.
pub(super) fn write_pixels(pixels: &[Exposed], to: &mut dyn Write) -> std::io::Result<()> {
    // One by one they would cost a call for each 52 bytes.
    for some in pixels.chunks(1024) {
        let bytes: Vec<u8> = some.iter().flat_map(|p| p.to_bytes()).collect();
        to.write_all(&bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const REGION: Region = Region::new([13, 5], [20, 17]);

    #[test]
    fn the_tiles_of_a_region_share_out_its_pixels() {
        let mut pixels = vec![Exposed::default(); REGION.resolution().pixels()];
        let segment = Segment::new(REGION, 0..1, &mut pixels, &[1]);
        let open = segment.open_tiles().concat();
        assert_eq!(open.len() as u64 + 1, Tile::count(REGION));
        let skipped = Tile::inside(REGION).nth(1).unwrap();
        for tile in open {
            let mut own = segment.pixels(tile);
            own.iter_mut()
                .zip(tile.pixels())
                .for_each(|(pixel, (x, y))| {
                    pixel.count += 100 * y + x;
                });
            segment.finish(&[tile], &own, &Counts::default());
        }
        assert!(segment.open_tiles().concat().is_empty());
        drop(segment);
        let skipped: Vec<(u32, u32)> = skipped.pixels().collect();
        let places = (5..22).flat_map(|y| (13..33).map(move |x| (x, y)));
        let counts = places.map(|at| match skipped.contains(&at) {
            true => 0,
            false => 100 * at.1 + at.0,
        });
        assert!(pixels.iter().map(|p| p.count).eq(counts));
    }
}
