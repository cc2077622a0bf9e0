//! The tree: nodes of eight boxes, and leaves of blocks of four primitives.

use super::block::Block;

/// Boxes in a node.
pub(super) const WIDTH: usize = 8;

/// Eight boxes and what is in them.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct WideNode {
    /// The smallest x, y and z of every box, then the largest. An empty box has a smallest
    /// coordinate that is greater than the largest one, so no ray enters it.
    pub planes: [[f32; WIDTH]; 6],
    /// What is in each box.
    pub children: [Child; WIDTH],
}

/// What is in a box: the index of a node, or that of a leaf's first block with [`Child::LEAF`] set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Child(pub u32);

impl Child {
    pub(super) const LEAF: u32 = 1 << 31;
    pub(super) const ROOT: Self = Self(0);

    pub(super) fn leaf(block: usize) -> Self {
        Self(block as u32 | Self::LEAF)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub(super) fn place(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// A tree of boxes around primitives.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    pub(super) nodes: Vec<WideNode>,
    pub(super) blocks: Vec<Block>,
    /// The largest number of boxes that can be on a traversal stack at once.
    pub(super) stack_size: usize,
    /// Whether many primitives are at one place.
    pub(super) is_crowded: bool,
}

impl Bvh {
    /// The memory in bytes that building a tree takes at most, for each primitive, which it does in
    /// one chunk: two binary nodes with their plans, its place in their order, and its part of
    /// blocks and wide nodes.
    pub(crate) const BYTES_OF_PRIMITIVE: u64 = 140;

    /// The memory of nodes and blocks, in bytes.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(&self.nodes[..]) + std::mem::size_of_val(&self.blocks[..])
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh::block::BlockHits;
    use crate::bvh::ray::Ray;
    use crate::bvh::triangle::{PreparedRay, tests::brute};
    use ivcam_base::math::lanes::bits;
    use ivcam_optics::sampling::mix;

    /// The nearest hit, computed without vector instructions if `plain`.
    fn nearest(tree: &Bvh, ray: &Ray, plain: bool) -> Option<f32> {
        let prepared = PreparedRay::new(ray);
        let mut found = None;
        let visit = |_: &Block, hits: &BlockHits, mut t_max: f32| {
            for lane in bits(hits.mask) {
                if hits.t[lane] < t_max {
                    t_max = hits.t[lane];
                    found = Some(t_max);
                }
            }
            t_max
        };
        if plain {
            let ray = (&prepared, Vec3::ZERO);
            tree.walk_plain::<true>(Child::ROOT, ray, (0.0, f32::INFINITY), visit);
        } else {
            tree.walk(&prepared, 0.0, f32::INFINITY, visit);
        }
        found
    }

    /// Whether anything is hit.
    fn any(tree: &Bvh, ray: &Ray) -> bool {
        let prepared = PreparedRay::new(ray);
        let mut found = false;
        tree.walk_any(&prepared, 0.0, f32::INFINITY, |_, hits, t_max| {
            found |= hits.mask != 0;
            if found { -1.0 } else { t_max }
        });
        found
    }

    /// Thin triangles near and far, small and large.
    fn triangles(mut unit: impl FnMut() -> f32) -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for i in 0..2000 {
            let far = if i % 3 == 0 { 1e3 } else { 1.0 };
            let at = Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5) * 2.0 * far;
            let size = if i % 2 == 0 { 0.3 } else { 1e-4 };
            let mut edge = || Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5) * size;
            triangles.push([at, at + edge(), at + edge()]);
        }
        triangles
    }

    fn tree(triangles: &[[Vec3; 3]]) -> Bvh {
        let boxes = triangles
            .iter()
            .map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c)));
        Bvh::build(boxes, true, |p| Some(triangles[p as usize]))
    }

    /// Traces 30,000 rays: along or nearly along an axis, with −0.0 and tiny components; from a
    /// point on one triangle to another; and from 1e-5 in front of the triangle that they hit.
    #[test]
    fn the_tree_finds_every_hit_that_testing_all_triangles_finds() {
        let mut state = 7u64;
        let mut unit = move || {
            state = mix(state);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let triangles = triangles(&mut unit);
        let tree = tree(&triangles);
        let tiny = [0.0f32, -0.0, 1e-9, -1e-9, 1e-30, -1e-38, 1e-6];
        let mut hits = 0;
        for i in 0..30_000usize {
            let [a, b, c] = triangles[i % triangles.len()];
            let inside = (a + b + c) / 3.0;
            let ray = match i / 10_000 {
                0 | 1 => {
                    let (axis, sign) = (i % 3, if i % 2 == 0 { 1.0 } else { -1.0 });
                    let mut direction = Vec3::ZERO;
                    direction[axis] = sign;
                    direction[(axis + 1) % 3] = tiny[i % tiny.len()];
                    direction[(axis + 2) % 3] = tiny[(i / 7) % tiny.len()];
                    let mut origin = inside;
                    origin[axis] -= sign * if i < 10_000 { 3.0 } else { 1e-5 };
                    Ray::new(origin, direction)
                }
                _ => {
                    let [d, ..] = triangles[(i * 7 + 1) % triangles.len()];
                    Ray::new(d, (inside - d) * (1.0 + unit()))
                }
            };
            let expected = brute(&triangles, &ray);
            assert_eq!(expected, nearest(&tree, &ray, false), "ray {i}: {ray:?}");
            assert_eq!(
                expected,
                nearest(&tree, &ray, true),
                "ray {i}, plain: {ray:?}"
            );
            assert_eq!(
                expected.is_some(),
                any(&tree, &ray),
                "ray {i}, any: {ray:?}"
            );
            hits += usize::from(expected.is_some());
        }
        assert!(hits > 20_000, "only {hits} hits: the test tests little");
    }

    #[test]
    fn trees_of_no_and_of_one_triangle_can_be_traced() {
        let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        assert_eq!(nearest(&tree(&[]), &ray, false), None);
        assert_eq!(
            nearest(&tree(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]), &ray, false),
            Some(1.0)
        );
    }
}
