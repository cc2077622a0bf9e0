//! Blocks of four primitives, and the hits of a ray on their triangles.
//!
//! The test does the operations of [`PreparedRay::triangle`] in the same order and never uses fused
//! multiply-add, so a hit has the same bits whatever instructions the processor has.

use glam::Vec3;

use super::triangle::PreparedRay;

/// Primitives in a block.
pub(super) const BLOCK: usize = 4;

/// Four primitives of a leaf.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub(crate) struct Block {
    /// Coordinates by corner, axis and lane. A lane without a triangle has NaN, which no ray hits.
    pub(super) corners: [[[f32; BLOCK]; 3]; 3],
    pub(super) primitives: [u32; BLOCK],
    /// A bit mask of the lanes that hold primitives other than triangles.
    pub(super) non_triangles: u32,
    /// Whether this is the last block of its leaf.
    pub(super) last: bool,
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        corners: [[[f32::NAN; BLOCK]; 3]; 3],
        primitives: [0; BLOCK],
        non_triangles: 0,
        last: true,
    };

    /// The number of the primitive in a lane.
    pub(crate) fn primitive(&self, lane: usize) -> u32 {
        self.primitives[lane]
    }

    /// A bit mask of the lanes that hold primitives other than triangles.
    pub(crate) fn non_triangles(&self) -> u32 {
        self.non_triangles
    }

    pub(super) fn triangle(&self, lane: usize) -> [Vec3; 3] {
        self.corners
            .map(|c| Vec3::new(c[0][lane], c[1][lane], c[2][lane]))
    }
}

/// The triangles of a block that a ray hits, and where.
pub(crate) struct BlockHits {
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

/// The part of a block's triangle tests that depends only on the ray.
#[cfg(not(target_arch = "x86_64"))]
pub struct BlockTest<'a> {
    ray: &'a PreparedRay,
    t_min: f32,
}

#[cfg(not(target_arch = "x86_64"))]
impl<'a> BlockTest<'a> {
    /// Prepares tests of a ray for hits beyond `t_min`.
    pub fn new(ray: &'a PreparedRay, t_min: f32) -> Self {
        Self { ray, t_min }
    }

    /// Intersects the ray with the four triangles, each by [`PreparedRay::triangle`].
    #[inline(always)]
    pub fn intersect(&self, block: &Block, t_max: f32) -> BlockHits {
        let mut hits = BlockHits::NONE;
        for lane in 0..BLOCK {
            let hit = self.ray.triangle(&block.triangle(lane), self.t_min, t_max);
            if let Some((t, u, v)) = hit {
                hits.mask |= 1 << lane;
                (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, u, v);
            }
        }
        hits
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use lanes::BlockTest;

#[cfg(target_arch = "x86_64")]
mod lanes {
    use std::arch::x86_64::*;

    use super::*;

    /// The part of a block's triangle tests that depends only on the ray, repeated in four lanes.
    pub(crate) struct BlockTest {
        /// The ray's axes, which are the rows of a block's corners.
        rows: [usize; 3],
        /// The ray's origin along those axes.
        origin: [__m128; 3],
        shear: [__m128; 3],
        t_min: __m128,
    }

    impl BlockTest {
        /// Prepares tests of a ray for hits beyond `t_min`.
        #[inline(always)]
        pub(crate) fn new(ray: &PreparedRay, t_min: f32) -> Self {
            // SAFETY: SSE is part of every x86-64 processor.
            let all = |x: f32| unsafe { _mm_set1_ps(x) };
            let rows = ray.axes.map(|axis| axis.min(2));
            Self {
                rows,
                origin: rows.map(|axis| all(ray.origin[axis])),
                shear: ray.shear.to_array().map(all),
                t_min: all(t_min),
            }
        }

        /// Intersects the ray with the four triangles by the operations of
        /// [`PreparedRay::triangle`], in the same order.
        #[inline(always)]
        pub(crate) fn intersect(&self, block: &Block, t_max: f32) -> BlockHits {
            let [x, y, z] = self.rows;
            let [sx, sy, sz] = self.shear;
            let mut hits = BlockHits::NONE;
            // SAFETY: SSE2 is part of every x86-64 processor, the loads are from arrays of four
            // floats aligned to 16 by the block's layout (48-byte corners, 16-byte rows), and the
            // stores are unaligned ones to arrays of four.
            unsafe {
                let from_ray = |corner: usize, row: usize, origin: __m128| {
                    _mm_sub_ps(_mm_load_ps(block.corners[corner][row].as_ptr()), origin)
                };
                let sheared = |corner: usize| {
                    let z = from_ray(corner, z, self.origin[2]);
                    let x = _mm_sub_ps(from_ray(corner, x, self.origin[0]), _mm_mul_ps(sx, z));
                    let y = _mm_sub_ps(from_ray(corner, y, self.origin[1]), _mm_mul_ps(sy, z));
                    (x, y, z)
                };
                let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) =
                    (sheared(0), sheared(1), sheared(2));
                let cross = |px, qy, py, qx| _mm_sub_ps(_mm_mul_ps(px, qy), _mm_mul_ps(py, qx));
                let mut u = cross(cx, by, cy, bx);
                let mut v = cross(ax, cy, ay, cx);
                let mut w = cross(bx, ay, by, ax);
                let mut mask = !outside(u, v, w) & 15;
                if mask == 0 {
                    return hits;
                }
                let zero = _mm_setzero_ps();
                let on = |a| _mm_cmpeq_ps(a, zero);
                let exact = _mm_or_ps(_mm_or_ps(on(u), on(v)), on(w));
                if _mm_movemask_ps(exact) as u32 & mask != 0 {
                    let either =
                        |new, old| _mm_or_ps(_mm_and_ps(exact, new), _mm_andnot_ps(exact, old));
                    u = either(edge_in_f64(cx, by, cy, bx), u);
                    v = either(edge_in_f64(ax, cy, ay, cx), v);
                    w = either(edge_in_f64(bx, ay, by, ax), w);
                    mask &= !outside(u, v, w);
                }
                let det = _mm_add_ps(_mm_add_ps(u, v), w);
                let sum = _mm_add_ps(
                    _mm_add_ps(_mm_mul_ps(u, az), _mm_mul_ps(v, bz)),
                    _mm_mul_ps(w, cz),
                );
                let t = _mm_div_ps(_mm_mul_ps(sum, sz), det);
                let near = _mm_cmpgt_ps(t, self.t_min);
                let far = _mm_cmplt_ps(t, _mm_set1_ps(t_max));
                let whole = _mm_cmpneq_ps(det, zero);
                let good = _mm_and_ps(_mm_and_ps(near, far), whole);
                hits.mask = _mm_movemask_ps(good) as u32 & mask;
                if hits.mask != 0 {
                    _mm_storeu_ps(hits.t.as_mut_ptr(), t);
                    _mm_storeu_ps(hits.u.as_mut_ptr(), _mm_div_ps(v, det));
                    _mm_storeu_ps(hits.v.as_mut_ptr(), _mm_div_ps(w, det));
                }
            }
            hits
        }
    }

    /// A bit mask of the triangles that the ray misses: those with edge values of both signs.
    #[inline(always)]
    fn outside(u: __m128, v: __m128, w: __m128) -> u32 {
        // SAFETY: SSE is part of every x86-64 processor.
        unsafe {
            let zero = _mm_setzero_ps();
            let least = _mm_min_ps(_mm_min_ps(u, v), w);
            let most = _mm_max_ps(_mm_max_ps(u, v), w);
            let both = _mm_and_ps(_mm_cmplt_ps(least, zero), _mm_cmpgt_ps(most, zero));
            _mm_movemask_ps(both) as u32
        }
    }

    /// The edge function of one edge of each triangle, with products in f64.
    #[inline(always)]
    fn edge_in_f64(px: __m128, qy: __m128, py: __m128, qx: __m128) -> __m128 {
        // SAFETY: SSE2 is part of every x86-64 processor.
        unsafe {
            let two = |px, qy, py, qx| {
                let wide = |a| _mm_cvtps_pd(a);
                let value = _mm_sub_pd(
                    _mm_mul_pd(wide(px), wide(qy)),
                    _mm_mul_pd(wide(py), wide(qx)),
                );
                _mm_cvtpd_ps(value)
            };
            let high = |a| _mm_movehl_ps(a, a);
            _mm_movelh_ps(
                two(px, qy, py, qx),
                two(high(px), high(qy), high(py), high(qx)),
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::ray::Ray;
    use crate::sampling::mix;

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
        assert!(hits > 30_000 && exact > 500, "{hits} hits, {exact} exact");
    }
}
