//! How many primitives a ray has to test in a tree at most, as far as can be expected.

use glam::Vec3;

use super::block::{BLOCK, Block};
use super::nodes::{Bvh, Child, WIDTH, WideNode};

/// The number of primitives that a ray is expected to test from which a tree is crowded. A ray may
/// test thousands before it is cut; those through forests of 160,000 groves test hundreds.
const CROWDED: f64 = 1024.0;

impl Bvh {
    /// Finds out whether many primitives are at one place. A ray then visits all blocks that it
    /// tests, so that the visitor can count them and end the walk.
    pub(crate) fn measure_crowding(mut self) -> Self {
        self.is_crowded = self.crowding() > CROWDED;
        if self.is_crowded {
            let blocks = self.blocks.iter_mut();
            blocks.for_each(|block| block.non_triangles |= Block::ALWAYS_VISITED);
        }
        self
    }

    /// Whether many primitives are at one place.
    pub(crate) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// Returns the number of primitives that a random ray through a box of the tree is expected to
    /// test inside, for the box for which it is largest. It is in the hundreds at most where
    /// primitives lie beside each other, and grows with their number where they are at one place.
    ///
    /// A random line that meets a convex body meets a convex part of it with the probability of the
    /// ratio of their surface areas.
    fn crowding(&self) -> f64 {
        let mut expected = vec![0.0f64; self.nodes.len()];
        let mut most: f64 = 0.0;
        // The children of a node are behind it.
        for (number, node) in self.nodes.iter().enumerate().rev() {
            let tests = |child: Child| match child.is_leaf() {
                true => self.primitives_of_leaf(child) as f64,
                false => expected[child.place()],
            };
            expected[number] = node.expected(tests);
            most = most.max(expected[number]);
        }
        most
    }

    /// Returns the number of lanes of a leaf's blocks.
    fn primitives_of_leaf(&self, leaf: Child) -> usize {
        let blocks = &self.blocks[leaf.place()..];
        let others = blocks.iter().take_while(|block| !block.last);
        BLOCK * (1 + others.count())
    }
}

impl WideNode {
    /// Returns the mean over random rays through the node of a number that each child adds.
    fn expected(&self, tests: impl Fn(Child) -> f64) -> f64 {
        let corner = |i: usize, first: usize| {
            Vec3::from_array([first, first + 1, first + 2].map(|plane| self.planes[plane][i]))
        };
        let boxes = || {
            let all = (0..WIDTH).map(|i| (i, corner(i, 0), corner(i, 3)));
            all.filter(|(_, low, high)| low.x <= high.x)
        };
        let around = boxes()
            .map(|(_, low, high)| (low, high))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let whole = around.map_or(0.0, |(low, high)| area(low, high));
        let share = |low, high| match whole > 0.0 {
            true => (area(low, high) / whole).min(1.0),
            false => 1.0,
        };
        let parts = boxes().map(|(i, low, high)| share(low, high) * tests(self.children[i]));
        parts.sum()
    }
}

/// Returns half of the surface area of a box.
fn area(low: Vec3, high: Vec3) -> f64 {
    let d = high.as_dvec3() - low.as_dvec3();
    d.x * d.y + d.y * d.z + d.z * d.x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crowding(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> f64 {
        Bvh::build(boxes, true, |_| None).crowding()
    }

    #[test]
    fn boxes_at_one_place_are_all_expected_and_those_of_a_grid_are_not() {
        let unit = |at: Vec3| (at, at + 1.0);
        let one_place = (0..5000).map(|_| unit(Vec3::ZERO));
        assert!(crowding(one_place) >= 5000.0);
        let row = |i: i32| unit(Vec3::new(0.001 * i as f32, 0.0, 0.0));
        assert!(crowding((0..5000).map(row)) > 500.0);
        let place = |i: i32| Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32);
        let grid = crowding((0..8000).map(|i| unit(place(i))));
        assert!((20.0..200.0).contains(&grid), "{grid}");
        assert_eq!(crowding(std::iter::empty()), 0.0);
    }
}
