//! Finds the parameters of a picture: those whose rendering looks most like an archival one.
//!
//! Knows nothing of cameras: a caller gives numbers, how large a step of each is felt, and a
//! function that renders. From small pictures to large ones, Levenberg and Marquardt on the
//! robust difference of local contrast, which another gain, gamma or lamp hardly changes.
//! Derivatives are differences of renderings that share their random numbers.

use super::align::contrast;
use super::metric::Mask;
use super::plane::{Plane, Plate};
use super::tone::{self, Matching};
use crate::diag::Result;

/// Renders parameters at a size in pixels.
pub type Renderer<'r> = dyn FnMut(&[f64], (usize, usize)) -> Result<Plate> + 'r;

/// Iterations at each size, at most.
const MOST: usize = 12;
/// Blur before contrast is taken, and the border that is left out, in pixels.
const SIGMA: f64 = 1.0;
const MARGIN: usize = 2;

/// What is to be matched, and how.
pub struct Fit<'a> {
    pub target: &'a Plate,
    /// Sizes to render at, from small to large.
    pub sizes: Vec<(usize, usize)>,
    /// Of each parameter, a change that moves the largest rendering by about half a pixel.
    pub steps: Vec<f64>,
}

/// Where the search ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    pub values: Vec<f64>,
    /// Standard error of each if the differences left are noise; infinite where the picture does
    /// not tell. Errors that pixels share (another lens, an edge's stairs) come on top.
    pub errors: Vec<f64>,
    /// Robust mean square of the differences left, at the largest size.
    pub cost: f64,
    pub renders: usize,
}

/// One size: the target in it, and the count of renderings so far.
struct Level<'f, 'r> {
    fit: &'f Fit<'f>,
    size: (usize, usize),
    target: Plane,
    render: &'f mut Renderer<'r>,
    renders: usize,
}

impl Fit<'_> {
    /// Sizes from about 48 pixels on the longer side up to this one, each double the last.
    pub fn pyramid((width, height): (usize, usize)) -> Vec<(usize, usize)> {
        let mut sizes = vec![(width, height)];
        let half = |n: usize| n.div_ceil(2).max(1);
        while let Some(&(w, h)) = sizes.last()
            && w.max(h) >= 90
        {
            sizes.push((half(w), half(h)));
        }
        sizes.reverse();
        sizes
    }

    /// The cost of parameters at the smallest size: to choose among places to start from.
    ///
    /// # Errors
    /// What rendering says.
    pub fn cost_of(&self, values: &[f64], render: &mut Renderer<'_>) -> Result<f64> {
        let mut level = Level::new(self, self.sizes[0], render);
        let off = level.off(values)?;
        Ok(cost(&off, 1.0))
    }

    /// Refines the parameters; `told` hears of every size that is done.
    ///
    /// # Errors
    /// What rendering the start says.
    pub fn run(
        &self,
        start: &[f64],
        render: &mut Renderer<'_>,
        told: &mut dyn FnMut((usize, usize), f64),
    ) -> Result<Fitted> {
        let mut fitted = Fitted {
            values: start.to_vec(),
            errors: vec![f64::INFINITY; start.len()],
            cost: f64::INFINITY,
            renders: 0,
        };
        for &size in &self.sizes {
            let mut level = Level::new(self, size, render);
            let done = level.refine(&fitted.values)?;
            let renders = fitted.renders + level.renders;
            fitted = Fitted { renders, ..done };
            told(size, fitted.cost);
        }
        Ok(fitted)
    }
}

impl<'f, 'r> Level<'f, 'r> {
    fn new(fit: &'f Fit<'f>, size: (usize, usize), render: &'f mut Renderer<'r>) -> Self {
        let luma = fit.target.luma().resized(size.0, size.1);
        Self {
            fit,
            size,
            target: contrast(&luma, SIGMA),
            render,
            renders: 0,
        }
    }

    /// Differences from the target, without the border.
    fn off(&mut self, values: &[f64]) -> Result<Vec<f64>> {
        self.renders += 1;
        let plate = (self.render)(values, self.size)?;
        let seen = contrast(&plate.luma(), SIGMA);
        let (width, height) = self.size;
        let inner = |n: usize| MARGIN.min(n / 4)..n - MARGIN.min(n / 4);
        Ok(inner(height)
            .flat_map(|y| inner(width).map(move |x| y * width + x))
            .map(|i| f64::from(seen.values[i]) - f64::from(self.target.values[i]))
            .collect())
    }

    /// Gives the target the tones of a rendering: contrast near the noise depends on the gain.
    fn match_tones(&mut self, values: &[f64]) -> Result<()> {
        self.renders += 1;
        let seen = (self.render)(values, self.size)?.luma();
        let old = self.fit.target.luma().resized(self.size.0, self.size.1);
        let gray = |p: &Plane| Plate::from_planes([p.clone(), p.clone(), p.clone()]);
        let mask = Mask::all(self.size.0, self.size.1);
        let [tone, ..] = tone::fit(&gray(&seen), &gray(&old), &mask, Matching::Channel);
        self.target = contrast(&old.map(|v| tone.apply(v)), SIGMA);
        Ok(())
    }

    fn refine(&mut self, start: &[f64]) -> Result<Fitted> {
        self.match_tones(start)?;
        let mut values = start.to_vec();
        let mut off = self.off(&values)?;
        let mut damping = 1e-2;
        let mut normal = None;
        for _ in 0..MOST {
            let width = huber_width(&off);
            let system = self.linearized(&values, &off, width);
            let before = cost(&off, width);
            let mut better = None;
            while better.is_none() && damping < 1e5 {
                let Some(step) = solve(&system.0, &system.1, damping) else {
                    break;
                };
                let next: Vec<f64> = values.iter().zip(&step).map(|(v, s)| v + s).collect();
                // A place that can't be rendered (too near to focus) is no better.
                better = self
                    .off(&next)
                    .ok()
                    .filter(|o| cost(o, width) < before)
                    .map(|o| (next, o, step));
                damping *= if better.is_some() { 0.2 } else { 8.0 };
            }
            normal = Some(system.0);
            let Some((next, next_off, step)) = better else {
                break;
            };
            let small = step
                .iter()
                .zip(&self.fit.steps)
                .all(|(s, h)| s.abs() < 0.02 * h);
            let gained = 1.0 - cost(&next_off, width) / before;
            (values, off) = (next, next_off);
            damping = damping.max(1e-6);
            if small || gained < 1e-4 {
                break;
            }
        }
        let cost = cost(&off, huber_width(&off));
        // A blur of σ makes 4πσ² pixels say the same.
        let variance = cost * 4.0 * std::f64::consts::PI * SIGMA * SIGMA;
        let errors = normal.map_or(Vec::new(), |n| standard_errors(&n, values.len(), variance));
        Ok(Fitted {
            values,
            errors,
            cost,
            renders: 0,
        })
    }

    /// The normal equations at a place: matrix (row by row) and right side.
    fn linearized(&mut self, values: &[f64], off: &[f64], width: f64) -> (Vec<f64>, Vec<f64>) {
        let n = values.len();
        // At a smaller size a step has to be larger to be felt as much.
        let largest = self.fit.sizes.last().map_or(1, |s| s.0);
        let coarse = largest as f64 / self.size.0 as f64;
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|i| self.derivative(values, off, i, coarse * self.fit.steps[i]))
            .collect();
        let weights: Vec<f64> = off.iter().map(|r| huber_weight(*r, width)).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            let terms = a.iter().zip(b).zip(&weights);
            terms.map(|((a, b), w)| w * a * b).sum()
        };
        let mut matrix = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                matrix[i * n + j] = dot(&columns[i], &columns[j]);
            }
        }
        let right = columns.iter().map(|c| -dot(c, off)).collect();
        (matrix, right)
    }

    /// Change of the differences with one parameter, by a step to both sides, or to the one that
    /// can be rendered.
    fn derivative(&mut self, values: &[f64], off: &[f64], i: usize, step: f64) -> Vec<f64> {
        let mut side = |by: f64| {
            let mut moved = values.to_vec();
            moved[i] += by;
            self.off(&moved).ok()
        };
        let slope = |high: &[f64], low: &[f64], run: f64| -> Vec<f64> {
            high.iter().zip(low).map(|(h, l)| (h - l) / run).collect()
        };
        match (side(step), side(-step)) {
            (Some(high), Some(low)) => slope(&high, &low, 2.0 * step),
            (Some(high), None) => slope(&high, off, step),
            (None, Some(low)) => slope(off, &low, step),
            (None, None) => vec![0.0; off.len()],
        }
    }
}

/// Huber's mean: square near zero, straight beyond the width.
fn cost(off: &[f64], width: f64) -> f64 {
    let term = |r: &f64| {
        let r = r.abs();
        if r <= width {
            r * r
        } else {
            width * (2.0 * r - width)
        }
    };
    off.iter().map(term).sum::<f64>() / off.len().max(1) as f64
}

fn huber_weight(off: f64, width: f64) -> f64 {
    let off = off.abs();
    if off <= width { 1.0 } else { width / off }
}

/// 1.345 standard deviations, told by the median.
fn huber_width(off: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = off.iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
    (1.345 * 1.4826 * median).clamp(0.02, 2.0)
}

/// Square roots of the diagonal of the inverse, times the variance left.
fn standard_errors(matrix: &[f64], n: usize, variance: f64) -> Vec<f64> {
    let one = |i: usize| {
        let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
        let column = solve(matrix, &unit, 0.0)?;
        Some((column[i] * variance).sqrt())
    };
    (0..n).map(|i| one(i).unwrap_or(f64::INFINITY)).collect()
}

/// Solves a symmetric system of which the lower half is given, row by row, with its diagonal
/// damped; Cholesky's factors. `None` where it is singular.
pub(super) fn solve(matrix: &[f64], right: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = right.len();
    let mut l = matrix.to_vec();
    for i in 0..n {
        l[i * n + i] += damping * l[i * n + i] + 1e-12;
    }
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let rest = l[i * n + j] - dot;
            if i != j {
                l[i * n + j] = rest / l[j * n + j];
            } else if rest > 0.0 {
                l[i * n + i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut x = right.to_vec();
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i * n + i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symmetric_system_is_solved_and_a_singular_one_refused() {
        // 4x + 2y = 10, 2x + 3y = 9: x = 1.5, y = 2.
        let x = solve(&[4.0, 0.0, 2.0, 3.0], &[10.0, 9.0], 0.0).unwrap();
        assert!((x[0] - 1.5).abs() < 1e-9 && (x[1] - 2.0).abs() < 1e-9);
        assert!(solve(&[1.0, 0.0, 2.0, 1.0], &[1.0, 1.0], 0.0).is_none());
    }

    /// Blobs at a place, of a size, told by (x, y, size) as parts of the width.
    fn blobs(values: &[f64], (width, height): (usize, usize)) -> Plate {
        let unit = width as f64;
        let plane = Plane::from_fn(width, height, |x, y| {
            let p = [(x as f64 + 0.5) / unit, (y as f64 + 0.5) / unit];
            let blob = |cx: f64, cy: f64| {
                let (dx, dy) = (
                    p[0] - values[0] - values[2] * cx,
                    p[1] - values[1] - values[2] * cy,
                );
                libm::exp(-(dx * dx + dy * dy) / (0.02 * values[2] * values[2]))
            };
            (0.2 + 0.5 * blob(-0.2, 0.1) + 0.4 * blob(0.25, -0.1) + 0.3 * blob(0.1, 0.2)) as f32
        });
        Plate::from_planes([plane.clone(), plane.clone(), plane])
    }

    #[test]
    fn place_and_size_of_a_drawing_are_found_again_under_another_gain_and_with_grain() {
        let truth = [0.52, 0.31, 1.1];
        let grain = |i: usize| ((i * 7919 + i * i * 31) % 101) as f32 / 101.0 - 0.5;
        let mut target = blobs(&truth, (192, 128));
        for channel in &mut target.channels {
            for (i, v) in channel.values.iter_mut().enumerate() {
                *v = 0.1 + 0.6 * *v + 0.02 * grain(i);
            }
        }
        let fit = Fit {
            target: &target,
            sizes: Fit::pyramid((192, 128)),
            steps: vec![0.003; 3],
        };
        assert_eq!(fit.sizes, [(48, 32), (96, 64), (192, 128)]);
        let mut render = |v: &[f64], size: (usize, usize)| Ok(blobs(v, size));
        let found = fit
            .run(&[0.45, 0.36, 1.0], &mut render, &mut |_, _| ())
            .unwrap();
        // Three values: beyond four standard errors by chance once in 5000 runs.
        for ((v, t), error) in found.values.iter().zip(truth).zip(&found.errors) {
            assert!((v - t).abs() < 4.0 * error && *error < 5e-3, "{found:?}");
        }
    }
}
