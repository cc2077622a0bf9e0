//! Builds a tree in chunks, on the threads of rayon's current pool.
//!
//! `sah` splits the boxes into chunks. Each becomes a tree of its own, whose binary tree is freed
//! before the next one is built. The chunks depend on the boxes alone, so a tree does not depend on
//! the number of threads.

use glam::Vec3;
use ivcam_base::memory::release_free_blocks;
use rayon::prelude::*;

use super::binary::{BinaryBvh, BinaryNode, Box3};
use super::block::BLOCK;
use super::build::Method;
use super::nodes::Bvh;
use super::sah::{Above, Item, split_by_sah};

/// The smallest number of boxes that are split into chunks, and the number of chunks to aim at:
/// few, because the boxes are split into them by one thread.
const CHUNK: usize = 1 << 14;
const CHUNKS: usize = 16;

/// The largest number of boxes in a chunk, which limits the memory for its binary tree.
const LARGEST: usize = 1 << 18;

/// The number of boxes in a chunk from which freed memory is given back to the system.
pub(super) const LARGE: usize = 1 << 16;

/// The count of a leaf that stands for a chunk's tree: more than the primitives of a block, so that
/// no two of them are joined in a block.
const TREE: u32 = BLOCK as u32 + 1;

impl Bvh {
    /// Builds a tree over the boxes of primitives, which are numbered in order. A primitive whose
    /// box is empty, with the lowest corner above the highest, is left out. `triangle` returns a
    /// primitive's corners, or `None` if it is not a triangle. A refined tree takes more time to
    /// build and less for each ray. Very few rays hit another triangle in it.
    pub fn build(
        boxes: impl Iterator<Item = Box3>,
        refined: bool,
        triangle: impl Fn(u32) -> Option<[Vec3; 3]> + Sync,
    ) -> Self {
        let (least, most) = boxes.size_hint();
        let mut items: Vec<Item> = Vec::with_capacity(most.unwrap_or(least));
        let kept = boxes.zip(0..).filter(|((low, high), _)| !(low.x > high.x));
        items.extend(kept.map(|(of, i)| Item::new(of, i)));
        if items.is_empty() {
            return Self::default();
        }
        let method = Method::of(&items, refined);
        let tree = |mut items: Vec<Item>| {
            let binary = BinaryBvh::build(&mut items, &method);
            let is_large = items.len() >= LARGE;
            drop(items);
            let tree = Self::collapse(&binary, &triangle);
            drop(binary);
            if is_large {
                release_free_blocks();
            }
            tree
        };
        if items.len() <= CHUNK || method.is_whole() {
            return tree(items);
        }
        let most = (items.len() / CHUNKS).clamp(CHUNK, LARGEST);
        let above = split_by_sah(&mut items, most, &method.stop);
        let mut chunks = Vec::new();
        let nodes = above.iter().map(|node| match node {
            Above::Inner { first, around } => method.node(*around, *first as u32, 0),
            Above::Part(range) => {
                let items = items[range.clone()].to_vec();
                let around = items.iter().map(Item::around);
                let around = around.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
                chunks.push(items);
                around.map_or(BinaryNode::NONE, |around| {
                    method.node(around, chunks.len() as u32 - 1, TREE)
                })
            }
        });
        let above = BinaryBvh {
            nodes: nodes.collect(),
            order: Vec::new(),
        };
        drop(items);
        let trees = chunks.into_par_iter().map(tree).collect();
        Self::collapse_over(&above, trees)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::nodes::{Child, WIDTH};
    use ivcam_base::math::lanes::bits;
    use ivcam_optics::sampling::mix;

    /// Boxes of random sizes at random places, of which many are together in a corner.
    fn boxes() -> Vec<Box3> {
        let unit = |key: u64| (mix(key) >> 40) as f32 / (1u64 << 24) as f32;
        let point = |key: u64| Vec3::new(unit(key), unit(key + 1), unit(key + 2));
        let one = |i: u64| {
            let at = point(6 * i) * if i.is_multiple_of(3) { 1.0 } else { 0.01 };
            (at, at + 0.001 * point(6 * i + 3))
        };
        (0..6 * CHUNK as u64).map(one).collect()
    }

    fn tree(boxes: &[Box3], threads: usize) -> Bvh {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let build = || Bvh::build(boxes.iter().copied(), false, |_| None);
        pool.expect("threads start").install(build)
    }

    #[test]
    fn the_trees_of_chunks_become_one_with_every_box_in_one_leaf() {
        let boxes = boxes();
        let tree = tree(&boxes, 2);
        let mut held = vec![false; boxes.len()];
        let mut stack_size = 0;
        let everywhere = (Vec3::NEG_INFINITY, Vec3::INFINITY);
        let mut ahead = vec![(Child::ROOT, everywhere, WIDTH)];
        while let Some((child, (min, max), stacked)) = ahead.pop() {
            if child.is_leaf() {
                let blocks = &tree.blocks[child.place()..];
                let last = blocks.iter().position(|block| block.last).unwrap();
                for block in &blocks[..=last] {
                    for lane in bits(block.non_triangles) {
                        let primitive = block.primitive(lane) as usize;
                        let (low, high) = boxes[primitive];
                        assert!(low.cmpge(min).all() && high.cmple(max).all());
                        assert!(!std::mem::replace(&mut held[primitive], true));
                    }
                }
                continue;
            }
            stack_size = stack_size.max(stacked);
            let node = &tree.nodes[child.place()];
            for i in 0..WIDTH {
                let corner =
                    |from: usize| Vec3::from_array([0, 1, 2].map(|a| node.planes[from + a][i]));
                let (low, high) = (corner(0), corner(3));
                if low.cmple(high).all() {
                    assert!(low.cmpge(min).all() && high.cmple(max).all());
                    ahead.push((node.children[i], (low, high), stacked + WIDTH - 1));
                }
            }
        }
        assert!(held.iter().all(|held| *held));
        assert_eq!(tree.stack_size, stack_size);
    }

    #[test]
    fn a_tree_does_not_depend_on_the_number_of_threads() {
        let boxes = boxes();
        let [one, two] = [1, 2].map(|threads| tree(&boxes, threads));
        let content = |tree: &Bvh| {
            let nodes = tree.nodes.iter();
            let nodes = nodes.map(|node| (node.planes, node.children.map(|child| child.0)));
            let blocks = tree.blocks.iter().map(|block| block.primitives);
            (nodes.collect::<Vec<_>>(), blocks.collect::<Vec<_>>())
        };
        assert!(content(&one) == content(&two));
    }
}
