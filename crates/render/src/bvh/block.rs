//! Blocks of four primitives, and the hits of a ray on their triangles.
//!
//! The test does the operations of [`PreparedRay::triangle`] in the same order and never uses fused
//! multiply-add, so a hit has the same bits whatever instructions the processor has.

use glam::{Vec3, Vec4};

use super::triangle::PreparedRay;

/// Primitives in a block.
pub(super) const BLOCK: usize = 4;

/// Four primitives of a leaf.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub struct Block {
    /// Coordinates by corner, axis and lane. A lane without a triangle has NaN, which no ray hits.
    pub(super) corners: [[[f32; BLOCK]; 3]; 3],
    pub(super) primitives: [u32; BLOCK],
    /// A bit mask of the lanes that hold primitives other than triangles, with
    /// [`Block::ALWAYS_VISITED`] in a crowded tree.
    pub(super) non_triangles: u32,
    /// Whether this is the last block of its leaf.
    pub(super) last: bool,
}

impl Block {
    /// The bit of a block that a ray visits even if it hits no triangle, so that the visits can be
    /// counted.
    pub(super) const ALWAYS_VISITED: u32 = 1 << 31;

    pub(super) const EMPTY: Self = Self {
        corners: [[[f32::NAN; BLOCK]; 3]; 3],
        primitives: [0; BLOCK],
        non_triangles: 0,
        last: true,
    };

    /// The number of the primitive in a lane.
    pub fn primitive(&self, lane: usize) -> u32 {
        self.primitives[lane]
    }

    /// A bit mask of the lanes that hold primitives other than triangles.
    pub(crate) fn non_triangles(&self) -> u32 {
        self.non_triangles & !Self::ALWAYS_VISITED
    }

    pub(super) fn triangle(&self, lane: usize) -> [Vec3; 3] {
        self.corners
            .map(|c| Vec3::new(c[0][lane], c[1][lane], c[2][lane]))
    }
}

/// The triangles of a block that a ray hits, and where.
pub struct BlockHits {
    /// A bit mask of the triangles that are hit. Other lanes of `t`, `u` and `v` are undefined.
    pub mask: u32,
    /// The distances along the ray, as multiples of its direction's length.
    pub t: [f32; BLOCK],
    /// The weights of the triangles' second corners.
    pub u: [f32; BLOCK],
    /// The weights of the triangles' third corners.
    pub v: [f32; BLOCK],
}

impl BlockHits {
    const NONE: Self = Self {
        mask: 0,
        t: [0.0; BLOCK],
        u: [0.0; BLOCK],
        v: [0.0; BLOCK],
    };
}

/// The part of a block's triangle tests that depends only on the ray, repeated in four lanes.
pub(crate) struct BlockTest {
    /// The ray's axes, which are the rows of a block's corners.
    rows: [usize; 3],
    /// The ray's origin along those axes.
    origin: [Vec4; 3],
    shear: [Vec4; 3],
    t_min: Vec4,
}

impl BlockTest {
    /// Prepares tests of a ray for hits beyond `t_min`.
    #[inline(always)]
    pub(crate) fn new(ray: &PreparedRay, t_min: f32) -> Self {
        let rows = ray.axes.map(|axis| axis.min(2));
        Self {
            rows,
            origin: rows.map(|axis| Vec4::splat(ray.origin[axis])),
            shear: ray.shear.to_array().map(Vec4::splat),
            t_min: Vec4::splat(t_min),
        }
    }

    /// Intersects the ray with the four triangles by the operations of
    /// [`PreparedRay::triangle`], in the same order.
    #[inline(always)]
    pub(crate) fn intersect(&self, block: &Block, t_max: f32) -> BlockHits {
        let [x, y, z] = self.rows;
        let [sx, sy, sz] = self.shear;
        let mut hits = BlockHits::NONE;
        let from_ray = |corner: usize, row: usize, origin: Vec4| {
            Vec4::from_array(block.corners[corner][row]) - origin
        };
        let sheared = |corner: usize| {
            let z = from_ray(corner, z, self.origin[2]);
            let x = from_ray(corner, x, self.origin[0]) - sx * z;
            let y = from_ray(corner, y, self.origin[1]) - sy * z;
            (x, y, z)
        };
        let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(0), sheared(1), sheared(2));
        let cross = |px, qy, py, qx| px * qy - py * qx;
        let mut u = cross(cx, by, cy, bx);
        let mut v = cross(ax, cy, ay, cx);
        let mut w = cross(bx, ay, by, ax);
        let mut mask = !outside(u, v, w) & 15;
        if mask == 0 {
            return hits;
        }
        let zero = Vec4::splat(0.0);
        let exact = u.cmpeq(zero) | v.cmpeq(zero) | w.cmpeq(zero);
        if exact.bitmask() & mask != 0 {
            u = Vec4::select(exact, cross_in_f64(cx, by, cy, bx), u);
            v = Vec4::select(exact, cross_in_f64(ax, cy, ay, cx), v);
            w = Vec4::select(exact, cross_in_f64(bx, ay, by, ax), w);
            let beside = |edge: Vec4, (px, py): (Vec4, Vec4), (qx, qy): (Vec4, Vec4)| {
                let [first, second] = [py - qy, qx - px];
                let change = Vec4::select(first.cmpeq(zero), second, first);
                Vec4::select(edge.cmpeq(zero), change, edge)
            };
            let (a, b, c) = ((ax, ay), (bx, by), (cx, cy));
            mask &= !outside(beside(u, c, b), beside(v, a, c), beside(w, b, a));
        }
        let det = u + v + w;
        let sum = u * az + v * bz + w * cz;
        let t = sum * sz / det;
        let near = self.t_min.cmplt(t);
        let far = t.cmplt(Vec4::splat(t_max));
        hits.mask = (near & far & det.cmpne(zero)).bitmask() & mask;
        if hits.mask != 0 {
            hits.t = t.to_array();
            hits.u = (v / det).to_array();
            hits.v = (w / det).to_array();
        }
        hits
    }
}

/// A bit mask of the triangles that the ray misses: those with edge values of both signs.
#[inline(always)]
fn outside(u: Vec4, v: Vec4, w: Vec4) -> u32 {
    let zero = Vec4::splat(0.0);
    let least = u.min(v).min(w);
    let most = u.max(v).max(w);
    (least.cmplt(zero) & zero.cmplt(most)).bitmask()
}

/// Returns `px qy − py qx`, with the products and their difference in f64.
#[inline]
fn cross_in_f64(px: Vec4, qy: Vec4, py: Vec4, qx: Vec4) -> Vec4 {
    let [px, qy, py, qx] = [px, qy, py, qx].map(|v| v.as_dvec4());
    (px * qy - py * qx).as_vec4()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::ray::Ray;
    use ivcam_optics::sampling::mix;

    /// Corners and rays are on a coarse grid, so rays hit edges, corners and planes exactly, and
    /// some triangles degenerate to lines or points.
    #[test]
    fn a_block_test_gives_the_same_hits_as_single_triangle_tests() {
        let mut state = 5u64;
        let mut grid = |fine: bool| {
            let mut whole = || {
                state = mix(state);
                let step = (state >> 60) as f32 - 8.0;
                if fine { step * 0.1 } else { step }
            };
            Vec3::new(whole(), whole(), whole())
        };
        let (mut hits, mut exact) = (0, 0);
        for i in 0..200_000 {
            let mut block = Block::EMPTY;
            let triangles: [[Vec3; 3]; BLOCK] =
                std::array::from_fn(|_| std::array::from_fn(|_| grid(i % 2 == 0)));
            for (lane, triangle) in triangles.iter().enumerate() {
                for (corner, at) in triangle.iter().enumerate() {
                    (0..3).for_each(|axis| block.corners[corner][axis][lane] = at[axis]);
                }
            }
            let ray = PreparedRay::new(&Ray::new(grid(i % 4 < 2), grid(false)));
            let t_max = if i % 3 == 0 { 1.5 } else { f32::INFINITY };
            let all = BlockTest::new(&ray, 0.0).intersect(&block, t_max);
            for (lane, triangle) in triangles.iter().enumerate() {
                let expected = ray.triangle(triangle, 0.0, t_max);
                let found =
                    (all.mask >> lane & 1 == 1).then(|| (all.t[lane], all.u[lane], all.v[lane]));
                let bits = |hit: (f32, f32, f32)| [hit.0, hit.1, hit.2].map(f32::to_bits);
                assert_eq!(expected.map(bits), found.map(bits), "{triangle:?}, {ray:?}");
                hits += usize::from(found.is_some());
                exact += usize::from(found.is_some_and(|(_, u, v)| u * v * (1.0 - u - v) == 0.0));
            }
            assert_eq!(all.mask >> BLOCK, 0);
        }
        assert!(hits > 30_000 && exact > 200, "{hits} hits, {exact} exact");
    }
}
