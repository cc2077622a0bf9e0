//! Splits boxes into parts by the binned surface area heuristic (SAH).
//!
//! obvhs builds the trees of the parts. docs/decisions/0005-who-builds-the-tree.md says which
//! scenes are split.

use std::array::from_fn;
use std::ops::Range;

use glam::{Vec3, Vec4};
use ivcam_base::math::simd::{VectorKernel, Vectors, dispatch_vectors};
use ivcam_base::work::StopSignal;

use super::binary::Box3;

/// A box: the smallest corner with opposite signs and the largest corner, with anything behind
/// each. The greater number of each pair joins two boxes.
type Faces = [f32; 8];

const NOTHING: Faces = [f32::NEG_INFINITY; 8];

/// Enlarges a box.
#[inline(always)]
fn join<V: Vectors>(v: V, to: &mut Faces, with: V::Vector) {
    let joined = v.max(v.load(to, 0), with);
    v.store(to, 0, u32::MAX, joined);
}

fn corners([x, y, z, _, high @ .., _]: Faces) -> Box3 {
    (-Vec3::new(x, y, z), Vec3::from_array(high))
}

/// A box with its primitive. They are stored together, so that a part is read sequentially.
#[derive(Clone, Copy)]
pub(super) struct Item {
    /// The box. The lower half of the primitive's number is behind the smallest corner, and the
    /// upper half behind the largest, both as floats.
    faces: Faces,
}

impl Item {
    pub(super) fn new((low, high): Box3, primitive: u32) -> Self {
        let ([x, y, z], [a, b, c]) = ((-low).to_array(), high.to_array());
        let [lower, upper] = [primitive & 0xffff, primitive >> 16].map(|half| half as f32);
        Self {
            faces: [x, y, z, lower, a, b, c, upper],
        }
    }

    pub(super) fn around(&self) -> Box3 {
        corners(self.faces)
    }

    /// The primitive's number.
    pub(super) fn primitive(&self) -> u32 {
        let [_, _, _, lower, .., upper] = self.faces;
        lower as u32 | (upper as u32) << 16
    }

    /// Twice the center of the box, and anything.
    #[inline(always)]
    fn middle(&self) -> Vec4 {
        let half = |first: usize| Vec4::from_array(from_fn(|i| self.faces[first + i]));
        half(4) - half(0)
    }

    /// A box around twice the center of the box.
    #[inline(always)]
    fn middles<V: Vectors>(&self, v: V) -> V::Vector {
        let opposite: Faces = from_fn(|i| self.faces[(i + 4) % 8]);
        v.sub(v.load(&self.faces, 0), v.load(&opposite, 0))
    }
}

/// Bounds of the items of a part.
#[derive(Clone, Copy)]
struct CostExtent {
    around: Faces,
    /// Bounds of [`Item::middle`].
    middles: Faces,
}

impl CostExtent {
    fn of(items: &[Item]) -> Self {
        dispatch_vectors(Bounding(items))
    }
}

/// Computes the bounds of items.
struct Bounding<'a>(&'a [Item]);

impl VectorKernel for Bounding<'_> {
    type Output = CostExtent;

    #[inline(always)]
    fn run<V: Vectors, E: Vectors>(self, _: V, v: E) -> CostExtent {
        let (mut around, mut middles) = (NOTHING, NOTHING);
        for item in self.0 {
            join(v, &mut around, v.load(&item.faces, 0));
            join(v, &mut middles, item.middles(v));
        }
        CostExtent { around, middles }
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
        joined(corners(extent.around), halves.into())
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
    let (least, most) = corners(extent.middles);
    least == most && items.iter().all(|i| i.around() == first)
}

#[inline(always)]
fn area(faces: &Faces) -> f32 {
    let [x, y, z] = from_fn(|i| (faces[4 + i] + faces[i]).max(0.0));
    x * y + y * z + z * x
}

const BINS: usize = 32;

/// The items in intervals along an axis.
#[derive(Clone, Copy)]
struct Bins {
    around: [Faces; BINS],
    count: [u32; BINS],
}

impl Bins {
    const EMPTY: Self = Self {
        around: [NOTHING; BINS],
        count: [0; BINS],
    };
}

/// Where to cut a part in two, and the boxes around both parts.
struct SahCut {
    axis: usize,
    /// The first of the bins of the second part.
    bin: usize,
    around: [Faces; 2],
}

/// Puts items into bins along each axis.
struct Binning<'a> {
    items: &'a [Item],
    places: &'a SplitPlaces,
    to: &'a mut [Bins; 3],
}

impl VectorKernel for Binning<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vectors, E: Vectors>(self, _: V, v: E) {
        for item in self.items {
            let faces = v.load(&item.faces, 0);
            for (bins, at) in self.to.iter_mut().zip(self.places.bins(item)) {
                join(v, &mut bins.around[at], faces);
                bins.count[at] += 1;
            }
        }
    }
}

/// Finds the cheapest cut of binned items.
struct CheapestCut<'a>(&'a [Bins; 3]);

impl VectorKernel for CheapestCut<'_> {
    type Output = Option<SahCut>;

    #[inline(always)]
    fn run<V: Vectors, E: Vectors>(self, _: V, v: E) -> Option<SahCut> {
        let (mut least, mut best) = (f32::INFINITY, None);
        for (axis, bins) in self.0.iter().enumerate() {
            let mut right = [0.0; BINS];
            let (mut around, mut count) = (NOTHING, 0);
            for k in (1..BINS).rev() {
                join(v, &mut around, v.load(&bins.around[k], 0));
                count += bins.count[k];
                right[k] = area(&around) * count as f32;
            }
            let all = count + bins.count[0];
            (around, count) = (NOTHING, 0);
            for (k, right) in right.iter().enumerate().skip(1) {
                join(v, &mut around, v.load(&bins.around[k - 1], 0));
                count += bins.count[k - 1];
                let cost = area(&around) * count as f32 + right;
                if count > 0 && count < all && cost < least {
                    least = cost;
                    best = Some((axis, k));
                }
            }
        }
        let (axis, bin) = best?;
        let mut around = [NOTHING; 2];
        for (k, faces) in self.0[axis].around.iter().enumerate() {
            join(v, &mut around[usize::from(k >= bin)], v.load(faces, 0));
        }
        Some(SahCut { axis, bin, around })
    }
}

/// The mapping from an item to its bin along each axis.
struct SplitPlaces {
    first: Vec4,
    scale: Vec4,
}

impl SplitPlaces {
    fn of(extent: &CostExtent) -> Self {
        let (first, last) = corners(extent.middles);
        // If all centers are equal on an axis, all items are in the first bin.
        let scale = (last - first).to_array().map(|size| match size > 0.0 {
            true => BINS as f32 * (1.0 - 1e-6) / size,
            false => 0.0,
        });
        Self {
            first: first.extend(0.0),
            scale: Vec3::from_array(scale).extend(0.0),
        }
    }

    /// The bin of an item along each axis. Adding `SHIFT` leaves the nearest integer in the last
    /// bits of the float.
    #[inline(always)]
    fn bins(&self, item: &Item) -> [usize; 3] {
        let at = (item.middle() - self.first) * self.scale - 0.5 + SHIFT;
        [at.x, at.y, at.z].map(|x| x.to_bits() as usize % BINS)
    }

    /// The bin of an item along one axis.
    #[inline(always)]
    fn bin(&self, item: &Item, axis: usize) -> usize {
        let middle = item.faces[4 + axis] - item.faces[axis];
        let at = (middle - self.first[axis]) * self.scale[axis] - 0.5 + SHIFT;
        at.to_bits() as usize % BINS
    }
}

const SHIFT: f32 = 12_582_912.0; // 1.5 · 2^23; floats from 2^23 on are integers

/// Cuts a part in two between two of [`BINS`] bins along the axis for which the sum of area times
/// count is smallest (Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*).
/// It cuts in half if all centers are equal or if `in_halves` is set. Returns the number of items
/// in the first part and the bounds of both parts; neither is empty.
fn cut(items: &mut [Item], extent: &CostExtent, in_halves: bool) -> (usize, [CostExtent; 2]) {
    let places = &SplitPlaces::of(extent);
    let mut bins = [Bins::EMPTY; 3];
    if !in_halves {
        let to = &mut bins;
        dispatch_vectors(Binning { items, places, to });
    }
    if let Some(cut) = dispatch_vectors(CheapestCut(&bins)) {
        return dispatch_vectors(Partition { items, places, cut });
    }
    let left = items.len() / 2;
    let (low, high) = items.split_at(left);
    (left, [low, high].map(CostExtent::of))
}

/// Moves the items before a cut to the front.
struct Partition<'a> {
    items: &'a mut [Item],
    places: &'a SplitPlaces,
    cut: SahCut,
}

impl VectorKernel for Partition<'_> {
    type Output = (usize, [CostExtent; 2]);

    #[inline(always)]
    fn run<V: Vectors, E: Vectors>(self, _: V, v: E) -> Self::Output {
        let Self { items, places, cut } = self;
        let axis = cut.axis % 3;
        let mut middles = [v.splat(f32::NEG_INFINITY); 2];
        let mut left = 0;
        // A branch would be mispredicted. Instead every item is exchanged with the first one of the
        // second part, and the first part grows by it or not.
        for i in 0..items.len() {
            let item = items[i];
            let is_right = places.bin(&item, axis) >= cut.bin;
            items[i] = items[left];
            items[left] = item;
            left += usize::from(!is_right);
            let own = item.middles(v);
            for (side, middles) in middles.iter_mut().enumerate() {
                let is_here = is_right == (side == 1);
                let beyond = v.splat(if is_here { 0.0 } else { f32::NEG_INFINITY });
                *middles = v.max(v.add(own, beyond), *middles);
            }
        }
        let mut extents = cut.around.map(|around| CostExtent {
            around,
            middles: NOTHING,
        });
        for (extent, middles) in extents.iter_mut().zip(middles) {
            v.store(&mut extent.middles, 0, u32::MAX, middles);
        }
        (left, extents)
    }
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
                            assert!(!std::mem::replace(
                                &mut held[item.primitive() as usize],
                                true
                            ));
                        }
                    }
                }
            }
            assert!(held.iter().all(|h| *h), "kind {kind}");
        }
    }
}
