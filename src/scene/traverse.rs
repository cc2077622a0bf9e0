//! A ray, its meeting with a triangle, and the binary tree that `wide` collapses.
//!
//! obvhs builds (PLOC); the walk is our own, because of three measured faults: a direction
//! component of −0.0, an inverse clamped at f32 epsilon, and a smallest distance built into its
//! wide nodes. The inverse is made here, in one place: `+0.0` first, then clamped at 2^64.
//! Nothing here knows what the primitives are; the nodes a ray is led through are in `wide`.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

mod parts;

use parts::Item;

/// A ray in the scene's space: meters, the compile origin at zero.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    /// Need not be of length 1; distances are in its lengths.
    pub direction: Vec3,
    /// Hits nearer than this do not count.
    pub t_min: f32,
    pub t_max: f32,
    /// Up to here lies the plane of what the ray went through last, and of that plane it was what
    /// was drawn `passed` or later (`RenderScene::past`).
    pub(super) plane_end: f32,
    pub(super) passed: u64,
}

impl Ray {
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
            plane_end: f32::NEG_INFINITY,
            passed: 0,
        }
    }

    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

const LARGEST_INVERSE: f32 = 18_446_744_073_709_551_616.0; // 2^64

/// What a box test and a triangle test need of a ray, worked out once.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    pub origin: Vec3,
    pub direction: Vec3,
    pub(super) inverse: Vec3,
    /// The axis along which the direction is longest, and the two others, right-handed.
    pub(super) axes: [usize; 3],
    pub(super) shear: Vec3,
}

impl PreparedRay {
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction + Vec3::ZERO; // turns −0.0 into +0.0
        let inverse = Vec3::new(invert(d.x), invert(d.y), invert(d.z));
        let a = d.abs();
        let z = if a.x > a.y && a.x > a.z {
            0
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        Self {
            origin: ray.origin,
            direction: d,
            inverse,
            axes: [x, y, z],
            shear: Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        }
    }

    /// Where the ray meets a triangle: distance and the weights of its second and third corner.
    ///
    /// Woop, Benthin and Wald's test: the edge signs are the same for two triangles that share an
    /// edge, so no ray slips between them; an edge value of exactly 0 is decided in f64.
    pub fn triangle(&self, corners: &[Vec3; 3], t_min: f32, t_max: f32) -> Option<(f32, f32, f32)> {
        let [kx, ky, kz] = self.axes;
        let (a, b, c) = (
            corners[0] - self.origin,
            corners[1] - self.origin,
            corners[2] - self.origin,
        );
        let s = self.shear;
        let (ax, ay) = (a[kx] - s.x * a[kz], a[ky] - s.y * a[kz]);
        let (bx, by) = (b[kx] - s.x * b[kz], b[ky] - s.y * b[kz]);
        let (cx, cy) = (c[kx] - s.x * c[kz], c[ky] - s.y * c[kz]);
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        let beside = |u: f32, v: f32, w: f32| {
            (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)
        };
        // Signs other than 0 are right: rounding keeps the order of the two products.
        if beside(u, v, w) {
            return None;
        }
        if u == 0.0 || v == 0.0 || w == 0.0 {
            let wide = |p: f32, q: f32, r: f32, t: f32| {
                (f64::from(p) * f64::from(q) - f64::from(r) * f64::from(t)) as f32
            };
            u = wide(cx, by, cy, bx);
            v = wide(ax, cy, ay, cx);
            w = wide(bx, ay, by, ax);
            if beside(u, v, w) {
                return None;
            }
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = (u * a[kz] + v * b[kz] + w * c[kz]) * s.z / det;
        (t > t_min && t < t_max).then(|| (t, v / det, w / det))
    }
}

#[inline(always)]
pub(super) fn invert(component: f32) -> f32 {
    let inverse = 1.0 / component;
    if component.abs() <= 1.0 / LARGEST_INVERSE {
        LARGEST_INVERSE.copysign(component)
    } else {
        inverse
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct BvhNode {
    pub min: Vec3,
    /// The first child, or the first slot of a leaf.
    pub first: u32,
    pub max: Vec3,
    /// Primitives in a leaf; 0 in an inner node.
    pub count: u32,
}

impl BvhNode {
    const NONE: Self = Self {
        min: Vec3::ZERO,
        first: 0,
        max: Vec3::ZERO,
        count: 0,
    };
}

/// Boxes around primitives, two in each.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    pub(super) nodes: Vec<BvhNode>,
}

/// More boxes than this are parted before obvhs gets them.
const PART: usize = 64;

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        let (min, max) = self.around();
        Aabb::new(Vec3A::from(min), Vec3A::from(max))
    }
}

impl Bvh {
    /// Builds over boxes; also gives the order in which leaves hold the primitives.
    pub fn build(boxes: &[(Vec3, Vec3)]) -> (Self, Vec<u32>) {
        if boxes.is_empty() {
            return (Self::default(), Vec::new());
        }
        let item = |(i, around): (usize, &(Vec3, Vec3))| Item::new(*around, i as u32);
        let mut items: Vec<Item> = boxes.iter().enumerate().map(item).collect();
        let above = parts::part(&mut items, PART);
        let params = BvhBuildParams {
            reinsertion_batch_ratio: 0.0,
            ..BvhBuildParams::fast_build()
        };
        let mut tree = Grafted {
            nodes: Vec::with_capacity(2 * items.len()),
            order: Vec::with_capacity(boxes.len()),
            pad: padding(boxes),
        };
        tree.nodes.resize(above.len(), BvhNode::NONE);
        for (at, node) in above.iter().enumerate() {
            match node {
                parts::Above::Inner { first, around } => {
                    tree.nodes[at] = tree.node(*around, *first as u32, 0);
                }
                parts::Above::Part(range) => {
                    let items = &items[range.clone()];
                    match items.len() {
                        ..=PART => tree.graft(at, items, params),
                        _ => tree.nodes[at] = tree.leaf(items),
                    }
                }
            }
        }
        (Self { nodes: tree.nodes }, tree.order)
    }
}

/// The tree of several trees.
struct Grafted {
    nodes: Vec<BvhNode>,
    order: Vec<u32>,
    pad: Vec3,
}

impl Grafted {
    fn node(&self, (min, max): (Vec3, Vec3), first: u32, count: u32) -> BvhNode {
        BvhNode {
            min: (min - self.pad).map(f32::next_down),
            first,
            max: (max + self.pad).map(f32::next_up),
            count,
        }
    }

    /// Of items in one box.
    fn leaf(&mut self, items: &[Item]) -> BvhNode {
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
pub mod tests {
    use super::*;

    /// The nearest hit by asking every triangle.
    pub fn brute(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<f32> {
        let prepared = PreparedRay::new(ray);
        triangles
            .iter()
            .filter_map(|c| prepared.triangle(c, 0.0, f32::INFINITY).map(|h| h.0))
            .min_by(f32::total_cmp)
    }

    /// Every box in a leaf of its own place, every leaf in the boxes above it.
    fn check(boxes: &[(Vec3, Vec3)]) {
        let (tree, order) = Bvh::build(boxes);
        let mut held = vec![false; boxes.len()];
        let mut ahead = vec![(0, Vec3::NEG_INFINITY, Vec3::INFINITY)];
        while let Some((at, min, max)) = ahead.pop() {
            let node: &BvhNode = &tree.nodes[at as usize];
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

    #[test]
    fn no_ray_slips_through_the_edge_of_two_triangles() {
        let a = [Vec3::ZERO, Vec3::X, Vec3::ONE];
        let b = [Vec3::ZERO, Vec3::ONE, Vec3::Y];
        for i in 1..10_000 {
            let s = i as f32 / 10_000.0;
            let ray = Ray::new(
                Vec3::new(0.3, 0.2, -7.0),
                Vec3::splat(s) - Vec3::new(0.3, 0.2, -7.0),
            );
            assert!(brute(&[a, b], &ray).is_some(), "slipped at {s}");
        }
    }
}
