//! Measures the distance between the edges of two pictures, independent of their shading.
//!
//! Edges are ridges of the local contrast, the gradient over the mean brightness around it. A
//! darker lamp, a gradient of light or another gamma does not move them. Hysteresis thresholds and
//! non-maximum suppression are Canny's (1986); the distance transform is Felzenszwalb and
//! Huttenlocher's (2012).

use serde::Serialize;

use crate::metric::Mask;
use crate::plane::{Plane, length};

/// A map of the pixels that are on an edge.
#[derive(Clone, Debug)]
pub(crate) struct EdgeMap {
    pub width: usize,
    pub height: usize,
    /// Whether each pixel is on an edge, row by row.
    pub on: Vec<bool>,
}

/// The distance between two sets of edges, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EdgeDistance {
    /// The mean distance from an edge to the nearest one of the other picture, in both directions,
    /// each at most 10 pixels.
    pub mean: f64,
    /// The 95th percentile of these distances.
    pub p95: f64,
    /// The share of the edges with one of the other picture within 1.5 pixels.
    pub matched: f64,
}

/// The distance in pixels that an edge without a counterpart counts as.
pub(crate) const FAR: f64 = 10.0;

/// The standard deviation of the Gaussian before the gradient, in pixels.
const SIGMA: f64 = 1.4;
/// The local contrast, per pixel, that starts an edge. No search is recorded for it and
/// [`CONTINUE`]: smaller values find edges in grain, and larger ones miss faint edges. Both
/// pictures are measured with the same values.
const START: f32 = 0.05;
/// The local contrast, per pixel, that continues an edge.
const CONTINUE: f32 = 0.02;

impl EdgeMap {
    /// Detects the edges of a picture's brightness.
    pub(crate) fn of(luma: &Plane) -> Self {
        let smooth = luma.blurred(SIGMA);
        // The offset of 0.02 prevents edges from the noise of black corners.
        let around = luma.blurred(8.0).map(|v| v.abs() + 0.02);
        let [gx, gy] = smooth.gradients().map(|g| g.zip(&around, |g, a| g / a));
        let strength = gx.zip(&gy, length);
        let thin = |x: usize, y: usize| {
            let (x, y) = (x as isize, y as isize);
            let here = strength.near(x, y);
            let i = y as usize * luma.width + x as usize;
            let (dx, dy) = step(gx.values[i], gy.values[i]);
            let (ahead, behind) = (strength.near(x + dx, y + dy), strength.near(x - dx, y - dy));
            // Only one of the comparisons is strict, so that a ridge two pixels wide is thinned to
            // one.
            if here > ahead && here >= behind {
                here
            } else {
                0.0
            }
        };
        let ridge = Plane::from_fn(luma.width, luma.height, thin);
        Self {
            width: luma.width,
            height: luma.height,
            on: connected(&ridge),
        }
    }

    /// Returns the map without the pixels that do not count.
    pub(crate) fn within(mut self, mask: &Mask) -> Self {
        for (on, counts) in self.on.iter_mut().zip(&mask.counts) {
            *on &= counts;
        }
        self
    }

    /// Returns the number of edge pixels that count.
    pub(crate) fn count(&self, mask: &Mask) -> usize {
        let both = self.on.iter().zip(&mask.counts);
        both.filter(|(on, counts)| **on && **counts).count()
    }

    /// Returns the Euclidean distance of every pixel to the nearest edge.
    fn distances(&self) -> Vec<f64> {
        let far = (self.width + self.height) as f64;
        let mut squares: Vec<f64> = self
            .on
            .iter()
            .map(|&on| if on { 0.0 } else { far * far })
            .collect();
        for row in squares.chunks_mut(self.width) {
            lower_envelope(row);
        }
        let mut column = vec![0.0; self.height];
        for x in 0..self.width {
            for (y, c) in column.iter_mut().enumerate() {
                *c = squares[y * self.width + x];
            }
            lower_envelope(&mut column);
            for (y, c) in column.iter().enumerate() {
                squares[y * self.width + x] = *c;
            }
        }
        squares.into_iter().map(f64::sqrt).collect()
    }
}

/// Measures the distance between two sets of edges, or returns `None` if either has no edge that
/// counts.
pub(crate) fn distance(a: &EdgeMap, b: &EdgeMap, mask: &Mask) -> Option<EdgeDistance> {
    if a.count(mask) == 0 || b.count(mask) == 0 {
        return None;
    }
    let one_way = |from: &EdgeMap, to: &EdgeMap| -> Vec<f64> {
        let distances = to.distances();
        (0..from.on.len())
            .filter(|&i| from.on[i] && mask.counts[i])
            .map(|i| distances[i].min(FAR))
            .collect()
    };
    let mut all = one_way(a, b);
    all.extend(one_way(b, a));
    all.sort_by(f64::total_cmp);
    let near = all.partition_point(|d| *d <= 1.5);
    Some(EdgeDistance {
        mean: all.iter().sum::<f64>() / all.len() as f64,
        p95: all[(all.len() - 1) * 95 / 100],
        matched: near as f64 / all.len() as f64,
    })
}

/// Returns the neighbor that a gradient points at, in eight directions.
fn step(gx: f32, gy: f32) -> (isize, isize) {
    const TAN: f32 = 0.414_213_56; // The tangent of 22.5 degrees.
    let sign = |v: f32| if v < 0.0 { -1 } else { 1 };
    if gy.abs() <= TAN * gx.abs() {
        (sign(gx), 0)
    } else if gx.abs() <= TAN * gy.abs() {
        (0, sign(gy))
    } else {
        (sign(gx), sign(gy))
    }
}

/// Returns the ridges with a pixel of at least [`START`], followed while they are at least
/// [`CONTINUE`].
fn connected(ridge: &Plane) -> Vec<bool> {
    let mut on: Vec<bool> = ridge.values.iter().map(|&v| v >= START).collect();
    let mut open: Vec<usize> = (0..on.len()).filter(|&i| on[i]).collect();
    while let Some(i) = open.pop() {
        let (x, y) = (i % ridge.width, i / ridge.width);
        for ny in y.saturating_sub(1)..=(y + 1).min(ridge.height - 1) {
            for nx in x.saturating_sub(1)..=(x + 1).min(ridge.width - 1) {
                let n = ny * ridge.width + nx;
                if !on[n] && ridge.values[n] >= CONTINUE {
                    on[n] = true;
                    open.push(n);
                }
            }
        }
    }
    on
}

/// Replaces `f(q)` by the minimum of `f(p) + (p - q)²` over p, in linear time.
fn lower_envelope(f: &mut [f64]) {
    let parabola = |p: usize| f[p] + (p * p) as f64;
    let mut feet: Vec<usize> = vec![0];
    let mut starts = vec![f64::NEG_INFINITY];
    for p in 1..f.len() {
        loop {
            let last = feet[feet.len() - 1];
            let cross = (parabola(p) - parabola(last)) / (2 * (p - last)) as f64;
            if cross > starts[starts.len() - 1] || feet.len() == 1 {
                feet.push(p);
                starts.push(cross);
                break;
            }
            feet.pop();
            starts.pop();
        }
    }
    let mut k = 0;
    let out: Vec<f64> = (0..f.len())
        .map(|q| {
            while k + 1 < feet.len() && starts[k + 1] < q as f64 {
                k += 1;
            }
            let off = q as f64 - feet[k] as f64;
            off * off + f[feet[k]]
        })
        .collect();
    f.copy_from_slice(&out);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a gray box on black with its left side at `left`.
    fn square(left: usize, shade: impl Fn(usize, usize) -> f32 + Sync) -> Plane {
        Plane::from_fn(80, 60, |x, y| {
            let inside = (left..left + 30).contains(&x) && (15..45).contains(&y);
            shade(x, y) * if inside { 0.8 } else { 0.2 }
        })
    }

    fn between(a: &Plane, b: &Plane) -> EdgeDistance {
        distance(&EdgeMap::of(a), &EdgeMap::of(b), &Mask::all(80, 60)).unwrap()
    }

    #[test]
    fn light_that_falls_off_across_the_picture_moves_no_edge() {
        let even = square(20, |_, _| 1.0);
        let uneven = square(20, |x, y| 0.4 + 0.006 * x as f32 + 0.002 * y as f32);
        let apart = between(&even, &uneven);
        assert!(apart.mean < 0.1 && apart.matched > 0.98, "{apart:?}");
        let brighter = between(&even, &even.map(|v| libm::powf(v, 0.6)));
        assert!(
            brighter.mean < 0.1 && brighter.matched > 0.98,
            "{brighter:?}"
        );
    }

    #[test]
    fn a_wall_moved_by_three_pixels_is_three_pixels_away() {
        let wall = |at: usize| Plane::from_fn(80, 60, |x, _| if x < at { 0.2 } else { 0.8 });
        let apart = between(&wall(30), &wall(33));
        assert_eq!((apart.mean, apart.p95, apart.matched), (3.0, 3.0, 0.0));
    }

    #[test]
    fn the_distance_to_an_edge_is_euclids() {
        let mut on = vec![false; 20 * 10];
        on[3 * 20 + 4] = true;
        let edges = EdgeMap {
            width: 20,
            height: 10,
            on,
        };
        let far = edges.distances();
        for (x, y) in [(4, 3), (7, 7), (19, 9), (0, 0)] {
            let exact = (x as f64 - 4.0).hypot(y as f64 - 3.0);
            assert!((far[y * 20 + x] - exact).abs() < 1e-12);
        }
    }

    #[test]
    fn a_flat_picture_has_no_edges_to_measure() {
        let flat = EdgeMap::of(&Plane::from_fn(80, 60, |_, _| 0.5));
        assert!(distance(&flat, &flat, &Mask::all(80, 60)).is_none());
    }
}
