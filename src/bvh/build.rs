//! Builds the binary tree over the boxes of primitives.
//!
//! obvhs builds (PLOC); the boxes that it gets are parts of what `sah` split.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::binary::{BinaryBvh, BinaryNode};
use super::sah::{self, Item};

/// More boxes than this are parted before obvhs gets them.
const PART: usize = 64;

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        let (min, max) = self.around();
        Aabb::new(Vec3A::from(min), Vec3A::from(max))
    }
}

impl BinaryBvh {
    /// Builds over boxes, one for each primitive.
    pub fn build(boxes: &[(Vec3, Vec3)]) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        let item = |(i, around): (usize, &(Vec3, Vec3))| Item::new(*around, i as u32);
        let mut items: Vec<Item> = boxes.iter().enumerate().map(item).collect();
        let above = sah::split_by_sah(&mut items, PART);
        let params = BvhBuildParams {
            reinsertion_batch_ratio: 0.0,
            ..BvhBuildParams::fast_build()
        };
        let mut tree = Grafted {
            nodes: Vec::with_capacity(2 * items.len()),
            order: Vec::with_capacity(boxes.len()),
            pad: padding(boxes),
        };
        tree.nodes.resize(above.len(), BinaryNode::NONE);
        for (at, node) in above.iter().enumerate() {
            match node {
                sah::Above::Inner { first, around } => {
                    tree.nodes[at] = tree.node(*around, *first as u32, 0);
                }
                sah::Above::Part(range) => {
                    let items = &items[range.clone()];
                    match items.len() {
                        ..=PART => tree.graft(at, items, params),
                        _ => tree.nodes[at] = tree.leaf(items),
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

/// The tree of several trees.
struct Grafted {
    nodes: Vec<BinaryNode>,
    order: Vec<u32>,
    pad: Vec3,
}

impl Grafted {
    fn node(&self, (min, max): (Vec3, Vec3), first: u32, count: u32) -> BinaryNode {
        BinaryNode {
            min: (min - self.pad).map(f32::next_down),
            first,
            max: (max + self.pad).map(f32::next_up),
            count,
        }
    }

    /// Of items in one box.
    fn leaf(&mut self, items: &[Item]) -> BinaryNode {
        let first = self.order.len() as u32;
        self.order.extend(items.iter().map(|item| item.primitive));
        self.node(items[0].around(), first, items.len() as u32)
    }

    /// Has obvhs build over some items and puts the root at a place that is kept for it, the
    /// other nodes behind the last.
    fn graft(&mut self, root: usize, items: &[Item], params: BvhBuildParams) {
        let mut time = std::time::Duration::ZERO;
        let built = build_bvh2(items, params, &mut time);
        let base = self.nodes.len() as u32;
        for (i, n) in built.nodes.iter().enumerate() {
            let around = (Vec3::from(n.aabb.min), Vec3::from(n.aabb.max));
            let node = if n.prim_count > 0 {
                let held = n.first_index as usize..(n.first_index + n.prim_count) as usize;
                let first = self.order.len();
                let places = built.primitive_indices[held].iter();
                self.order
                    .extend(places.map(|&at| items[at as usize].primitive));
                self.node(around, first as u32, (self.order.len() - first) as u32)
            } else {
                // The root is not among the nodes behind.
                self.node(around, base + n.first_index - 1, 0)
            };
            match i {
                0 => self.nodes[root] = node,
                _ => self.nodes.push(node),
            }
        }
    }
}

/// A ray along an axis may run exactly in the face of a box, as an on-axis film point's does in a
/// scene with an edge at 0; then 0 · 2^64 says that it leaves at once. Boxes are larger by a
/// billionth of the scene: times 2^64 that is beyond any distance.
fn padding(boxes: &[(Vec3, Vec3)]) -> Vec3 {
    let size = boxes.iter().fold(0.0f32, |a, (min, max)| {
        a.max(min.abs().max_element()).max(max.abs().max_element())
    });
    Vec3::splat(size * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every box in a leaf of its own place, every leaf in the boxes above it.
    fn check(boxes: &[(Vec3, Vec3)]) {
        let BinaryBvh { nodes, order } = BinaryBvh::build(boxes);
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

    #[test]
    fn boxes_in_one_place_in_each_other_and_in_a_row_take_no_longer() {
        let start = std::time::Instant::now();
        let n = 40_000;
        let size = |i: usize| Vec3::splat(1.0 + i as f32);
        check(&(0..n).map(|_| (Vec3::ZERO, Vec3::ONE)).collect::<Vec<_>>());
        check(&(0..n).map(|i| (-size(i), size(i))).collect::<Vec<_>>());
        check(&(0..n).map(|i| (size(i), size(i) + 2.5)).collect::<Vec<_>>());
        assert!(start.elapsed().as_secs_f64() < 60.0, "minutes without care");
    }
}
