//! Splits boxes into parts by the binned surface area heuristic (SAH).
//!
//! obvhs builds the trees of the parts. docs/decisions/0005-who-builds-the-tree.md says which
//! scenes are split.

use std::ops::Range;

use glam::{Vec3, Vec4};
use ivcam_base::work::StopSignal;

use super::binary::Box3;

/// A box with its primitive. They are stored together, so that a part is read sequentially.
#[derive(Clone, Copy)]
pub(super) struct Item {
    low: Vec3,
    high: Vec3,
    /// The primitive's number.
    pub primitive: u32,
}

impl Item {
    pub(super) fn new((low, high): Box3, primitive: u32) -> Self {
        Self {
            low,
            high,
            primitive,
        }
    }

    pub(super) fn around(&self) -> Box3 {
        (self.low, self.high)
    }

    /// The smallest and the largest corner; w is 0.
    #[inline(always)]
    fn corners(&self) -> [Vec4; 2] {
        [self.low.extend(0.0), self.high.extend(0.0)]
    }

    /// Twice the center of the box; w is 0.
    #[inline(always)]
    fn middle(&self) -> Vec4 {
        let [low, high] = self.corners();
        low + high
    }
}

/// Bounds of the items of a part.
#[derive(Clone, Copy)]
struct CostExtent {
    low: Vec4,
    high: Vec4,
    /// The smallest [`Item::middle`].
    first: Vec4,
    /// The largest [`Item::middle`].
    last: Vec4,
}

impl CostExtent {
    const NONE: Self = Self {
        low: Vec4::INFINITY,
        high: Vec4::NEG_INFINITY,
        first: Vec4::INFINITY,
        last: Vec4::NEG_INFINITY,
    };

    #[inline(always)]
    fn add(&mut self, item: &Item) {
        let [low, high] = item.corners();
        let middle = low + high;
        self.low = self.low.min(low);
        self.high = self.high.max(high);
        self.first = self.first.min(middle);
        self.last = self.last.max(middle);
    }

    fn of(items: &[Item]) -> Self {
        let mut extent = Self::NONE;
        items.iter().for_each(|item| extent.add(item));
        extent
    }
}

/// A node of the tree above the parts.
pub(super) enum Above {
    /// A box with two children: node `first` and the node after it.
    Inner { first: usize, around: Box3 },
    /// The range of the items of a part.
    Part(Range<usize>),
}

/// Reorders items into consecutive parts of at most `most` items, and returns the tree above the
/// parts, with the root first. A part is larger only if all its boxes are equal, or if the work is
/// stopped. Many items are split on the threads of rayon's current pool; the parts and the tree do
/// not depend on their number.
pub(super) fn split_by_sah(items: &mut [Item], most: usize, stop: &StopSignal) -> Vec<Above> {
    let splitting = Splitting {
        most,
        // Below this depth parts are cut in half, so that no branch becomes much deeper.
        deep: 2 * items.len().max(1).ilog2() + 8,
        stop,
    };
    if items.len() <= most {
        return vec![Above::Part(0..items.len())];
    }
    let extent = CostExtent::of(items);
    splitting.split(items, 0, (0, extent))
}

/// The number of items from which both parts of a cut are split by threads of their own.
const MANY: usize = 1 << 15;

/// How items are split.
struct Splitting<'a> {
    most: usize,
    deep: u32,
    stop: &'a StopSignal,
}

impl Splitting<'_> {
    /// Splits a part whose first item has the number `start`, at a depth of the tree.
    fn split(
        &self,
        items: &mut [Item],
        start: usize,
        (depth, extent): (u32, CostExtent),
    ) -> Vec<Above> {
        if self.is_part(items, &extent) {
            return vec![Above::Part(start..start + items.len())];
        }
        let is_large = items.len() >= MANY;
        let (left, [a, b]) = cut(items, &extent, depth > self.deep);
        let (low, high) = items.split_at_mut(left);
        let mut low = || self.split(low, start, (depth + 1, a));
        let mut high = || self.split(high, start + left, (depth + 1, b));
        let halves = match is_large {
            true => rayon::join(low, high),
            false => (low(), high()),
        };
        let around = (extent.low.truncate(), extent.high.truncate());
        joined(around, halves.into())
    }

    /// Whether items are not split any further.
    fn is_part(&self, items: &[Item], extent: &CostExtent) -> bool {
        items.len() <= self.most || self.stop.is_set() || is_one_box(items, extent)
    }
}

/// The tree of a node around two trees. Both their roots come first, so the nodes behind them move
/// by two, and those of the second tree also by the nodes of the first.
fn joined(around: Box3, halves: [Vec<Above>; 2]) -> Vec<Above> {
    let moves = [2, halves[0].len() + 1];
    let mut above = vec![Above::Inner { first: 1, around }];
    let mut rest = Vec::with_capacity(halves[0].len() + halves[1].len());
    for (nodes, by) in halves.into_iter().zip(moves) {
        let mut nodes = nodes.into_iter().map(|node| match node {
            Above::Inner { first, around } => Above::Inner {
                first: first + by,
                around,
            },
            part => part,
        });
        above.extend(nodes.next());
        rest.extend(nodes);
    }
    above.append(&mut rest);
    above
}

fn is_one_box(items: &[Item], extent: &CostExtent) -> bool {
    let first = items[0].around();
    extent.first.truncate() == extent.last.truncate() && items.iter().all(|i| i.around() == first)
}

fn area(low: Vec4, high: Vec4) -> f32 {
    let d = (high - low).max(Vec4::ZERO);
    d.x * d.y + d.y * d.z + d.z * d.x
}

const BINS: usize = 32;

/// The bounds and the number of the items in an interval along an axis.
#[derive(Clone, Copy)]
struct Bin {
    low: Vec4,
    high: Vec4,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self {
        low: Vec4::INFINITY,
        high: Vec4::NEG_INFINITY,
        count: 0,
    };

    #[inline(always)]
    fn join(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.count += other.count;
    }

    /// The SAH cost: area times count.
    fn cost(&self) -> f32 {
        area(self.low, self.high) * self.count as f32
    }
}

/// The mapping from an item to its bin along each axis.
struct SplitPlaces {
    first: Vec4,
    scale: Vec4,
}

impl SplitPlaces {
    fn of(extent: &CostExtent) -> Self {
        let size = extent.last - extent.first;
        // If all centers are equal on an axis, all items are in the first bin.
        let scale = size.to_array().map(|size| match size > 0.0 {
            true => BINS as f32 * (1.0 - 1e-6) / size,
            false => 0.0,
        });
        Self {
            first: extent.first,
            scale: Vec4::from_array(scale),
        }
    }

    /// The bin of an item along each axis. Adding `SHIFT` leaves the nearest integer in the last
    /// bits of the float.
    #[inline(always)]
    fn bins(&self, item: &Item) -> [usize; 3] {
        const SHIFT: f32 = 12_582_912.0; // 1.5 · 2^23; floats from 2^23 on are integers
        let at = (item.middle() - self.first) * self.scale - 0.5 + SHIFT;
        [at.x, at.y, at.z].map(|x| x.to_bits() as usize % BINS)
    }
}

/// Cuts a part in two between two of [`BINS`] bins along the axis for which the sum of area times
/// count is smallest (Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*).
/// It cuts in half if all centers are equal or if `in_halves` is set. Returns the number of items
/// in the first part and the bounds of both parts; neither is empty.
fn cut(items: &mut [Item], extent: &CostExtent, in_halves: bool) -> (usize, [CostExtent; 2]) {
    let places = SplitPlaces::of(extent);
    let best = if in_halves {
        None
    } else {
        best(items, &places)
    };
    let Some((axis, k)) = best else {
        let left = items.len() / 2;
        return (
            left,
            [
                CostExtent::of(&items[..left]),
                CostExtent::of(&items[left..]),
            ],
        );
    };
    let mut extents = [CostExtent::NONE; 2];
    let mut left = 0;
    // A branch would be mispredicted. Instead every item is exchanged with the first one of the
    // second part, and the first part grows by it or not.
    for i in 0..items.len() {
        let item = items[i];
        let side = usize::from(places.bins(&item)[axis] >= k);
        items[i] = items[left];
        items[left] = item;
        left += 1 - side;
        extents[side].add(&item);
    }
    (left, extents)
}

/// The best axis, and the bin before which to cut.
fn best(items: &[Item], places: &SplitPlaces) -> Option<(usize, usize)> {
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items {
        let [low, high] = item.corners();
        let bin = Bin {
            low,
            high,
            count: 1,
        };
        for (bins, at) in bins.iter_mut().zip(places.bins(item)) {
            bins[at].join(&bin);
        }
    }
    let mut best = (f32::INFINITY, None);
    for (axis, bins) in bins.iter().enumerate() {
        let mut right = [0.0; BINS];
        let mut sum = Bin::EMPTY;
        for k in (1..BINS).rev() {
            sum.join(&bins[k]);
            right[k] = sum.cost();
        }
        sum = Bin::EMPTY;
        for k in 1..BINS {
            sum.join(&bins[k - 1]);
            let cost = sum.cost() + right[k];
            if sum.count > 0 && (sum.count as usize) < items.len() && cost < best.0 {
                best = (cost, Some((axis, k)));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(boxes: &[Box3]) -> Vec<Item> {
        let numbered = boxes.iter().zip(0..);
        numbered.map(|(&around, i)| Item::new(around, i)).collect()
    }

    /// Boxes in a row, inside each other, in one place, growing geometrically, or far apart.
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
    fn parts_are_small_and_complete_and_lie_in_the_boxes_above_them() {
        for kind in 0..5 {
            // So many that both parts of a cut are split by themselves, and fewer.
            let count = if kind == 0 { 3 * MANY } else { 3000 };
            let boxes: Vec<Box3> = (0..count).map(|i| hard(kind, i)).collect();
            let mut items = items(&boxes);
            let above = split_by_sah(&mut items, 64, &StopSignal::default());
            let mut held = vec![false; boxes.len()];
            let mut ahead = vec![(0, (Vec3::NEG_INFINITY, Vec3::INFINITY))];
            while let Some((at, outer)) = ahead.pop() {
                match &above[at] {
                    Above::Inner { first, around } => {
                        assert!(around.0.cmpge(outer.0).all() && around.1.cmple(outer.1).all());
                        ahead.extend([(*first, *around), (*first + 1, *around)]);
                    }
                    Above::Part(range) => {
                        assert!(!range.is_empty());
                        let first = items[range.start].around();
                        let is_one = items[range.clone()].iter().all(|i| i.around() == first);
                        assert!(range.len() <= 64 || is_one);
                        for item in &items[range.clone()] {
                            let around = item.around();
                            assert!(around.0.cmpge(outer.0).all() && around.1.cmple(outer.1).all());
                            assert!(!std::mem::replace(&mut held[item.primitive as usize], true));
                        }
                    }
                }
            }
            assert!(held.iter().all(|h| *h), "kind {kind}");
        }
    }
}
