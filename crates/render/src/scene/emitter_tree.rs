//! A binary tree over the luminous primitives of a scene.
//!
//! The primitives are in the order of the leaves, and every node halves its range of them. So a
//! node is known by its range, and the tree needs no links. Nodes are stored depth first.

use std::ops::Range;

use glam::Vec3;

/// A luminous primitive that is to become a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeItem {
    /// The number and the place of the primitive.
    pub primitive: (u32, u64),
    /// The number of its flat shape; `u32::MAX` for others.
    pub face: u32,
    pub low: Vec3,
    pub high: Vec3,
    /// The area in square meters.
    pub area: f32,
    /// The area times the brightness.
    pub power: f32,
}

/// What a node knows of its primitives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LampNode {
    /// The corners of the box around them.
    pub low: Vec3,
    pub high: Vec3,
    /// The sum of their areas, in square meters.
    pub area: f32,
    /// The sum of their areas times their brightness.
    pub power: f32,
}

impl LampNode {
    /// The center and the radius of a sphere around the box.
    pub(crate) fn sphere(&self) -> (Vec3, f32) {
        let half = 0.5 * (self.high - self.low);
        (self.low + half, half.length())
    }

    fn around(a: &Self, b: &Self) -> Self {
        Self {
            low: a.low.min(b.low),
            high: a.high.max(b.high),
            area: a.area + b.area,
            power: a.power + b.power,
        }
    }
}

/// A node of the tree, by its range of leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LampRange {
    /// The number of the node.
    node: u32,
    first: u32,
    end: u32,
}

impl LampRange {
    /// The numbers of the leaves.
    pub(crate) fn leaves(self) -> Range<u32> {
        self.first..self.end
    }

    /// The number of the leaves.
    fn len(self) -> u32 {
        self.end - self.first
    }

    /// The two halves; `None` for a leaf.
    #[inline]
    pub(crate) fn halves(self) -> Option<[Self; 2]> {
        let count = (self.end - self.first) / 2;
        let middle = self.first + count;
        (count > 0).then_some([
            Self {
                node: self.node + 1,
                end: middle,
                ..self
            },
            Self {
                node: self.node + 2 * count,
                first: middle,
                ..self
            },
        ])
    }
}

/// A binary tree over luminous primitives.
#[derive(Debug, Default)]
pub(crate) struct LampTree {
    nodes: Vec<LampNode>,
}

impl LampTree {
    /// Builds the tree and puts the items in the order of its leaves.
    pub(super) fn build(items: &mut [TreeItem]) -> Self {
        let mut nodes = vec![LampNode::default(); (2 * items.len()).saturating_sub(1)];
        if !items.is_empty() {
            fill(items, &mut nodes);
        }
        Self { nodes }
    }

    /// The range of all leaves; `None` if there are none.
    pub(crate) fn root(&self) -> Option<LampRange> {
        (!self.nodes.is_empty()).then_some(LampRange {
            node: 0,
            first: 0,
            end: self.nodes.len().div_ceil(2) as u32,
        })
    }

    /// The node of a range.
    #[inline]
    pub(crate) fn node(&self, range: LampRange) -> &LampNode {
        &self.nodes[range.node as usize]
    }

    /// Chooses a part of a range with at most `most` leaves. Of two halves, one is chosen in
    /// proportion to its weight, by a number from 0 to 1 that serves at all levels. Returns the
    /// part, its probability, and the rest of the number, from 0 to 1 again; `None` if both weights
    /// are 0 somewhere on the way.
    pub(crate) fn choose(
        &self,
        mut range: LampRange,
        most: u32,
        u: f64,
        weight: impl Fn(&LampNode) -> f32,
    ) -> Option<(LampRange, f32, f64)> {
        let (mut rest, mut probability) = (u, 1.0f32);
        while let Some([a, b]) = range.halves().filter(|_| range.len() > most) {
            let [wa, wb] = [a, b].map(|half| weight(self.node(half)));
            let share = wa / (wa + wb);
            if !(share >= 0.0) {
                return None;
            }
            let edge = f64::from(share);
            (range, rest, probability) = match rest < edge {
                true => (a, rest / edge, probability * share),
                false => (b, (rest - edge) / (1.0 - edge), probability * (1.0 - share)),
            };
        }
        (probability > 0.0).then_some((range, probability, rest))
    }

    /// The part of a range with at most `most` leaves that contains a leaf, and the probability
    /// with which [`LampTree::choose`] returns it.
    pub(crate) fn probability(
        &self,
        mut range: LampRange,
        most: u32,
        leaf: u32,
        weight: impl Fn(&LampNode) -> f32,
    ) -> (LampRange, f32) {
        let mut probability = 1.0f32;
        while let Some([a, b]) = range.halves().filter(|_| range.len() > most) {
            let [wa, wb] = [a, b].map(|half| weight(self.node(half)));
            let share = wa / (wa + wb);
            if !(share >= 0.0) {
                return (range, 0.0);
            }
            (range, probability) = match leaf < b.first {
                true => (a, probability * share),
                false => (b, probability * (1.0 - share)),
            };
        }
        (range, probability)
    }
}

/// Fills the nodes of some items, of which there is at least one: the box is cut across its longest
/// side, so that both halves have as many centers.
fn fill(items: &mut [TreeItem], nodes: &mut [LampNode]) {
    if let [item] = items {
        nodes[0] = LampNode {
            low: item.low,
            high: item.high,
            area: item.area,
            power: item.power,
        };
        return;
    }
    let center = |item: &TreeItem| item.low + item.high;
    let all = items.iter().map(center);
    let low = all.clone().fold(Vec3::INFINITY, Vec3::min);
    let high = all.fold(Vec3::NEG_INFINITY, Vec3::max);
    let axis = (high - low).max_position();
    let count = items.len() / 2;
    items.select_nth_unstable_by(count, |a, b| center(a)[axis].total_cmp(&center(b)[axis]));
    let (left, right) = items.split_at_mut(count);
    let (head, rest) = nodes.split_at_mut(1);
    let (left_nodes, right_nodes) = rest.split_at_mut(2 * count - 1);
    fill(left, left_nodes);
    fill(right, right_nodes);
    head[0] = LampNode::around(&left_nodes[0], &right_nodes[0]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(count: u16) -> Vec<TreeItem> {
        let item = |i: u16| {
            let turn = f32::from(i) * 2.4;
            let low = Vec3::new(libm::cosf(turn), libm::sinf(3.0 * turn), f32::from(i % 7));
            TreeItem {
                primitive: (u32::from(i), 0),
                face: u32::MAX,
                low,
                high: low + 0.1,
                area: 1.0,
                power: f32::from(1 + i % 5),
            }
        };
        (0..count).map(item).collect()
    }

    /// The probabilities of all leaves add up to 1, and evenly spread numbers find each leaf as
    /// often as its probability says.
    #[test]
    fn a_leaf_is_chosen_with_its_probability() {
        for count in [1, 2, 3, 7, 100] {
            let mut items = items(count);
            let tree = LampTree::build(&mut items);
            let root = tree.root().unwrap();
            let far = Vec3::new(3.0, 0.0, 2.0);
            let weight = |node: &LampNode| node.power / (node.sphere().0 - far).length_squared();
            let mut counts = vec![0.0; usize::from(count)];
            let n = 200_000;
            for i in 0..n {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                let (leaf, p, rest) = tree.choose(root, 1, u, weight).unwrap();
                let leaf = leaf.first;
                assert!((0.0..=1.0).contains(&rest));
                assert_eq!(p, tree.probability(root, 1, leaf, weight).1);
                counts[leaf as usize] += 1.0 / f64::from(n);
            }
            let mut sum = 0.0;
            for (leaf, share) in counts.iter().enumerate() {
                let p = f64::from(tree.probability(root, 1, leaf as u32, weight).1);
                assert!((share - p).abs() < 2e-4, "{leaf} of {count}: {share} {p}");
                sum += p;
            }
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        }
    }

    #[test]
    fn a_node_holds_the_sums_and_the_box_of_its_leaves() {
        let mut items = items(37);
        let tree = LampTree::build(&mut items);
        let mut open = vec![tree.root().unwrap()];
        let mut leaves = 0;
        while let Some(range) = open.pop() {
            let own = &items[range.first as usize..range.end as usize];
            let node = tree.node(range);
            let power: f32 = own.iter().map(|i| i.power).sum();
            assert!((node.power / power - 1.0).abs() < 1e-5);
            let low = own.iter().fold(Vec3::INFINITY, |a, i| a.min(i.low));
            assert_eq!(node.low, low);
            leaves += u32::from(own.len() == 1);
            open.extend(range.halves().into_iter().flatten());
        }
        assert_eq!(leaves, 37);
        assert!(LampTree::build(&mut []).root().is_none());
    }
}
