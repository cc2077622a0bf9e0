//! Builds the binary tree over the boxes of primitives.
//!
//! obvhs builds the whole tree of an ordinary chunk by PLOC and reinsertion. If there are very many
//! boxes, or if boxes repeat, `sah` splits the upper tree and obvhs builds small parts below it.
//! Reasons and measurements are in docs/decisions/0005-who-builds-the-tree.md.

use glam::{Vec3, Vec3A};
use ivcam_base::work::{Budget, StopSignal};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::binary::{BinaryBvh, BinaryNode, Box3};
use super::sah::{self, Item};

/// The largest number of boxes whose whole tree obvhs builds. In a scene of a million triangles,
/// rays take up to a quarter more time through its tree than through one that `sah` split.
const WHOLE: usize = 1 << 17;

/// The largest number of boxes in a part that obvhs builds below the tree split by `sah`.
const PART: usize = 64;

/// Parameters for a tree that is built fast, and for parts, which are too small for reinsertion to
/// matter.
const FAST: BvhBuildParams = BvhBuildParams {
    reinsertion_batch_ratio: 0.0,
    ..BvhBuildParams::fast_build()
};

/// Parameters for a whole tree for many rays. Reinsertion takes a third of the build time and saves
/// up to a tenth of a ray's time.
const REFINED: BvhBuildParams = BvhBuildParams {
    reinsertion_batch_ratio: 0.1,
    post_collapse_reinsertion_batch_ratio_multiplier: 1.0,
    ..BvhBuildParams::fast_build()
};

/// How the binary trees of a scene's chunks are built.
pub(super) struct Method {
    /// The largest number of boxes to give to obvhs at once.
    part: usize,
    params: BvhBuildParams,
    /// The distance by which every box is enlarged: see [`padding`].
    pad: Vec3,
    /// The signal that ends the work. Nobody uses a tree that was built after it.
    pub(super) stop: StopSignal,
}

impl Method {
    /// The method for all boxes of a scene.
    pub(super) fn of(items: &[Item], refined: bool) -> Self {
        let part = part_size(items);
        Self {
            part,
            params: if refined && part == WHOLE {
                REFINED
            } else {
                FAST
            },
            pad: padding(items),
            stop: Budget::current().stop().clone(),
        }
    }

    /// Whether one tree is built over all boxes, because reinsertion moves nodes anywhere in it.
    pub(super) fn is_whole(&self) -> bool {
        self.params.reinsertion_batch_ratio > 0.0
    }

    /// Returns a node with an enlarged box.
    pub(super) fn node(&self, (min, max): Box3, first: u32, count: u32) -> BinaryNode {
        BinaryNode {
            min: (min - self.pad).map(f32::next_down),
            first,
            max: (max + self.pad).map(f32::next_up),
            count,
        }
    }
}

/// Returns the method's `part` for these boxes.
fn part_size(items: &[Item]) -> usize {
    if items.len() <= PART || items.len() <= WHOLE && !repeats(items) {
        WHOLE
    } else {
        PART
    }
}

/// Whether many boxes have the same size, as in a grid or in one place, or contain each other.
///
/// PLOC joins pairs of boxes that are each other's nearest. Among such boxes it finds only one pair
/// in each round, so its time grows with the square of their number. Rays through its tree of a
/// grid take up to a third more time.
fn repeats(items: &[Item]) -> bool {
    const SAMPLE: usize = 1024;
    let step = items.len().div_ceil(SAMPLE);
    let sample = || items.iter().step_by(step).map(Item::around);
    // Sizes without their lowest 12 bits, so that equal boxes in different places compare as equal.
    let size = |(min, max): Box3| (max - min).to_array().map(|x| x.to_bits() >> 12);
    let mut sizes: Vec<[u32; 3]> = sample().map(size).collect();
    let sampled = sizes.len();
    sizes.sort_unstable();
    let shared = |of_one: &[[u32; 3]]| if of_one.len() > 8 { of_one.len() } else { 0 };
    let alike: usize = sizes.chunk_by(|a, b| a == b).map(shared).sum();
    let area = |(min, max): Box3| {
        let d = (max - min).as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    };
    let all = items.iter().fold(items[0].around(), |(min, max), of_one| {
        let (low, high) = of_one.around();
        (min.min(low), max.max(high))
    });
    let mean = sample().map(area).sum::<f64>() / sampled as f64;
    // PLOC computes areas in f32.
    let overflows = area(all) >= f64::from(f32::MAX);
    2 * alike > sampled || 16.0 * mean > area(all) && items.len() > SAMPLE || overflows
}

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        let (min, max) = self.around();
        Aabb::new(Vec3A::from(min), Vec3A::from(max))
    }
}

impl BinaryBvh {
    /// Builds the tree over the boxes of a chunk, of which there is at least one. Reorders them.
    pub(super) fn build(items: &mut [Item], method: &Method) -> Self {
        let above = sah::split_by_sah(items, method.part, &method.stop);
        let mut tree = Grafted {
            nodes: Vec::with_capacity(2 * items.len()),
            order: Vec::with_capacity(items.len()),
            method,
        };
        tree.nodes.resize(above.len(), BinaryNode::NONE);
        for (at, node) in above.iter().enumerate() {
            match node {
                sah::Above::Inner { first, around } => {
                    tree.nodes[at] = method.node(*around, *first as u32, 0);
                }
                sah::Above::Part(range) => {
                    let items = &items[range.clone()];
                    if items.len() <= method.part && !method.stop.is_set() {
                        tree.graft(at, items);
                    } else {
                        tree.nodes[at] = tree.leaf(items);
                    }
                }
            }
        }
        Self {
            nodes: tree.nodes,
            order: tree.order,
        }
    }
}

/// A tree under construction, to which the trees of parts are added.
struct Grafted<'a> {
    nodes: Vec<BinaryNode>,
    order: Vec<u32>,
    method: &'a Method,
}

impl Grafted<'_> {
    /// Makes a leaf of items that have the same box.
    fn leaf(&mut self, items: &[Item]) -> BinaryNode {
        let first = self.order.len() as u32;
        self.order.extend(items.iter().map(Item::primitive));
        self.method
            .node(items[0].around(), first, items.len() as u32)
    }

    /// Builds a tree over some items with obvhs. Its root becomes the node `root`, and its other
    /// nodes are appended.
    fn graft(&mut self, root: usize, items: &[Item]) {
        let mut time = std::time::Duration::ZERO;
        let built = build_bvh2(items, self.method.params, &mut time);
        let base = self.nodes.len() as u32;
        for (i, n) in built.nodes.iter().enumerate() {
            let around = (Vec3::from(n.aabb.min), Vec3::from(n.aabb.max));
            let node = if n.prim_count > 0 {
                let held = n.first_index as usize..(n.first_index + n.prim_count) as usize;
                let first = self.order.len();
                let places = built.primitive_indices[held].iter();
                self.order
                    .extend(places.map(|&at| items[at as usize].primitive()));
                let count = self.order.len() - first;
                self.method.node(around, first as u32, count as u32)
            } else {
                // The root is not among the appended nodes.
                self.method.node(around, base + n.first_index - 1, 0)
            };
            match i {
                0 => self.nodes[root] = node,
                _ => self.nodes.push(node),
            }
        }
    }
}

/// The distance by which boxes are enlarged: 1e-9 of the scene's largest coordinate.
///
/// A ray along an axis may run exactly in the face of a box: for example, that of an on-axis film
/// point in a scene with an edge at 0. Its distance to the face would then be 0 · 2^64 = 0, so that
/// it would leave the box at once. 1e-9 · 2^64 is beyond any distance.
fn padding(items: &[Item]) -> Vec3 {
    let size = items.iter().fold(0.0f32, |a, item| {
        let (min, max) = item.around();
        a.max(min.abs().max_element()).max(max.abs().max_element())
    });
    Vec3::splat(size * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_optics::sampling::mix;

    /// Checks that every box is in exactly one leaf, and that every node's box contains those below
    /// it.
    fn check(boxes: &[Box3]) {
        let numbered = boxes.iter().zip(0..);
        let mut items: Vec<Item> = numbered.map(|(of, i)| Item::new(*of, i)).collect();
        let method = Method::of(&items, true);
        let BinaryBvh { nodes, order } = BinaryBvh::build(&mut items, &method);
        let mut held = vec![false; boxes.len()];
        let mut ahead = vec![(0, Vec3::NEG_INFINITY, Vec3::INFINITY)];
        while let Some((at, min, max)) = ahead.pop() {
            let node: &BinaryNode = &nodes[at as usize];
            assert!(node.min.cmpge(min).all() && node.max.cmple(max).all());
            if node.count == 0 {
                let children = [node.first, node.first + 1];
                ahead.extend(children.map(|c| (c, node.min, node.max)));
                continue;
            }
            for &i in &order[node.first as usize..(node.first + node.count) as usize] {
                let (min, max) = boxes[i as usize];
                assert!(node.min.cmple(min).all() && node.max.cmpge(max).all());
                assert!(!std::mem::replace(&mut held[i as usize], true));
            }
        }
        assert!(held.iter().all(|h| *h));
    }

    fn hard(n: usize) -> [Vec<Box3>; 3] {
        let size = |i: usize| Vec3::splat(1.0 + i as f32);
        [
            (0..n).map(|_| (Vec3::ZERO, Vec3::ONE)).collect(),
            (0..n).map(|i| (-size(i), size(i))).collect(),
            (0..n).map(|i| (size(i), size(i) + 2.5)).collect(),
        ]
    }

    /// Boxes of random sizes at random places.
    fn ordinary(n: u64) -> Vec<Box3> {
        let unit = |key: u64| (mix(key) >> 40) as f32 / (1u64 << 24) as f32;
        let point = |key: u64| Vec3::new(unit(key), unit(key + 1), unit(key + 2));
        let one = |i: u64| (point(6 * i), point(6 * i) + 0.02 * point(6 * i + 3));
        (0..n).map(one).collect()
    }

    #[test]
    fn every_box_is_in_one_leaf_and_inside_of_the_boxes_above_it() {
        hard(40_000).iter().for_each(|boxes| check(boxes));
        for count in [1, 2, 5, 64, 65, 5000] {
            check(&ordinary(count));
        }
    }

    /// For boxes in one place, inside each other or in a row, PLOC takes one round for each box.
    #[test]
    fn obvhs_builds_ordinary_scenes_whole_and_repeating_boxes_in_small_parts() {
        let part = |boxes: Vec<Box3>| {
            let items: Vec<Item> = boxes
                .into_iter()
                .map(|of_one| Item::new(of_one, 0))
                .collect();
            part_size(&items)
        };
        for boxes in hard(40_000) {
            assert_eq!(part(boxes), PART);
        }
        assert_eq!(part(ordinary(40_000)), WHOLE);
        assert_eq!(part(ordinary(WHOLE as u64 + 1)), PART);
    }
}
