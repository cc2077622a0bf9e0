//! Triangulates polygons, including concave ones.
//!
//! Concave polygons are triangulated by ear clipping in the coordinate plane that is most parallel
//! to the polygon. The ear with the smallest circumscribed circle is cut first. This is Coin's
//! choice, so both programs give the same triangles. Ears with equal circles are ordered by their
//! place in a binary heap, so the heap's operations follow Coin's as well. Large polygons are left
//! to the crate `earcut`, because this search tests every corner for every ear.

use std::collections::HashSet;

use glam::Vec3;

use super::normals::{newell, unit};

/// Polygons with more corners are cut by `earcut`, because the time of the search grows with the
/// square of their number. No search for the limit is recorded: a larger one costs time, and with a
/// smaller one fewer polygons are cut as Coin cuts them. `a_star_is_cut_without_overlap` tests both
/// sides of it.
const MANY: usize = 3000;

/// A polygon that repeats its corners more often is cut as a fan: see [`is_wound_often`]. At the
/// limit, 3,600 corners at 56 places take 0.03 s to cut. At 3 places they took 10 s.
const REPEATS: usize = 64;

/// Cuts a polygon of `n` corners as Coin does, and calls `cut` with each triangle as indices of its
/// corners.
///
/// A quadrilateral is cut along its first diagonal, or along the other one if only that is inside.
/// A convex polygon becomes a fan, and other polygons are tessellated.
#[inline]
pub(crate) fn cut_polygon(
    n: usize,
    point: impl Fn(usize) -> Vec3,
    convex: bool,
    mut cut: impl FnMut([usize; 3]),
) {
    match n {
        0..=2 => {}
        3 => cut([0, 1, 2]),
        4 if !convex && is_cut_outside([0, 1, 2, 3].map(&point)) => {
            cut([1, 2, 3]);
            cut([1, 3, 0]);
        }
        _ if convex || n == 4 => (2..n).for_each(|i| cut([0, i - 1, i])),
        _ => {
            let points: Vec<Vec3> = (0..n).map(point).collect();
            tessellate(&points).into_iter().for_each(cut);
        }
    }
}

/// Whether the first diagonal of a quadrilateral is outside it, so that the two triangles face in
/// opposite directions.
fn is_cut_outside(q: [Vec3; 4]) -> bool {
    let [a, b, c, d] = q.map(|p| p.as_dvec3());
    let first = (b - a).cross(c - a);
    let second = (c - a).cross(d - a);
    first.dot(second) < 0.0
}

/// Cuts a polygon of n corners into n − 2 triangles, as indices of its corners. Some triangles may
/// have no area.
fn tessellate(points: &[Vec3]) -> Vec<[usize; 3]> {
    match points.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        _ if !points.iter().all(|p| p.is_finite()) || is_wound_often(points) => fan(points.len()),
        n if n > MANY => many(points),
        _ => without_repeats(points),
    }
}

/// Cuts a polygon whose corners may repeat the one before. Such a corner would block its own ears,
/// so it is cut off as a triangle without area, which keeps the count at n − 2.
fn without_repeats(points: &[Vec3]) -> Vec<[usize; 3]> {
    let n = points.len();
    let kept: Vec<usize> = (0..n)
        .filter(|&i| points[i] != points[(i + n - 1) % n])
        .collect();
    if kept.len() == n || kept.len() < 3 {
        return EarClipper::new(points).cut();
    }
    let fewer: Vec<Vec3> = kept.iter().map(|&i| points[i]).collect();
    let mut out: Vec<[usize; 3]> = match fewer.len() {
        3 => vec![[kept[0], kept[1], kept[2]]],
        _ => EarClipper::new(&fewer)
            .cut()
            .into_iter()
            .map(|t| t.map(|i| kept[i]))
            .collect(),
    };
    let repeats = (0..n).filter(|&i| points[i] == points[(i + n - 1) % n]);
    out.extend(repeats.map(|i| [(i + n - 1) % n, i, (i + 1) % n]));
    out
}

/// Returns whether a polygon has each corner more than [`REPEATS`] times on average. The time to
/// cut it would grow with the cube of its corners, and its area is that of a fan.
fn is_wound_often(points: &[Vec3]) -> bool {
    let distinct = || {
        let bits = points.iter().map(|p| p.to_array().map(f32::to_bits));
        bits.collect::<HashSet<_>>().len()
    };
    points.len() > 3 * REPEATS && points.len() > REPEATS * distinct()
}

/// Cuts a polygon as a fan about its first corner.
fn fan(n: usize) -> Vec<[usize; 3]> {
    (1..n - 1).map(|i| [0, i, i + 1]).collect()
}

/// Returns the two axes of the plane of projection, and whether the polygon is counterclockwise
/// there.
fn plane(points: &[Vec3]) -> (usize, usize, bool) {
    let n = unit(newell(points));
    let a = n.abs();
    if a.x > a.y {
        if a.x > a.z {
            return (1, 2, n.x > 0.0);
        }
    } else if a.y > a.z {
        return (2, 0, n.y > 0.0);
    }
    (0, 1, n.z > 0.0)
}

/// Cuts a polygon with `earcut`.
fn many(points: &[Vec3]) -> Vec<[usize; 3]> {
    let (x, y, _) = plane(points);
    let flat = points.iter().map(|p| [f64::from(p[x]), f64::from(p[y])]);
    let mut out: Vec<u32> = Vec::new();
    earcut::Earcut::new().earcut(flat, &[], &mut out);
    if out.is_empty() {
        return fan(points.len());
    }
    out.chunks_exact(3)
        .map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
        .collect()
}

/// The weight of a corner that is not an ear.
const NEVER: f64 = f32::MAX as f64;

/// A polygon whose ears are being cut. A corner's ear is the triangle of it and the two corners
/// after it.
struct EarClipper {
    /// The corners, projected to the plane.
    flat: Vec<[f32; 2]>,
    /// For each corner, the next one that is not yet cut off.
    next: Vec<usize>,
    /// For each corner, the previous one that is not yet cut off.
    prev: Vec<usize>,
    /// The squared radius of the circumscribed circle of each ear, or [`NEVER`].
    weight: Vec<f64>,
    /// Whether each weight has to be computed again.
    stale: Vec<bool>,
    /// Whether the polygon is counterclockwise.
    left: bool,
    /// The largest area that counts as 0.
    smallest: f64,
    /// A binary heap of the corners by weight.
    heap: Vec<usize>,
    /// The place of each corner in the heap.
    slot: Vec<usize>,
    /// Whether each corner can block ears. Of equal points only the first can.
    blocks: Vec<bool>,
    /// For each corner, the first corner at the same point.
    first_of: Vec<usize>,
}

impl EarClipper {
    fn new(points: &[Vec3]) -> Self {
        let n = points.len();
        let (x, y, left) = plane(points);
        let flat: Vec<[f32; 2]> = points.iter().map(|p| [p[x], p[y]]).collect();
        let range = |k: usize| {
            let lo = flat.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min);
            let hi = flat.iter().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max);
            f64::from(hi - lo)
        };
        let epsilon = f64::from(f32::EPSILON);
        let smallest = range(0).min(range(1)) * epsilon * epsilon;
        let mut seen = std::collections::HashMap::new();
        let first_of: Vec<usize> = flat
            .iter()
            .enumerate()
            .map(|(i, p)| *seen.entry(p.map(|c| (c + 0.0).to_bits())).or_insert(i))
            .collect();
        Self {
            next: (0..n).map(|i| (i + 1) % n).collect(),
            prev: (0..n).map(|i| (i + n - 1) % n).collect(),
            weight: vec![NEVER; n],
            stale: vec![true; n],
            left,
            smallest,
            heap: Vec::with_capacity(n),
            slot: vec![usize::MAX; n],
            blocks: first_of.iter().enumerate().map(|(i, &f)| i == f).collect(),
            first_of,
            flat,
        }
    }

    /// Cuts the polygon into triangles.
    fn cut(mut self) -> Vec<[usize; 3]> {
        let n = self.flat.len();
        let mut out = Vec::with_capacity(n - 2);
        for v in 0..n {
            self.add(v);
        }
        let (mut remaining, mut v) = (n, 0);
        while remaining > 4 {
            v = self.heap[0];
            if self.weigh(v) == NEVER {
                break;
            }
            let tip = self.next[v];
            self.remove(tip);
            self.blocks[self.first_of[tip]] = false;
            self.emit(v, &mut out);
            remaining -= 1;
            let before = self.prev[v];
            (self.stale[before], self.stale[v]) = (true, true);
            self.update(before);
            (self.stale[before], self.stale[v]) = (true, true);
            self.update(v);
        }
        if remaining == 4 {
            // Choose the diagonal for which the larger of the two circles is smaller.
            let opposite = self.next[self.next[v]];
            self.stale[self.next[v]] = true;
            self.stale[opposite] = true;
            let along = self.weigh(v).max(self.weigh(opposite));
            let across = self.weigh(self.next[v]).max(self.weigh(self.prev[v]));
            if along >= across {
                v = self.next[v];
            }
            self.emit(v, &mut out);
            self.emit(v, &mut out);
        }
        if remaining > 4 {
            // The rest has no ear, because it crosses itself or lies on a line.
            self.cut_rest(v, &mut out);
        }
        out
    }

    /// Cuts the corners that are left with `earcut`.
    fn cut_rest(&self, start: usize, out: &mut Vec<[usize; 3]>) {
        let mut ring = vec![start];
        let mut v = self.next[start];
        while v != start {
            ring.push(v);
            v = self.next[v];
        }
        let flat = ring.iter().map(|&i| self.flat[i].map(f64::from));
        let mut cut: Vec<u32> = Vec::new();
        earcut::Earcut::new().earcut(flat, &[], &mut cut);
        let wanted = ring.len() - 2;
        out.extend(
            cut.chunks_exact(3)
                .map(|t| [0, 1, 2].map(|k| ring[t[k] as usize])),
        );
        // In Inventor there are always n − 2 triangles, some without area.
        let missing = wanted.saturating_sub(cut.len() / 3);
        out.extend((0..missing).map(|_| [ring[0]; 3]));
    }

    /// Outputs the ear of a corner, and removes the ear's tip.
    fn emit(&mut self, v: usize, out: &mut Vec<[usize; 3]>) {
        let (b, c) = (self.next[v], self.next[self.next[v]]);
        out.push([v, b, c]);
        self.prev[c] = v;
        self.next[v] = c;
    }

    /// The corners of an ear.
    fn corners(&self, v: usize) -> [[f32; 2]; 3] {
        let b = self.next[v];
        [self.flat[v], self.flat[b], self.flat[self.next[b]]]
    }

    /// Returns a corner's weight: the squared radius of its ear's circle, or [`NEVER`].
    fn weigh(&mut self, v: usize) -> f64 {
        if std::mem::take(&mut self.stale[v]) {
            let [a, b, c] = self.corners(v);
            let area =
                0.5 * f64::from((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
            let turns = if self.left { area > 0.0 } else { area < 0.0 };
            self.weight[v] = if turns && area.abs() > self.smallest && self.is_empty(v) {
                circle(a, b, c)
            } else {
                NEVER
            };
        }
        self.weight[v]
    }

    /// Whether an ear and its border contain no other corner.
    fn is_empty(&self, v: usize) -> bool {
        let [a, b, c] = self.corners(v);
        let own = [v, self.next[v], self.next[self.next[v]]];
        let lo = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
        let hi = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
        self.flat.iter().enumerate().all(|(i, p)| {
            !self.blocks[i]
                || p[0] < lo[0]
                || p[0] > hi[0]
                || p[1] < lo[1]
                || p[1] > hi[1]
                || own.contains(&i)
                || !inside(*p, a, b, c)
        })
    }

    /// Whether a corner precedes another one in the heap.
    fn before(&mut self, a: usize, b: usize) -> bool {
        self.weigh(a) < self.weigh(b)
    }

    /// Stores a corner at a place of the heap.
    fn put(&mut self, at: usize, v: usize) {
        self.heap[at] = v;
        self.slot[v] = at;
    }

    /// Adds a corner to the heap.
    fn add(&mut self, v: usize) {
        self.heap.push(v);
        self.lift(self.heap.len() - 1, v);
    }

    /// Moves a corner from a place of the heap up to its level.
    fn lift(&mut self, mut at: usize, v: usize) {
        while at > 0 {
            let parent = self.heap[(at - 1) / 2];
            if !self.before(v, parent) {
                break;
            }
            self.put(at, parent);
            at = (at - 1) / 2;
        }
        self.put(at, v);
    }

    /// Removes a corner from the heap.
    fn remove(&mut self, v: usize) {
        let at = self.slot[v];
        let Some(last) = self.heap.pop() else {
            return;
        };
        if at < self.heap.len() {
            self.put(at, last);
            self.sink(at);
        }
    }

    /// Moves a corner in the heap after its weight has changed.
    fn update(&mut self, v: usize) {
        let at = self.slot[v];
        self.lift(at, v);
        if self.slot[v] == at {
            self.sink(at);
        }
    }

    /// Moves the corner at a place of the heap down to its level.
    fn sink(&mut self, mut at: usize) {
        loop {
            let mut best = at;
            for child in [2 * at + 1, 2 * at + 2] {
                if child < self.heap.len() && self.before(self.heap[child], self.heap[best]) {
                    best = child;
                }
            }
            if best == at {
                return;
            }
            let (a, b) = (self.heap[at], self.heap[best]);
            self.put(at, b);
            self.put(best, a);
            at = best;
        }
    }
}

/// Whether a point is in a triangle or on its border, by barycentric coordinates in f32 as in Coin.
fn inside(p: [f32; 2], a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> bool {
    let scale = 1.0 / ((b[1] - c[1]) * (a[0] - c[0]) + (c[0] - b[0]) * (a[1] - c[1]));
    let u = ((b[1] - c[1]) * (p[0] - c[0]) + (c[0] - b[0]) * (p[1] - c[1])) * scale;
    let v = ((c[1] - a[1]) * (p[0] - c[0]) + (a[0] - c[0]) * (p[1] - c[1])) * scale;
    let w = 1.0 - u - v;
    [u, v, w].iter().all(|x| (0.0..=1.0).contains(x))
}

/// Returns the squared radius of the circle through three points.
fn circle(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> f64 {
    let wide = |p: f32| f64::from(p);
    let (ax, ay) = (wide(b[0] - a[0]), wide(b[1] - a[1]));
    let (bx, by) = (wide(c[0] - a[0]), wide(c[1] - a[1]));
    let e = ax * wide(a[0] + b[0]) + ay * wide(a[1] + b[1]);
    let f = bx * wide(a[0] + c[0]) + by * wide(a[1] + c[1]);
    let g = 2.0 * (ax * wide(c[1] - b[1]) - ay * wide(c[0] - b[0]));
    if g == 0.0 {
        return NEVER;
    }
    let x = wide(a[0]) - (by * e - ay * f) / g;
    let y = wide(a[1]) - (ax * f - bx * e) / g;
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[Vec3], triangles: &[[usize; 3]]) -> (f32, f32) {
        let one = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| points[i]);
            0.5 * (b - a).cross(c - a).z
        };
        (
            triangles.iter().map(one).sum(),
            triangles.iter().map(|t| one(t).abs()).sum(),
        )
    }

    /// Of 30,000 corners at three places no search ends soon; the fan has their area.
    #[test]
    fn a_triangle_that_is_wound_often_is_a_fan() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let points = corners.repeat(10_000);
        let triangles = tessellate(&points);
        assert_eq!(triangles, fan(points.len()));
        assert!((area(&points, &triangles).0 - 5_000.0).abs() < 1.0);
        assert!(!is_wound_often(&corners.repeat(60)));
    }

    /// Every second corner of a star is concave. The triangles' area is that of the shoelace
    /// formula. If two triangles overlapped, the sum of their areas would be larger.
    #[test]
    fn a_star_is_cut_without_overlap() {
        for n in [10, 11, 50, 400, 4000] {
            let points: Vec<Vec3> = (0..n)
                .map(|i| {
                    let angle = std::f32::consts::TAU * i as f32 / n as f32;
                    let r = if i % 2 == 0 { 1.0 } else { 0.4 };
                    Vec3::new(r * angle.cos(), r * angle.sin(), 0.0)
                })
                .collect();
            let shoelace = 0.5 * newell(&points).z;
            let triangles = tessellate(&points);
            assert_eq!(triangles.len(), n - 2);
            let (signed, plain) = area(&points, &triangles);
            assert!(
                (signed - shoelace).abs() < 1e-4,
                "{n}: {signed} for {shoelace}"
            );
            assert!((plain - shoelace).abs() < 1e-4, "{n}: overlap {plain}");
        }
    }

    /// A corner of a concave face is repeated four times, as in castle's `concave.wrl`.
    #[test]
    fn a_face_with_repeated_corners_is_cut_without_overlap() {
        let corner = |x, y| Vec3::new(x, y, 0.0);
        let mut points = vec![corner(0.0, 0.5)];
        points.extend([corner(2.5, 0.5); 4]);
        let rest = [
            (2.5, 1.85),
            (2.85, 1.85),
            (2.85, 0.15),
            (0.0, 0.15),
            (0.0, 0.15),
        ];
        points.extend(rest.map(|(x, y)| corner(x, y)));
        let triangles = tessellate(&points);
        assert_eq!(triangles.len(), 8);
        let (signed, plain) = area(&points, &triangles);
        assert!(plain < signed.abs() + 1e-4, "{signed} {plain}");
    }

    #[test]
    fn a_polygon_that_is_a_line_gives_triangles_without_area() {
        let points: Vec<Vec3> = (0..6).map(|i| Vec3::X * i as f32).collect();
        let triangles = tessellate(&points);
        assert_eq!(triangles.len(), 4);
        assert_eq!(area(&points, &triangles).1, 0.0);
    }
}
