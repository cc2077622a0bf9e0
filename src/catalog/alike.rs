//! Finds scenes of a catalog that are the same or look alike, without their pictures.
//!
//! Two pictures look alike if none of [`CELLS`] parts differs by more than [`TOLERANCE`] of 255 in
//! the mean of a channel. The sums over all parts then differ by no more than that times the number
//! of parts, so scenes are ordered by their sums, and each is compared with its neighbors only.

use std::collections::HashMap;

use ivcam_optics::picture::{Depth, Picture};

use super::entry::{Entry, Others};
use super::sha256::hex;

/// The parts of a picture across and down.
const CELLS: (usize, usize) = (12, 9);
/// The largest difference of two pictures that look alike, in levels of 255. No search is recorded:
/// a change of a smooth surface by three levels is not visible at the size of a thumbnail.
const TOLERANCE: u8 = 3;
/// The distance in a list of levels of one that is compared and the next: a prime, and so no factor
/// of their number. Neighbors have similar levels, and the border of most pictures is one gray.
const STRIDE: usize = 163;
/// The largest number of other scenes that are listed for one.
const MOST: usize = 12;

/// Returns the mean levels of the parts of a picture, in hexadecimal digits.
pub(super) fn look(picture: &Picture) -> String {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let levels = picture.levels(Depth::Eight);
    let range = |i: usize, of: usize, size: usize| {
        let start = (i * size / of).min(size - 1);
        start..((i + 1) * size / of).max(start + 1)
    };
    let mut means = Vec::with_capacity(3 * CELLS.0 * CELLS.1);
    for (row, column) in (0..CELLS.1).flat_map(|row| (0..CELLS.0).map(move |column| (row, column)))
    {
        let (rows, columns) = (range(row, CELLS.1, height), range(column, CELLS.0, width));
        let (mut sums, count) = ([0_u64; 3], (rows.len() * columns.len()) as u64);
        for pixel in rows.flat_map(|y| columns.clone().map(move |x| y * width + x)) {
            let levels = &levels[3 * pixel..3 * pixel + 3];
            sums.iter_mut()
                .zip(levels)
                .for_each(|(sum, level)| *sum += u64::from(*level));
        }
        means.extend(sums.map(|sum| ((sum + count / 2) / count) as u8));
    }
    hex(&means)
}

/// The relations of a scene to the others, as numbers of groups and a picture.
struct Relative {
    bytes: usize,
    scene: usize,
    look: Vec<u8>,
    /// The sum of `look`.
    sum: u32,
}

/// Fills in the relations of all scenes.
pub(super) fn relate(entries: &mut [Entry]) {
    let known = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    let bytes = groups(entries.iter().map(|entry| known(&entry.sha256)));
    let scenes = groups(entries.iter().map(|entry| entry.scene_sha256.clone()));
    let relatives: Vec<Relative> = entries
        .iter()
        .enumerate()
        .map(|(i, entry)| {
            let look = entry.look.as_deref().map(spread).unwrap_or_default();
            let sum = look.iter().map(|level| u32::from(*level)).sum();
            Relative {
                bytes: bytes.of[i],
                scene: scenes.of[i],
                look,
                sum,
            }
        })
        .collect();
    let mut order: Vec<usize> = (0..entries.len())
        .filter(|i| !relatives[*i].look.is_empty())
        .collect();
    order.sort_by_key(|&i| (relatives[i].sum, i));
    let mut alike: Vec<Vec<usize>> = vec![Vec::new(); entries.len()];
    for place in 0..order.len() {
        alike[order[place]] = neighbors(&relatives, &order, place);
    }
    let names: Vec<String> = entries.iter().map(|entry| entry.file.clone()).collect();
    let others = |list: &mut dyn Iterator<Item = usize>| {
        let mut found: Vec<usize> = list.take(MOST + 1).collect();
        let more = found.len() > MOST;
        found.truncate(MOST);
        found.sort_unstable();
        Others {
            files: found.into_iter().map(|i| names[i].clone()).collect(),
            more,
        }
    };
    for (i, entry) in entries.iter_mut().enumerate() {
        let own = &relatives[i];
        let equal = bytes.lists[own.bytes].iter().copied().filter(|&j| j != i);
        entry.duplicates = others(&mut { equal });
        let same = scenes.lists[own.scene].iter().copied();
        entry.same_scene = others(&mut same.filter(|&j| relatives[j].bytes != own.bytes));
        entry.alike = others(&mut alike[i].iter().copied());
    }
}

/// The items with equal keys. An item without a key is in a group of its own.
struct Groups {
    /// The group of each item.
    of: Vec<usize>,
    /// The items of each group.
    lists: Vec<Vec<usize>>,
}

fn groups(keys: impl Iterator<Item = Option<String>>) -> Groups {
    let mut groups = Groups {
        of: Vec::new(),
        lists: Vec::new(),
    };
    let mut numbers: HashMap<String, usize> = HashMap::new();
    for (i, key) in keys.enumerate() {
        let new = groups.lists.len();
        let group = key.map_or(new, |key| *numbers.entry(key).or_insert(new));
        if group == new {
            groups.lists.push(Vec::new());
        }
        groups.lists[group].push(i);
        groups.of.push(group);
    }
    groups
}

/// Returns scenes that look like one but are others: all, or one more than are listed.
fn neighbors(relatives: &[Relative], order: &[usize], place: usize) -> Vec<usize> {
    let own = &relatives[order[place]];
    let most = u32::from(TOLERANCE) * own.look.len() as u32;
    let is_near = |&&j: &&usize| relatives[j].sum.abs_diff(own.sum) <= most;
    let is_alike = |&&j: &&usize| {
        let other = &relatives[j];
        let differs = |(a, b): (&u8, &u8)| a.abs_diff(*b) > TOLERANCE;
        let is_same = other.bytes == own.bytes || other.scene == own.scene;
        !is_same && !own.look.iter().zip(&other.look).any(differs)
    };
    let before = order[..place].iter().rev().take_while(is_near);
    let after = order[place + 1..].iter().take_while(is_near);
    let found = before.chain(after).filter(is_alike).take(MOST + 1);
    found.copied().collect()
}

/// Returns the levels of a look in the order in which they are compared.
fn spread(digits: &str) -> Vec<u8> {
    let levels = levels(digits);
    let order = (0..levels.len()).map(|i| i * STRIDE % levels.len());
    order.map(|i| levels[i]).collect()
}

/// Returns the bytes of hexadecimal digits; those of a damaged catalog may be fewer.
fn levels(digits: &str) -> Vec<u8> {
    let pairs = digits.as_bytes().chunks_exact(2);
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    pairs.map_while(byte).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_optics::film::Response;

    fn entry(file: &str, bytes: &str, scene: Option<&str>, levels: &[u8]) -> Entry {
        Entry {
            file: file.to_owned(),
            sha256: bytes.to_owned(),
            scene_sha256: scene.map(str::to_owned),
            look: (!levels.is_empty()).then(|| hex(levels)),
            ..Entry::default()
        }
    }

    #[test]
    fn scenes_are_equal_or_the_same_or_alike_and_only_one_of_these() {
        let mut list = [
            entry("a", "1", Some("x"), &[10, 200]),
            entry("b", "1", Some("x"), &[10, 200]),
            entry("c", "2", Some("x"), &[10, 200]),
            entry("d", "3", Some("y"), &[13, 197]),
            entry("e", "4", Some("z"), &[14, 200]),
            entry("f", "5", None, &[]),
            entry("g", "6", None, &[]),
            entry("h", "", None, &[]),
            entry("i", "", None, &[]),
        ];
        relate(&mut list);
        let files = |others: &Others| others.files.join("");
        let found: Vec<_> = list
            .iter()
            .map(|e| {
                [&e.duplicates, &e.same_scene, &e.alike]
                    .map(files)
                    .join(" ")
            })
            .collect();
        let expected = [
            "b c d", "a c d", " ab d", "  abce", "  d", "  ", "  ", "  ", "  ",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn long_lists_are_cut_and_say_so() {
        let mut list: Vec<Entry> = (0..40)
            .map(|i| entry(&format!("{i:02}"), "1", Some("x"), &[9]))
            .collect();
        relate(&mut list);
        assert_eq!(
            (list[5].duplicates.files.len(), list[5].duplicates.more),
            (MOST, true)
        );
        assert!(!list[5].duplicates.files.contains(&"05".to_owned()));
        assert!(list[5].alike.files.is_empty());
    }

    #[test]
    fn a_look_is_the_mean_of_each_part_of_a_picture() {
        let picture = |width: u32, height: u32, pixels: Vec<[f32; 3]>| Picture {
            width,
            height,
            pixels,
            response: Response::Linear,
            provenance: indexmap::IndexMap::new(),
        };
        let halves = |i: u32| {
            if i % 24 < 12 {
                [0.0, 0.2, 1.0]
            } else {
                [1.0; 3]
            }
        };
        let look = look(&picture(24, 18, (0..24 * 18).map(halves).collect()));
        assert_eq!(look.len(), 2 * 3 * CELLS.0 * CELLS.1);
        assert!(
            look.starts_with("0033ff") && look.ends_with("ffffff"),
            "{look}"
        );
        let tiny = super::look(&picture(1, 1, vec![[0.0, 0.2, 1.0]]));
        assert_eq!(tiny, "0033ff".repeat(CELLS.0 * CELLS.1));
    }
}
