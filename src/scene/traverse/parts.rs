//! What obvhs is given to build over: distinct boxes, a few at a time.
//!
//! PLOC joins pairs of boxes that are each other's nearest. Of boxes that are the same, lie in each
//! other or stand in an even row there is one such pair a round, and its time grows with the square
//! of their number: 20,000 cubes in a row took half a minute, 150,000 in one place took minutes.

use std::ops::Range;

use glam::Vec3;

type Box3 = (Vec3, Vec3);

/// Primitives by their boxes: those whose boxes are the same go to the builder as one.
pub struct Alike {
    /// The first primitive in each box.
    pub firsts: Vec<u32>,
    /// The next one in the same box, `NONE` after the last.
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Alike {
    /// Takes every box for different.
    pub fn none(count: usize) -> Self {
        Self {
            firsts: (0..count as u32).collect(),
            next: vec![NONE; count],
        }
    }

    pub fn of(boxes: &[Box3]) -> Self {
        let mut this = Self {
            firsts: Vec::with_capacity(boxes.len()),
            next: vec![NONE; boxes.len()],
        };
        // Open addressing: where a box's last primitive so far is.
        let mask = (2 * boxes.len()).next_power_of_two() - 1;
        let mut table = vec![NONE; mask + 1];
        for (i, around) in boxes.iter().enumerate() {
            let mut slot = hash(around) as usize & mask;
            loop {
                match table[slot] {
                    NONE => this.firsts.push(i as u32),
                    last if boxes[last as usize] == *around => this.next[last as usize] = i as u32,
                    _ => {
                        slot = (slot + 1) & mask;
                        continue;
                    }
                }
                table[slot] = i as u32;
                break;
            }
        }
        this
    }

    /// The primitives that share a box, from its first.
    pub fn from(&self, first: u32) -> impl Iterator<Item = u32> + '_ {
        let some = |i: u32| (i != NONE).then_some(i);
        std::iter::successors(some(first), move |&i| some(self.next[i as usize]))
    }
}

/// Equal boxes have equal numbers; −0 is 0.
fn hash((min, max): &Box3) -> u64 {
    let numbers = [min.x, min.y, min.z, max.x, max.y, max.z];
    let mixed = numbers.iter().fold(0u64, |h, n| {
        let bits = u64::from((n + 0.0).to_bits());
        (h.rotate_left(23) ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    });
    mixed >> 20
}

/// A box with its center and its primitive: moved as one, so that looking at a part runs through
/// memory in order.
#[derive(Clone, Copy)]
pub struct Item {
    pub around: Box3,
    pub primitive: u32,
}

impl Item {
    fn center(&self) -> Vec3 {
        0.5 * self.around.0 + 0.5 * self.around.1
    }
}

/// A node above the parts: its two children stand behind one another.
pub enum Above {
    Inner { first: usize, around: Box3 },
    Part(Range<usize>),
}

/// Orders items so that parts of at most `most` lie together, and gives the tree above them, the
/// root first.
pub fn part(items: &mut [Item], most: usize) -> Vec<Above> {
    let mut above = vec![Above::Part(0..items.len())];
    // No branch is deeper: from there on it is cut in halves.
    let deep = 2 * items.len().max(1).ilog2() + 8;
    let mut ahead = vec![(0, 0)];
    while let Some((at, depth)) = ahead.pop() {
        let Above::Part(range) = &above[at] else {
            continue;
        };
        let (start, end) = (range.start, range.end);
        if end - start <= most {
            continue;
        }
        let around = union(items[start..end].iter().map(|i| i.around));
        let middle = start + cut(&mut items[start..end], depth > deep);
        let first = above.len();
        above.push(Above::Part(start..middle));
        above.push(Above::Part(middle..end));
        above[at] = Above::Inner { first, around };
        ahead.extend([(first, depth + 1), (first + 1, depth + 1)]);
    }
    above
}

const EMPTY: Box3 = (Vec3::INFINITY, Vec3::NEG_INFINITY);

fn union(boxes: impl Iterator<Item = Box3>) -> Box3 {
    boxes.fold(EMPTY, |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn area((min, max): Box3) -> f32 {
    let d = (max - min).max(Vec3::ZERO);
    d.x * d.y + d.y * d.z + d.z * d.x
}

const BINS: usize = 24;

/// Cuts where the sum of areas times counts is least, of as many places along each axis (Wald
/// 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*), or in halves where the
/// centers do not part or `in_halves`. How many items are in the first part, neither of them empty.
fn cut(items: &mut [Item], in_halves: bool) -> usize {
    let (low, high) = union(items.iter().map(|i| (i.center(), i.center())));
    let scale = (BINS as f32 * (1.0 - 1e-6)) / (high - low);
    let bin = |i: &Item, axis: usize| {
        let at = (i.center()[axis] - low[axis]) * scale[axis];
        (at as usize).min(BINS - 1)
    };
    let mut bins = [[(EMPTY, 0u32); BINS]; 3];
    if !in_halves {
        for item in items.iter() {
            for (axis, bins) in bins.iter_mut().enumerate() {
                let (around, count) = &mut bins[bin(item, axis)];
                *around = (around.0.min(item.around.0), around.1.max(item.around.1));
                *count += 1;
            }
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    for (axis, bins) in bins.iter().enumerate().filter(|(a, _)| high[*a] > low[*a]) {
        let mut right = [0.0; BINS];
        let mut sum = (EMPTY, 0);
        for k in (1..BINS).rev() {
            sum = (union([sum.0, bins[k].0].into_iter()), sum.1 + bins[k].1);
            right[k] = area(sum.0) * sum.1 as f32;
        }
        sum = (EMPTY, 0);
        for k in 1..BINS {
            sum = (
                union([sum.0, bins[k - 1].0].into_iter()),
                sum.1 + bins[k - 1].1,
            );
            let cost = area(sum.0) * sum.1 as f32 + right[k];
            if sum.1 > 0 && (sum.1 as usize) < items.len() && cost < best.0 {
                best = (cost, axis, k);
            }
        }
    }
    let (cost, axis, k) = best;
    if cost == f32::INFINITY {
        return items.len() / 2;
    }
    let mut middle = 0;
    for i in 0..items.len() {
        if bin(&items[i], axis) < k {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(boxes: &[Box3]) -> Vec<Item> {
        let numbered = boxes.iter().zip(0..);
        numbered
            .map(|(&around, primitive)| Item { around, primitive })
            .collect()
    }

    /// Boxes in a row, in each other, in one place, growing by a factor, far apart.
    fn hard(kind: usize, i: usize) -> Box3 {
        let x = i as f32;
        match kind {
            0 => (Vec3::X * x, Vec3::X * x + 1.5),
            1 => (Vec3::splat(-x), Vec3::splat(x)),
            2 => (Vec3::ZERO, Vec3::ONE),
            3 => (Vec3::X * 1.02f32.powf(x), Vec3::X * 1.02f32.powf(x)),
            _ => (
                Vec3::splat(1e17 * (x % 2.0)),
                Vec3::splat(1e17 * (x % 2.0) + x),
            ),
        }
    }

    #[test]
    fn parts_are_small_hold_everything_and_lie_in_the_boxes_above_them() {
        for kind in 0..5 {
            let boxes: Vec<Box3> = (0..3000).map(|i| hard(kind, i)).collect();
            let mut items = items(&boxes);
            let above = part(&mut items, 64);
            let mut held = vec![false; boxes.len()];
            let mut ahead = vec![(0, (Vec3::NEG_INFINITY, Vec3::INFINITY))];
            while let Some((at, outer)) = ahead.pop() {
                match &above[at] {
                    Above::Inner { first, around } => {
                        assert!(around.0.cmpge(outer.0).all() && around.1.cmple(outer.1).all());
                        ahead.extend([(*first, *around), (*first + 1, *around)]);
                    }
                    Above::Part(range) => {
                        assert!(!range.is_empty() && range.len() <= 64);
                        for item in &items[range.clone()] {
                            let around = item.around;
                            assert!(around.0.cmpge(outer.0).all() && around.1.cmple(outer.1).all());
                            assert!(!std::mem::replace(&mut held[item.primitive as usize], true));
                        }
                    }
                }
            }
            assert!(held.iter().all(|h| *h), "kind {kind}");
        }
    }

    #[test]
    fn boxes_that_are_the_same_hang_together() {
        let boxes: Vec<Box3> = (0..100).map(|i| hard(0, i % 7)).collect();
        let alike = Alike::of(&boxes);
        assert_eq!(alike.firsts, [0, 1, 2, 3, 4, 5, 6]);
        let third: Vec<u32> = alike.from(2).collect();
        assert_eq!(third, (0..100).filter(|i| i % 7 == 2).collect::<Vec<u32>>());
    }
}
