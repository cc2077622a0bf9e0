//! Nodes of eight boxes and leaves of four triangles, each tested at once.
//!
//! Collapsed from the binary tree that obvhs builds. Box and triangle tests are the ones of
//! `traverse`, operation by operation and never fused, so that a hit has the same bits with
//! whatever instructions the processor has. What is not a triangle keeps its place in a leaf and is
//! met by whoever knows what it is.

mod block;
mod collapse;
mod packet;
mod walk;

pub use block::{Block, Met};
pub use packet::{Others, PACKET, Packet, course};

/// Boxes in a node.
const WIDTH: usize = 8;

/// Eight boxes, plane by plane: smallest x, y, z, then largest. An empty one has its planes the
/// wrong way round and is never entered.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
struct Node {
    planes: [[f32; WIDTH]; 6],
    children: [Child; WIDTH],
}

/// What is behind a box: a node, or the first block of a leaf.
#[derive(Clone, Copy, Debug)]
struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const ROOT: Self = Self(0);

    fn leaf(block: usize) -> Self {
        Self(block as u32 | Self::LEAF)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    fn place(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub struct Wide {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// How many boxes a ray comes back to at most.
    waiting: usize,
}

/// Set bits, lowest first.
pub fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        at
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::sampling::mix;
    use crate::scene::traverse::Bvh;
    use crate::scene::traverse::tests::brute;
    use crate::scene::{PreparedRay, Ray};

    /// The nearest hit, by the instructions of the processor or without them.
    fn led(tree: &Wide, ray: &Ray, plain: bool) -> Option<f32> {
        let prepared = PreparedRay::new(ray);
        let mut nearest = None;
        let visit = |_: &Block, met: &Met, mut t_max: f32| {
            for lane in bits(met.mask) {
                if met.t[lane] < t_max {
                    t_max = met.t[lane];
                    nearest = Some(t_max);
                }
            }
            t_max
        };
        if plain {
            tree.walk_plain::<true>(Child::ROOT, &prepared, (0.0, f32::INFINITY), visit);
        } else {
            tree.walk(&prepared, 0.0, f32::INFINITY, visit);
        }
        nearest
    }

    /// Whether something is met, in whatever order.
    fn any(tree: &Wide, ray: &Ray) -> bool {
        let prepared = PreparedRay::new(ray);
        let mut met = false;
        tree.walk_any(&prepared, 0.0, f32::INFINITY, |_, of_block, t_max| {
            met |= of_block.mask != 0;
            if met { -1.0 } else { t_max }
        });
        met
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

    fn tree(triangles: &[[Vec3; 3]]) -> Wide {
        let boxes: Vec<(Vec3, Vec3)> = triangles
            .iter()
            .map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c)))
            .collect();
        let (binary, order) = Bvh::build(&boxes);
        Wide::collapse(&binary, &order, |p| Some(triangles[p as usize]))
    }

    /// 30,000 rays: along an axis or almost, −0.0 and tiny components included; from a point on
    /// one triangle to another; and from within a hundred-thousandth of what they hit.
    #[test]
    fn no_hit_is_lost_that_trying_every_triangle_finds() {
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
            assert_eq!(expected, led(&tree, &ray, false), "ray {i}: {ray:?}");
            assert_eq!(expected, led(&tree, &ray, true), "ray {i}, plain: {ray:?}");
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
    fn an_empty_tree_and_one_of_one_triangle_are_trees() {
        let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        assert_eq!(led(&tree(&[]), &ray, false), None);
        assert_eq!(
            led(&tree(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]), &ray, false),
            Some(1.0)
        );
    }
}
