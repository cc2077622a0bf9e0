//! Collapses a binary tree into nodes of eight boxes.
//!
//! Of all possible collapses it chooses the one for which a ray is expected to test the fewest
//! nodes and blocks by the surface area heuristic (Ylitie, Karras and Laine, *Efficient Incoherent
//! Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017, section 3.1).

use glam::Vec3;
use ivcam_base::memory::release_free_blocks;

use super::binary::BinaryBvh;
use super::block::{BLOCK, Block};
use super::chunks::LARGE;
use super::nodes::{Bvh, Child, WIDTH, WideNode};

impl Bvh {
    /// Collapses a binary tree. `triangle` returns a primitive's corners, or `None` if it is not a
    /// triangle.
    pub(super) fn collapse(
        binary: &BinaryBvh,
        triangle: impl Fn(u32) -> Option<[Vec3; 3]>,
    ) -> Self {
        let mut held = Vec::new();
        // Long lists that are reserved at once leave fewer holes in the heap than lists that grow.
        // Memory that is not used is not touched, and is given back afterwards.
        let reserved = Self {
            nodes: Vec::with_capacity(binary.nodes.len() / 2 + 1),
            blocks: Vec::with_capacity(binary.order.len()),
            stack_size: 0,
            is_crowded: false,
        };
        let mut this = reserved.collapse_with(binary, |this, leaf, _| {
            held.clear();
            primitives(binary, leaf, &mut held);
            this.add_blocks(&held, &triangle)
        });
        this.nodes.shrink_to_fit();
        this.blocks.shrink_to_fit();
        this
    }

    /// Collapses a binary tree in which each leaf stands for one of `trees`: a leaf's `first` is
    /// its index.
    pub(super) fn collapse_over(binary: &BinaryBvh, mut trees: Vec<Self>) -> Self {
        let count = |of: fn(&Self) -> usize| trees.iter().map(of).sum();
        let this = Self {
            nodes: Vec::with_capacity(binary.nodes.len() + count(|t| t.nodes.len())),
            blocks: Vec::with_capacity(count(|t| t.blocks.len())),
            stack_size: 0,
            is_crowded: false,
        };
        this.collapse_with(binary, |this, leaf, stacked| {
            let tree = std::mem::take(&mut trees[binary.nodes[leaf as usize].first as usize]);
            this.append(tree, stacked)
        })
    }

    /// Appends a tree below a node at which at most `stacked` boxes are on the traversal stack.
    fn append(&mut self, tree: Self, stacked: usize) -> Child {
        let (nodes, blocks) = (self.nodes.len() as u32, self.blocks.len() as u32);
        self.stack_size = self.stack_size.max(stacked + tree.stack_size - 1);
        self.blocks.extend(tree.blocks);
        self.nodes.extend(tree.nodes.into_iter().map(|mut node| {
            for child in &mut node.children {
                child.0 += if child.is_leaf() { blocks } else { nodes };
            }
            node
        }));
        if self.blocks.len() - blocks as usize >= LARGE / BLOCK {
            release_free_blocks();
        }
        Child(nodes)
    }

    /// Collapses a binary tree, for which `add` adds a leaf. It receives the leaf's node, and the
    /// largest number of boxes on the traversal stack at the node above.
    fn collapse_with(
        mut self,
        binary: &BinaryBvh,
        mut add: impl FnMut(&mut Self, u32, usize) -> Child,
    ) -> Self {
        let (plans, _) = plans(binary);
        // The binary nodes to open, the index of the wide node of each, and the largest number of
        // boxes on the traversal stack at that node.
        let mut ahead = vec![(0u32, self.new_node(), WIDTH)];
        while let Some((from, to, stacked)) = ahead.pop() {
            self.stack_size = self.stack_size.max(stacked);
            let mut children = [0; WIDTH];
            let count = gather(binary, &plans, from, &mut children);
            for (i, &child) in children[..count].iter().enumerate() {
                let node = &binary.nodes[child as usize];
                let behind = if plans[child as usize].is_leaf() {
                    add(&mut self, child, stacked)
                } else {
                    let place = self.new_node();
                    ahead.push((child, place, stacked + WIDTH - 1));
                    Child(place)
                };
                let wide = &mut self.nodes[to as usize];
                for axis in 0..3 {
                    wide.planes[axis][i] = node.min[axis];
                    wide.planes[axis + 3][i] = node.max[axis];
                }
                wide.children[i] = behind;
            }
        }
        self
    }

    fn new_node(&mut self) -> u32 {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        self.nodes.push(WideNode {
            planes: [low, low, low, high, high, high],
            children: [Child::ROOT; WIDTH],
        });
        self.nodes.len() as u32 - 1
    }

    fn add_blocks(
        &mut self,
        primitives: &[u32],
        triangle: impl Fn(u32) -> Option<[Vec3; 3]>,
    ) -> Child {
        let first = self.blocks.len();
        for four in primitives.chunks(BLOCK) {
            let mut block = Block::EMPTY;
            for (lane, &primitive) in four.iter().enumerate() {
                block.primitives[lane] = primitive;
                match triangle(primitive) {
                    None => block.non_triangles |= 1 << lane,
                    Some(corners) => {
                        for (to, from) in block.corners.iter_mut().zip(corners) {
                            (0..3).for_each(|axis| to[axis][lane] = from[axis]);
                        }
                    }
                }
            }
            block.last = false;
            self.blocks.push(block);
        }
        if let Some(block) = self.blocks.last_mut() {
            block.last = true;
        }
        Child::leaf(first)
    }
}

/// How a binary node is collapsed: whether it becomes a leaf, and how it is opened.
///
/// A node's subtree may take `n` of the eight boxes of a wide node. For each `n`, three bits hold
/// one less than the number of boxes for its first child, or [`Plan::FEWER`] if `n` − 1 boxes cost
/// no more. The bits for `n` = 1 say how the node is opened as a wide node of its own.
#[derive(Clone, Copy)]
struct CollapsePlan(u32);

impl CollapsePlan {
    const LEAF: u32 = 1 << 31;
    /// The node is a leaf of the binary tree.
    const WHOLE: u32 = 1 << 30;
    const FEWER: u32 = 7;

    fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    fn is_whole(self) -> bool {
        self.0 & Self::WHOLE != 0
    }

    /// The three bits that are stored for a number of boxes.
    fn of(self, boxes: usize) -> u32 {
        self.0 >> (3 * (boxes - 1)) & 7
    }

    fn set(&mut self, boxes: usize, first: u32) {
        self.0 |= first << (3 * (boxes - 1));
    }
}

/// The expected cost of a subtree.
struct Cost {
    primitives: u32,
    /// The sum of tests times the surface area of the tested box. Entry `n` is the cost with at
    /// most `n` + 1 boxes.
    boxes: [f32; WIDTH],
}

/// Plans every binary node, and returns the plans and the root's cost. Testing the boxes of a node
/// and the triangles of a block are taken to cost the same, because they take about the same time.
fn plans(binary: &BinaryBvh) -> (Vec<CollapsePlan>, Cost) {
    let mut plans = vec![CollapsePlan(0); binary.nodes.len()];
    // In reverse, this order visits the first child, then the second, then the node.
    let mut order = Vec::with_capacity(binary.nodes.len());
    let mut ahead = vec![0];
    while let Some(at) = ahead.pop() {
        order.push(at);
        let node = &binary.nodes[at as usize];
        if node.count == 0 {
            ahead.extend([node.first, node.first + 1]);
        }
    }
    let mut costs: Vec<Cost> = Vec::new();
    for &at in order.iter().rev() {
        let (node, plan) = (&binary.nodes[at as usize], &mut plans[at as usize]);
        let d = node.max - node.min;
        let area = d.x * d.y + d.y * d.z + d.z * d.x;
        let cost = match (node.count, costs.pop()) {
            (0, Some(second)) => match costs.pop() {
                Some(first) => inner(area, &first, &second, plan),
                None => second,
            },
            (_, before) => {
                costs.extend(before);
                plan.0 = CollapsePlan::LEAF | CollapsePlan::WHOLE;
                Cost {
                    primitives: node.count,
                    boxes: [area * node.count.div_ceil(BLOCK as u32) as f32; WIDTH],
                }
            }
        };
        costs.push(cost);
    }
    let none = Cost {
        primitives: 0,
        boxes: [0.0; WIDTH],
    };
    (plans, costs.pop().unwrap_or(none))
}

/// Plans an inner node from the costs of its children, and returns its cost.
fn inner(area: f32, first: &Cost, second: &Cost, plan: &mut CollapsePlan) -> Cost {
    let primitives = first.primitives.saturating_add(second.primitives);
    let mut boxes = [0.0; WIDTH];
    let mut splits = [0; WIDTH];
    for n in 1..WIDTH {
        let mut best = (f32::INFINITY, 0);
        for k in 0..n {
            let cost = first.boxes[k] + second.boxes[n - 1 - k];
            if cost < best.0 {
                best = (cost, k as u32);
            }
        }
        (boxes[n], splits[n]) = best;
    }
    plan.set(1, splits[WIDTH - 1]);
    boxes[0] = area + boxes[WIDTH - 1];
    if primitives <= BLOCK as u32 {
        plan.0 = CollapsePlan::LEAF;
        boxes[0] = area;
    }
    for n in 1..WIDTH {
        if boxes[n - 1] <= boxes[n] {
            boxes[n] = boxes[n - 1];
            splits[n] = CollapsePlan::FEWER;
        }
        plan.set(n + 1, splits[n]);
    }
    Cost { primitives, boxes }
}

/// Finds the descendants, at most eight, that become the boxes of a wide node, and returns their
/// number.
fn gather(
    binary: &BinaryBvh,
    plans: &[CollapsePlan],
    from: u32,
    children: &mut [u32; WIDTH],
) -> usize {
    let plan = plans[from as usize];
    if plan.is_leaf() {
        children[0] = from;
        return 1;
    }
    let mut count = 0;
    let first = binary.nodes[from as usize].first;
    let k = plan.of(1) as usize + 1;
    let mut ahead = [(0, 0); WIDTH];
    ahead[..2].copy_from_slice(&[(first + 1, WIDTH - k), (first, k)]);
    let mut left = 2;
    while left > 0 {
        left -= 1;
        let (at, mut boxes) = ahead[left];
        let plan = plans[at as usize];
        while boxes > 1 && !plan.is_whole() && plan.of(boxes) == CollapsePlan::FEWER {
            boxes -= 1;
        }
        if boxes == 1 || plan.is_whole() {
            children[count] = at;
            count += 1;
            continue;
        }
        let first = binary.nodes[at as usize].first;
        let k = plan.of(boxes) as usize + 1;
        (ahead[left], ahead[left + 1]) = ((first + 1, boxes - k), (first, k));
        left += 2;
    }
    count
}

/// Appends the primitives under a node.
fn primitives(binary: &BinaryBvh, from: u32, held: &mut Vec<u32>) {
    let mut ahead = vec![from];
    while let Some(at) = ahead.pop() {
        let node = &binary.nodes[at as usize];
        if node.count > 0 {
            let slots = node.first as usize..(node.first + node.count) as usize;
            held.extend_from_slice(&binary.order[slots]);
        } else {
            ahead.extend([node.first + 1, node.first]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::build::Method;
    use crate::bvh::sah::Item;
    use ivcam_optics::sampling::mix;

    fn surface(min: Vec3, max: Vec3) -> f64 {
        let d = (max - min).as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The expected number of tests of a ray, times the surface area of the scene's box.
    fn cost(tree: &Bvh) -> f64 {
        let mut sum = 0.0;
        for (node, i) in tree
            .nodes
            .iter()
            .flat_map(|n| (0..WIDTH).map(move |i| (n, i)))
        {
            let corner =
                |from: usize| Vec3::from_array([0, 1, 2].map(|a| node.planes[from + a][i]));
            let (min, max) = (corner(0), corner(3));
            if min.cmple(max).all() {
                let blocks = &tree.blocks[node.children[i].place().min(tree.blocks.len())..];
                let tests = match node.children[i].is_leaf() {
                    true => 1 + blocks.iter().take_while(|b| !b.last).count(),
                    false => 1,
                };
                sum += surface(min, max) * tests as f64;
            }
        }
        sum
    }

    #[test]
    fn the_collapsed_tree_costs_what_was_planned() {
        let mut state = 3u64;
        let mut unit = move || {
            state = mix(state);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for count in [5, 9, 30, 200, 5000] {
            let boxes = (0..count).map(|_| {
                let at = Vec3::new(unit(), unit(), unit() * unit());
                (at, at + Vec3::new(unit(), unit(), unit()) * 0.1)
            });
            let mut items: Vec<Item> = boxes.zip(0..).map(|(of, i)| Item::new(of, i)).collect();
            let method = Method::of(&items, true);
            let binary = BinaryBvh::build(&mut items, &method);
            let tree = Bvh::collapse(&binary, |_| Some([Vec3::ZERO; 3]));
            let (_, root) = plans(&binary);
            let around = &binary.nodes[0];
            let planned = f64::from(root.boxes[0]) - surface(around.min, around.max);
            assert!((cost(&tree) / planned - 1.0).abs() < 1e-4, "{count}");
            let held: u32 = tree.blocks.iter().map(held).sum();
            assert_eq!(held, count);
        }
    }

    fn held(block: &Block) -> u32 {
        let corner = block.corners[0][0];
        corner.iter().filter(|x| !x.is_nan()).count() as u32
    }
}
