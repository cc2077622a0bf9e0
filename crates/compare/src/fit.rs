//! Finds the parameters whose rendering matches an archival picture best.
//!
//! This module does not use cameras. A caller gives start values, a step size for each, and a
//! function that renders. The Levenberg-Marquardt method minimizes the robust difference of local
//! contrast, from small pictures to large ones; gain, gamma and lighting hardly change that. At
//! full size it then minimizes the difference of detail, which also depends on blur.
//!
//! A rendering is noisy, and the squared noise of a difference depends on the blur, so least
//! squares would be biased. At full size the parameters are therefore rendered twice with
//! independent random numbers, and the residuals of one rendering are multiplied with those of the
//! other, so that the noise averages out. Derivatives are differences of renderings with the same
//! random numbers.

mod models;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::math::symmetric::solve;

pub use models::{Effort, FittedModel, ModelMatch};

use crate::chance;
use crate::contrast::{contrast, detail};
use crate::metric::Mask;
use crate::plane::{Plane, Plate};
use crate::search::SEARCHED;
use crate::tone::{self, Matching};

/// Renders parameters at a size in pixels. The last argument selects the random numbers.
pub type Renderer<'r> = dyn FnMut(&[f64], (usize, usize), Half) -> Result<Plate> + 'r;

/// One of two renderings of the same parameters with independent random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// The rendering that steps are computed from.
    First,
    /// The rendering whose residuals those of the first are multiplied with.
    Second,
}

/// The largest number of iterations at each size. Most sizes end after [`USUAL_ITERATIONS`], when a
/// step is small or gains little, so it bounds the time of the others.
/// `a_disturbed_camera_is_found_again_from_a_noisy_jpeg` tests that it is enough for a camera 5 cm
/// and 2.9 degrees off.
const MOST_ITERATIONS: usize = 12;
/// The standard deviation of the blur before contrast is computed, in pixels.
const SIGMA: f64 = 1.0;
/// The standard deviation of the blur before detail is computed, in pixels.
const SIGMA_FINE: f64 = 0.5;
/// The width of the border that is left out, in pixels.
const MARGIN: usize = 2;
/// The standard deviation in pixels of the neighborhood whose mean residual determines a weight. A
/// weight from the pixel's own residual would depend on its noise, and noisy pixels would count
/// less.
const NEIGHBORS: f64 = 3.0;
/// The part by which the scatter of gradients is enlarged along each, so that it has an inverse if
/// there are fewer blocks than parameters.
const FEW_BLOCKS: f64 = 1e-6;
/// The step sizes of two nuisance parameters at full size. The first is the logarithm of a gain on
/// the rendering, because tones were matched at another blur; a gain on the target would be biased
/// by its grain. The second is the variance, in square pixels, of the blur of a scan or a JPEG
/// beyond the rendering's.
const NUISANCE_STEPS: [f64; 2] = [0.05, 0.1];
/// The side in pixels of the blocks whose residuals are taken to be independent of each other.
const BLOCK: usize = 12;
/// The largest change of a parameter for a derivative, in its step sizes.
const LONGEST: f64 = 8.0;
/// The largest number of steps that are taken at the end without asking whether the cost falls.
const LAST_STEPS: usize = 2;
/// The part of a standard error below which a step is not taken any more.
const SMALL_STEP: f64 = 0.2;
/// The standard errors above which a step is not taken if the cost has not fallen along it.
const LARGE_STEP: f64 = 4.0;
/// The interval of the second nuisance parameter in square pixels: from the sharpest picture that
/// can be matched to a scan that is blurred by two pixels.
const SOFTNESS: [f64; 2] = [-0.21, 4.0];
/// The number of steps to either side in the search for a parameter of blur.
const SEARCH: i32 = 6;

/// The number of iterations that most sizes need, for the expected amount of work.
const USUAL_ITERATIONS: usize = 6;
/// The number of iterations by which starts are judged.
const TRIAL_ITERATIONS: usize = 3;

/// The state of a fit after a step that improved it.
pub struct FitStep<'a> {
    /// The size of the rendering in pixels.
    pub size: (usize, usize),
    /// The best values so far.
    pub values: &'a [f64],
    /// The robust mean square of the residuals.
    pub cost: f64,
    /// The number of renderings that are expected to follow.
    pub renders_left: f64,
    /// The pixels of these renderings.
    pub pixels_left: f64,
    /// Whether the fit has finished this size.
    pub size_finished: bool,
}

/// The target of a fit, and its settings.
pub struct Fit<'a> {
    /// The archival picture.
    pub target: &'a Plate,
    /// The sizes to render at, from small to large.
    pub sizes: Vec<(usize, usize)>,
    /// For each parameter, a change that moves the largest rendering by about half a pixel.
    pub steps: Vec<f64>,
    /// The parameters that change only blur.
    pub blur: Vec<BlurParameter>,
    /// The pixels of the largest rendering that count; `None` is all.
    pub mask: Option<&'a Mask>,
    /// Returns whether the fit has to end with its best values so far. Once it does, renders fail.
    pub has_to_end: &'a dyn Fn() -> bool,
}

/// A parameter that changes only blur. Small pictures and local contrast do not determine it, and a
/// picture in which everything is about equally sharp does not either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlurParameter {
    /// The index among the parameters.
    pub index: usize,
    /// The least and the largest value. The fit does not leave the interval. A value that the
    /// picture does not determine is taken to be anywhere in it with the same probability.
    pub range: [f64; 2],
}

impl BlurParameter {
    /// Returns the mean squared distance between `value` and the truth, if only the interval is
    /// known.
    pub fn variance_about(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        (high - low).powi(2) / 12.0 + (value - 0.5 * (low + high)).powi(2)
    }

    fn contains(&self, value: f64) -> bool {
        (self.range[0]..=self.range[1]).contains(&value)
    }
}

/// The result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The parameters.
    pub values: Vec<f64>,
    /// The covariance of the values, row by row, from the residuals, which are taken to be
    /// independent between blocks of 12 pixels, and from the intervals of the parameters that
    /// change only blur. It is infinite if the others are not determined. It includes the square of
    /// the step that is left to go. If the fit ended early it is that of the last complete
    /// iteration.
    pub covariance: Vec<f64>,
    /// The robust mean square of the residuals at the largest size.
    pub cost: f64,
    /// The number of renderings.
    pub renders: usize,
    /// Whether the fit ended before it had converged at every size.
    pub ended_early: bool,
}

impl Fitted {
    /// Returns the standard error of a linear combination of the values with these factors.
    pub fn error_of(&self, factors: &[(usize, f64)]) -> f64 {
        let n = self.values.len();
        let term = |(i, a): (usize, f64), (j, b): (usize, f64)| a * b * self.covariance[i * n + j];
        let all = factors.iter();
        let sum: f64 = all.flat_map(|x| factors.iter().map(|y| term(*x, *y))).sum();
        if sum.is_nan() {
            f64::INFINITY
        } else {
            sum.max(0.0).sqrt()
        }
    }

    /// Returns the standard error of one value.
    pub fn error(&self, i: usize) -> f64 {
        self.error_of(&[(i, 1.0)])
    }
}

/// The quantity in which two pictures are compared.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Measure {
    /// Detail over its standard deviation in the same picture, which gain, gamma and lighting do
    /// not change.
    Contrast,
    /// Detail over its standard deviation in the target. It is linear in the rendering, so that
    /// noise averages out and blur has an effect.
    Detail,
}

/// The differences of two renderings of the same parameters from the target.
#[derive(Clone, Debug)]
struct Residuals {
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Residuals {
    fn mean(&self, i: usize) -> f64 {
        0.5 * (self.first[i] + self.second[i])
    }

    fn means(&self) -> Vec<f64> {
        (0..self.first.len()).map(|i| self.mean(i)).collect()
    }

    /// Returns the weighted mean of the products, in which the renderings' noise averages out.
    fn cost(&self, weights: &[f64]) -> f64 {
        let products = self.first.iter().zip(&self.second).zip(weights);
        let sum: f64 = products.map(|((a, b), w)| w * a * b).sum();
        sum / weights.len().max(1) as f64
    }

    /// Returns the difference quotient of `self` and `other`.
    fn slope(&self, other: &Self, run: f64) -> Self {
        let one = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) / run).collect();
        Self {
            first: one(&self.first, &other.first),
            second: one(&self.second, &other.second),
        }
    }

    /// Adds a multiple of `other`.
    fn add(&mut self, other: &Self, factor: f64) {
        let halves = [
            (&mut self.first, &other.first),
            (&mut self.second, &other.second),
        ];
        for (a, b) in halves {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
        }
    }

    fn scaled(mut self, factor: f64) -> Self {
        let values = self.first.iter_mut().chain(&mut self.second);
        values.for_each(|v| *v *= factor);
        self
    }
}

/// A fit at one size.
struct FitLevel<'f, 'r> {
    fit: &'f Fit<'f>,
    size: (usize, usize),
    measure: Measure,
    /// The largest number of iterations.
    iterations: usize,
    /// The parameters that may change.
    free: Vec<usize>,
    /// The changes of parameters along which derivatives are taken, in step sizes. Each has one
    /// more parameter, and those before it compensate that as far as they can. All change the
    /// picture by about as much. Where there is none, a parameter changes alone.
    directions: Vec<Vec<f64>>,
    target: Plane,
    /// One over the standard deviation of the target's detail, for [`Measure::Detail`].
    scale: Plane,
    /// 1 at pixels that count and 0 at others; `None` if all count.
    counts: Option<Plane>,
    /// The indices of the pixels that count and are not in the border.
    inner: Vec<usize>,
    render: &'f mut Renderer<'r>,
    renders: usize,
    /// The brightness of the last rendering.
    last: Plane,
}

/// Receives the values, their cost, the number of renderings at this size, and whether the size is
/// finished.
type StepReport<'r> = dyn FnMut(&[f64], f64, usize, bool) + 'r;

/// The errors of the free parameters, and the step to their most probable values.
struct Estimate {
    /// The covariance, row by row.
    covariance: Vec<Vec<f64>>,
    step: Vec<f64>,
}

/// The normal equations over the free parameters, row by row.
struct System {
    /// The matrix from the mean of both renderings. Noise makes it too large, and keeps it positive
    /// definite.
    matrix: Vec<f64>,
    /// The matrix from products of the two renderings, which is unbiased.
    unbiased: Vec<f64>,
    right: Vec<f64>,
    columns: Vec<Residuals>,
}

impl Fit<'_> {
    /// Returns sizes from about 48 pixels on the longer side up to this one, each double the last.
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

    /// Returns the cost of parameters at the smallest size, to choose among starts.
    ///
    /// # Errors
    /// Fails if rendering fails.
    pub fn cost_of(&self, values: &[f64], render: &mut Renderer<'_>) -> Result<f64> {
        let mut level = FitLevel::new(self, self.sizes[0], Measure::Contrast, render);
        let off = level.residuals(values)?;
        Ok(off.cost(&vec![1.0; off.first.len()]))
    }

    /// Returns the expected number of renderings at each size; the last size is done twice.
    fn expected_renders(&self) -> Vec<f64> {
        let columns = 2 * self.steps.len() + 2;
        let renders = ((USUAL_ITERATIONS + 1) * columns) as f64;
        // The fine measure renders everything twice.
        let fine = self.sizes.last().map(|_| 2.0 * renders);
        self.sizes.iter().map(|_| renders).chain(fine).collect()
    }

    /// Returns a bound on the probability that a picture of something else agrees as well with the
    /// rendering of fitted values. All that the fit may have tried counts.
    pub fn chance(&self, values: &[f64], rendering: &Plate) -> f64 {
        // A step moves the largest rendering by half a pixel.
        let longer = rendering.width.max(rendering.height) as f64;
        let pixel = 2.0 * (longer / chance::LEVELS[0]).max(1.0);
        let moves: Vec<f64> = values
            .iter()
            .zip(&self.steps)
            .map(|(v, s)| v / (s * pixel))
            .collect();
        let pictures = [&rendering.luma(), &self.target.luma()];
        let counts = self.counts((rendering.width, rendering.height));
        SEARCHED.chance_of_fit(pictures, &moves, counts.as_ref())
    }

    /// Takes a few steps from each start at the smallest size, and returns where the one with the
    /// least cost ended. Starts that cannot be rendered are left out; `None` if none can.
    pub fn best_start(&self, starts: &[Vec<f64>], render: &mut Renderer<'_>) -> Option<Vec<f64>> {
        let tried = starts.iter().filter_map(|start| {
            let mut level = self.coarse_level(self.sizes[0], render);
            level.iterations = TRIAL_ITERATIONS;
            level.refine(start, &mut |_, _, _, _| ()).ok()
        });
        let best = tried.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(best.values)
    }

    /// Returns 1 at the pixels of a size that count, and 0 at the others; `None` if all count.
    fn counts(&self, (width, height): (usize, usize)) -> Option<Plane> {
        let mask = self.mask?;
        let whole = Plane::from_fn(mask.width, mask.height, |x, y| {
            f32::from(u8::from(mask.counts[y * mask.width + x]))
        });
        // A pixel of a smaller picture counts if all that it is made of does.
        let counts = whole.resized(width, height);
        Some(counts.map(|c| f32::from(u8::from((c - 1.0).abs() < 0.01))))
    }

    fn coarse_level<'f, 'r>(
        &'f self,
        size: (usize, usize),
        render: &'f mut Renderer<'r>,
    ) -> FitLevel<'f, 'r> {
        let mut level = FitLevel::new(self, size, Measure::Contrast, render);
        level.free.retain(|i| self.blur(*i).is_none());
        level
    }

    /// Returns what is known of a parameter that changes only blur; `None` for others.
    fn blur(&self, index: usize) -> Option<BlurParameter> {
        let softness = BlurParameter {
            index: self.steps.len() + 1,
            range: SOFTNESS,
        };
        let mut all = self.blur.iter().copied().chain([softness]);
        all.find(|blur| blur.index == index)
    }

    /// Refines the parameters, and calls `report` after every step that improves them. If the fit
    /// has to end, the result has the best values so far.
    ///
    /// # Errors
    /// Fails if the start cannot be rendered.
    pub fn run(
        &self,
        start: &[f64],
        render: &mut Renderer<'_>,
        report: &mut dyn FnMut(&FitStep<'_>),
    ) -> Result<Fitted> {
        let count = start.len();
        let mut fitted = Fitted {
            values: start.to_vec(),
            covariance: vec![f64::INFINITY; count * count],
            cost: f64::INFINITY,
            renders: 0,
            ended_early: false,
        };
        let expected = self.expected_renders();
        let coarse = self.sizes.iter().map(|s| (*s, Measure::Contrast));
        let fine = self.sizes.last().map(|s| (*s, Measure::Detail));
        let levels: Vec<_> = coarse.chain(fine).collect();
        let pixels = |i: usize| (levels[i].0.0 * levels[i].0.1) as f64;
        let mut directions = Vec::new();
        for (i, (size, measure)) in levels.iter().copied().enumerate() {
            let mut report_step = |values: &[f64], cost: f64, renders: usize, finished: bool| {
                let here = (expected[i] - renders as f64).max(0.05 * expected[i]);
                let here = if finished { 0.0 } else { here };
                let later = i + 1..levels.len();
                report(&FitStep {
                    size,
                    values,
                    cost,
                    renders_left: here + later.clone().map(|k| expected[k]).sum::<f64>(),
                    pixels_left: here * pixels(i)
                        + later.map(|k| expected[k] * pixels(k)).sum::<f64>(),
                    size_finished: finished,
                });
            };
            let mut level = FitLevel::new(self, size, measure, render);
            if measure == Measure::Contrast {
                level.free.retain(|i| self.blur(*i).is_none());
            }
            level.directions = std::mem::take(&mut directions);
            let done = level.fit_from(&mut fitted.values, &mut report_step);
            directions = std::mem::take(&mut level.directions);
            let renders = fitted.renders + level.renders;
            match done {
                Ok(mut done) => {
                    if done.ended_early && done.covariance.iter().all(|c| c.is_infinite()) {
                        done.covariance = std::mem::take(&mut fitted.covariance);
                    }
                    fitted = Fitted { renders, ..done };
                }
                Err(_) if (self.has_to_end)() => {
                    fitted.renders = renders;
                    fitted.ended_early = true;
                }
                Err(error) => return Err(error),
            }
            if fitted.ended_early {
                break;
            }
            report_step(&fitted.values, fitted.cost, level.renders, true);
        }
        Ok(fitted)
    }
}

impl<'f, 'r> FitLevel<'f, 'r> {
    fn new(
        fit: &'f Fit<'f>,
        size: (usize, usize),
        measure: Measure,
        render: &'f mut Renderer<'r>,
    ) -> Self {
        let luma = fit.target.luma().resized(size.0, size.1);
        let counts = fit.counts(size);
        let mut this = Self {
            inner: inner_pixels(size, counts.as_ref()),
            counts,
            fit,
            size,
            measure,
            iterations: MOST_ITERATIONS,
            free: (0..fit.steps.len()).collect(),
            directions: Vec::new(),
            scale: luma.clone(),
            target: luma.clone(),
            last: luma.clone(),
            render,
            renders: 0,
        };
        this.set_target(&luma);
        this
    }

    /// Searches for the blur if the measure depends on it, and iterates.
    fn fit_from(&mut self, values: &mut [f64], report: &mut StepReport<'_>) -> Result<Fitted> {
        if self.measure == Measure::Detail && !self.fit.blur.is_empty() {
            self.match_tones(values)?;
            for blur in &self.fit.blur {
                self.search(values, blur.index);
            }
        }
        self.refine(values, report)
    }

    /// Sets the target from a picture of its brightness.
    fn set_target(&mut self, luma: &Plane) {
        match self.measure {
            Measure::Contrast => self.target = contrast(luma, SIGMA, self.counts.as_ref()),
            Measure::Detail => {
                let (off, spread) = detail(luma, SIGMA_FINE, self.counts.as_ref());
                self.scale = spread.map(|s| 1.0 / (s + 0.02));
                self.target = off.zip(&self.scale, |v, s| v * s);
            }
        }
    }

    fn draw(&mut self, values: &[f64], half: Half) -> Result<Plane> {
        let mut blur = self.fit.blur.iter();
        if blur.any(|blur| !blur.contains(values[blur.index])) {
            return Err(Diagnostic::error("a parameter is outside of its interval"));
        }
        self.renders += 1;
        let parameters = &values[..self.fit.steps.len()];
        Ok((self.render)(parameters, self.size, half)?.luma())
    }

    /// Returns the residuals of both renderings, without the border.
    fn residuals(&mut self, values: &[f64]) -> Result<Residuals> {
        let first = self.residuals_of(values, Half::First)?;
        let second = match self.measure {
            Measure::Contrast => first.clone(),
            Measure::Detail => self.residuals_of(values, Half::Second)?,
        };
        Ok(Residuals { first, second })
    }

    /// Returns the residuals of one rendering.
    fn residuals_of(&mut self, values: &[f64], half: Half) -> Result<Vec<f64>> {
        let luma = self.draw(values, half)?;
        let aside = values.get(self.fit.steps.len()..).unwrap_or_default();
        let off = self.off(&luma, aside);
        self.last = luma;
        Ok(off)
    }

    /// Returns the residuals of a rendering's brightness, at values of the nuisance parameters.
    fn off(&self, luma: &Plane, aside: &[f64]) -> Vec<f64> {
        let gain = libm::exp(aside.first().copied().unwrap_or_default());
        let softer = aside.get(1).copied().unwrap_or_default();
        let sigma = |least: f64| (least * least + softer).max(0.04).sqrt();
        let counts = self.counts.as_ref();
        let seen = match self.measure {
            Measure::Contrast => contrast(luma, sigma(SIGMA), counts),
            Measure::Detail => {
                let (off, _) = detail(luma, sigma(SIGMA_FINE), counts);
                off.zip(&self.scale, |v, s| v * s)
            }
        };
        let off = |i: usize| gain * f64::from(seen.values[i]) - f64::from(self.target.values[i]);
        self.inner.iter().copied().map(off).collect()
    }

    /// Matches the target's tones to a rendering, because contrast near the noise depends on the
    /// gain.
    fn match_tones(&mut self, values: &[f64]) -> Result<()> {
        if self.inner.is_empty() {
            return Ok(());
        }
        let seen = self.draw(values, Half::First)?;
        let old = self.fit.target.luma().resized(self.size.0, self.size.1);
        let gray = |p: &Plane| Plate::from_planes([p.clone(), p.clone(), p.clone()]);
        let mask = Mask {
            width: self.size.0,
            height: self.size.1,
            counts: match &self.counts {
                Some(counts) => counts.values.iter().map(|c| *c > 0.5).collect(),
                None => vec![true; seen.values.len()],
            },
        };
        let [tone, ..] = tone::fit(&gray(&seen), &gray(&old), &mask, Matching::Channel);
        self.set_target(&old.map(|v| tone.apply(v)));
        Ok(())
    }

    /// Tries one parameter over a wide range, and keeps the value with the least cost.
    fn search(&mut self, values: &mut [f64], which: usize) {
        let Ok(here) = self.residuals(values) else {
            return;
        };
        let weights = self.weights(&here);
        let mut best = (here.cost(&weights), values[which]);
        for step in -SEARCH..=SEARCH {
            let mut moved = values.to_vec();
            moved[which] += f64::from(step) * self.fit.steps[which];
            let cost = self.residuals(&moved).map(|off| off.cost(&weights));
            if let Ok(cost) = cost
                && cost < best.0
            {
                best = (cost, moved[which]);
            }
        }
        values[which] = best.1;
    }

    /// Iterates from start values, and estimates the covariance.
    fn refine(&mut self, start: &[f64], report: &mut StepReport<'_>) -> Result<Fitted> {
        self.match_tones(start)?;
        let mut values = start.to_vec();
        let (mut off, so_far) = self.descend(&mut values, report)?;
        let (weights, covariance) = self.finish(&mut values, &mut off);
        values.truncate(start.len());
        let ended_early = (self.fit.has_to_end)();
        Ok(Fitted {
            cost: off.cost(&weights),
            covariance: if ended_early { so_far } else { covariance },
            values,
            renders: 0,
            ended_early,
        })
    }

    /// Iterates until the step is small, and returns the residuals with the covariance of the last
    /// complete iteration. Nuisance parameters are appended to the values.
    fn descend(
        &mut self,
        values: &mut Vec<f64>,
        report: &mut StepReport<'_>,
    ) -> Result<(Residuals, Vec<f64>)> {
        let count = values.len();
        if self.measure == Measure::Detail {
            // Without a focus parameter to separate them, blur would be confused with size.
            let aside = if self.fit.blur.is_empty() { 1 } else { 2 };
            for _ in 0..aside {
                self.free.push(values.len());
                values.push(0.0);
            }
        }
        let mut off = self.residuals(values)?;
        let mut damping = 1e-2;
        let mut so_far = vec![f64::INFINITY; count * count];
        for _ in 0..self.iterations {
            let weights = self.weights(&off);
            let system = self.linearized(values, &off, &weights);
            if (self.fit.has_to_end)() {
                break; // Some derivatives may not have been rendered.
            }
            so_far = self.covariance(self.estimate(values, &system, &off, &weights));
            let before = off.cost(&weights);
            let mut better = None;
            while better.is_none() && damping < 1e5 {
                let Some(step) = self.step_within(values, &system, damping) else {
                    break;
                };
                let next = self.moved(values, &step);
                // Parameters that cannot be rendered (too near to focus) are rejected.
                better = self
                    .residuals(&next)
                    .ok()
                    .filter(|o| o.cost(&weights) < before)
                    .map(|o| (next, o, step));
                damping *= if better.is_some() { 0.2 } else { 8.0 };
            }
            let Some((next, next_off, step)) = better else {
                break;
            };
            let small = step
                .iter()
                .zip(&self.free)
                .all(|(s, i)| s.abs() < 0.02 * self.step(*i));
            let gained = (before - next_off.cost(&weights)) / before.abs().max(1e-12);
            (*values, off) = (next, next_off);
            report(&values[..count], off.cost(&weights), self.renders, false);
            damping = damping.max(1e-6);
            if small || gained < 1e-4 {
                break;
            }
        }
        Ok((off, so_far))
    }

    /// Goes on by the steps that the unbiased equations ask for, and returns the weights and the
    /// covariance with what is left to go. The cost is too rough to judge steps of a few errors:
    /// every sample that crosses an edge changes it.
    fn finish(&mut self, values: &mut Vec<f64>, off: &mut Residuals) -> (Vec<f64>, Vec<f64>) {
        let mut left = match self.measure {
            Measure::Contrast => 0,
            Measure::Detail => LAST_STEPS,
        };
        loop {
            let weights = self.weights(off);
            let system = self.linearized(values, off, &weights);
            let estimate = self.estimate(values, &system, off, &weights);
            // The largest part of the step, in standard errors.
            let all = self.fit.steps.len();
            let largest = estimate.iter().flat_map(|Estimate { covariance, step }| {
                let parts = step.iter().enumerate();
                let parts = parts.filter(|(k, _)| self.free[*k] < all);
                parts.map(|(k, s)| s.abs() / covariance[k][k].sqrt())
            });
            let largest = largest.fold(0.0, f64::max);
            let is_taken = left > 0 && (SMALL_STEP..LARGE_STEP).contains(&largest);
            let step = estimate.as_ref().filter(|_| is_taken);
            let next = step.map(|estimate| self.moved(values, &estimate.step));
            let next_off = next.as_ref().and_then(|next| self.residuals(next).ok());
            let (Some(next), Some(next_off)) = (next, next_off) else {
                return (weights, self.covariance(estimate));
            };
            (*values, *off) = (next, next_off);
            left -= 1;
        }
    }

    /// Returns the step to the least cost by the biased equations, within the intervals: a value
    /// that would leave its own is held at the end. None if the equations are singular.
    fn step_within(&self, values: &[f64], system: &System, damping: f64) -> Option<Vec<f64>> {
        let n = self.free.len();
        let (mut matrix, mut right) = (system.matrix.clone(), system.right.clone());
        loop {
            let step = solve(&matrix, &right, damping)?;
            let beyond = self.free.iter().enumerate().find_map(|(k, i)| {
                let next = values[*i] + step[k];
                let [low, high] = self.fit.blur(*i)?.range;
                let end = next.clamp(low, high);
                // Not one that is held, up to rounding.
                ((next - end).abs() > 1e-9 * (high - low)).then_some((k, end - values[*i]))
            });
            let Some((held, by)) = beyond else {
                return Some(step);
            };
            for k in 0..n {
                right[k] -= by * matrix[held.max(k) * n + held.min(k)];
                matrix[held.max(k) * n + held.min(k)] = 0.0;
            }
            matrix[held * (n + 1)] = 1.0;
            right[held] = (1.0 + damping) * by;
        }
    }

    /// Returns the step size of a parameter at this size.
    fn step(&self, i: usize) -> f64 {
        // A smaller picture needs larger steps for the same effect.
        let largest = self.fit.sizes.last().map_or(1, |s| s.0);
        let coarse = largest as f64 / self.size.0 as f64;
        match i.checked_sub(self.fit.steps.len()) {
            Some(aside) => NUISANCE_STEPS[aside],
            None => coarse * self.fit.steps[i],
        }
    }

    /// Returns Huber's weights: 1 up to 1.345 standard deviations, estimated by the median, and
    /// falling beyond.
    fn weights(&self, off: &Residuals) -> Vec<f64> {
        let means = off.means();
        let mut squares = self.target.map(|_| 0.0);
        for (i, r) in self.inner.iter().copied().zip(&means) {
            squares.values[i] = (r * r) as f32;
        }
        let around = squares.blurred(NEIGHBORS);
        let local = |i: usize| f64::from(around.values[i]).max(0.0).sqrt();
        let sizes: Vec<f64> = self.inner.iter().copied().map(local).collect();
        let mut sorted = sizes.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
        let width = (1.345 * median).clamp(0.02, 2.0);
        sizes
            .iter()
            .map(|r| (width / r.max(width)).min(1.0))
            .collect()
    }

    fn moved(&self, values: &[f64], step: &[f64]) -> Vec<f64> {
        let mut moved = values.to_vec();
        for (i, s) in self.free.iter().zip(step) {
            moved[*i] += s;
        }
        moved
    }

    /// Returns the normal equations at parameters.
    fn linearized(&mut self, values: &[f64], off: &Residuals, weights: &[f64]) -> System {
        let system = System::of(self.columns(values, off), off, weights);
        self.set_directions(&system);
        system
    }

    /// Sets the directions of the next derivatives. A difference over half a pixel is not linear
    /// where the picture is fine. Where parameters nearly compensate each other, as distance and
    /// focal length do, errors of differences along each would hide what remains.
    fn set_directions(&mut self, system: &System) {
        let n = self.free.len();
        let is_sharp = |i: &&usize| **i < self.fit.steps.len() && self.fit.blur(**i).is_none();
        let count = self.free.iter().take_while(is_sharp).count();
        let in_steps = |matrix: &[f64]| -> Vec<f64> {
            let step = |i: usize| self.step(self.free[i]);
            let entry = |i: usize, j: usize| matrix[i.max(j) * n + i.min(j)] * step(i) * step(j);
            let entries = (0..count * count).map(|k| entry(k / count, k % count));
            entries.collect()
        };
        let matrix = in_steps(&system.matrix);
        let mut squares: Vec<f64> = (0..count).map(|i| matrix[i * (count + 1)]).collect();
        squares.sort_by(f64::total_cmp);
        let found = conjugate(&in_steps(&system.unbiased), count);
        let Some(mut directions) = found.or_else(|| conjugate(&matrix, count)) else {
            return;
        };
        for direction in &mut directions {
            let longest = direction.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            // Half the change of the picture that a usual step makes.
            let length = (0.5 * squares[count / 2].sqrt()).min(LONGEST / longest);
            direction.iter_mut().for_each(|v| *v *= length);
        }
        self.directions = directions;
    }

    /// Returns the derivatives of the residuals by the free parameters.
    fn columns(&mut self, values: &[f64], off: &Residuals) -> Vec<Residuals> {
        let mut columns: Vec<Residuals> = Vec::new();
        for k in 0..self.free.len() {
            let alone = || (0..=k).map(|j| f64::from(u8::from(j == k))).collect();
            let direction = self.directions.get(k).cloned().unwrap_or_else(alone);
            let steps = direction.iter().zip(&self.free);
            let steps: Vec<f64> = steps.map(|(d, i)| d * self.step(*i)).collect();
            let mut column = self.derivative(values, off, &steps);
            for (other, step) in columns.iter().zip(&steps) {
                column.add(other, -step);
            }
            columns.push(column.scaled(1.0 / steps[k]));
        }
        columns
    }

    /// Returns the change of the residuals by a change of the first free parameters, from a central
    /// difference, or a one-sided one if only one side can be rendered.
    fn derivative(&mut self, values: &[f64], off: &Residuals, steps: &[f64]) -> Residuals {
        let mut side = |by: f64| {
            let steps: Vec<f64> = steps.iter().map(|s| by * s).collect();
            self.residuals(&self.moved(values, &steps)).ok()
        };
        match (side(1.0), side(-1.0)) {
            (Some(high), Some(low)) => high.slope(&low, 2.0),
            (Some(high), None) => high.slope(off, 1.0),
            (None, Some(low)) => off.slope(&low, 1.0),
            (None, None) => off.slope(off, 1.0),
        }
    }

    /// Returns the covariance of all parameters about the next step, which includes what is left to
    /// go; infinite without an estimate.
    fn covariance(&self, estimate: Option<Estimate>) -> Vec<f64> {
        let all = self.fit.steps.len();
        let mut out = vec![f64::INFINITY; all * all];
        let Some(Estimate { covariance, step }) = estimate else {
            return out;
        };
        let reported = || self.free.iter().enumerate().filter(|(_, a)| **a < all);
        for (i, a) in reported() {
            for (j, b) in reported() {
                out[a * all + b] = covariance[i][j] + step[i] * step[j];
            }
        }
        out
    }

    /// Returns the errors of the free parameters, with those of blur free within what is known of
    /// them. None if the picture does not determine the others.
    ///
    /// The sandwich estimate of the covariance is H⁻¹ S H⁻¹, where S sums the squared gradients of
    /// blocks. It includes everything that is correlated within a block: the grain of a JPEG, or a
    /// wrong model. Where the picture does not determine its blur, H is singular, and noise makes
    /// its least eigenvalue negative as often as not. The information H S⁻¹ H is finite for any H,
    /// so the inverse of the variances that the intervals allow is added to it.
    fn estimate(
        &self,
        values: &[f64],
        system: &System,
        off: &Residuals,
        weights: &[f64],
    ) -> Option<Estimate> {
        let n = self.free.len();
        // In units in which the biased matrix has a diagonal of 1.
        let unit = |k: usize| match system.matrix[k * (n + 1)] {
            square if square > 0.0 => square.sqrt(),
            _ => 1.0,
        };
        let units: Vec<f64> = (0..n).map(unit).collect();
        let entries = |entry: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
            (0..n * n).map(|k| entry(k / n, k % n)).collect()
        };
        let hessian =
            entries(&|i, j| system.unbiased[i.max(j) * n + i.min(j)] / (units[i] * units[j]));
        let is_blur = |k: &usize| self.fit.blur(self.free[*k]).is_some();
        let sharp: Vec<usize> = (0..n).filter(|k| !is_blur(k)).collect();
        let row = |i: &usize| {
            sharp
                .iter()
                .map(|j| hessian[*i * n + *j])
                .collect::<Vec<_>>()
        };
        let rows = sharp.iter().flat_map(row);
        solve(&rows.collect::<Vec<_>>(), &vec![0.0; sharp.len()], 0.0)?;
        let pulls = self.pulls(system, off, weights);
        let blocks = pulls.len() as f64;
        let few = blocks / (blocks - n as f64).max(1.0);
        let mut scatter = entries(&|i, j| {
            let sum: f64 = pulls.iter().map(|pull| pull[i] * pull[j]).sum();
            few * sum / (units[i] * units[j])
        });
        // The variance of a residual, so that the scatter is about 1 too.
        let variance = (0..n).map(|k| scatter[k * (n + 1)]).sum::<f64>() / n as f64;
        let variance = variance.max(f64::MIN_POSITIVE);
        scatter.iter_mut().for_each(|s| *s /= variance);
        let column = |j: usize| (0..n).map(|i| hessian[i * n + j]).collect::<Vec<_>>();
        let weighted: Option<Vec<Vec<f64>>> = (0..n)
            .map(|j| solve(&scatter, &column(j), FEW_BLOCKS))
            .collect();
        let weighted = weighted?;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let information = entries(&|i, j| {
            let known = self.fit.blur(self.free[i]).filter(|_| i == j);
            let known = known.map_or(0.0, |blur| {
                variance / (blur.variance_about(values[self.free[i]]) * units[i] * units[i])
            });
            dot(&column(i), &weighted[j]) + known
        });
        let right: Vec<f64> = system
            .right
            .iter()
            .zip(&units)
            .map(|(r, u)| r / u)
            .collect();
        let right: Vec<f64> = weighted.iter().map(|column| dot(column, &right)).collect();
        let covariance = (0..n).map(|i| {
            let one: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
            let row = solve(&information, &one, 0.0)?.into_iter().zip(&units);
            Some(row.map(|(c, u)| variance * c / (u * units[i])).collect())
        });
        let step = solve(&information, &right, 0.0)?;
        Some(Estimate {
            covariance: covariance.collect::<Option<_>>()?,
            step: step.iter().zip(&units).map(|(s, u)| s / u).collect(),
        })
    }

    /// Returns the gradients of the cost by the free parameters, of each block that counts.
    fn pulls(&self, system: &System, off: &Residuals, weights: &[f64]) -> Vec<Vec<f64>> {
        let across = self.size.0.div_ceil(BLOCK);
        let blocks = across * self.size.1.div_ceil(BLOCK);
        let mut pulls = vec![vec![]; blocks];
        for (k, pixel) in self.inner.iter().copied().enumerate() {
            let (x, y) = (pixel % self.size.0, pixel / self.size.0);
            let pull: &mut Vec<f64> = &mut pulls[y / BLOCK * across + x / BLOCK];
            pull.resize(self.free.len(), 0.0);
            for (p, column) in pull.iter_mut().zip(&system.columns) {
                *p += weights[k] * column.mean(k) * off.mean(k);
            }
        }
        pulls.retain(|pull| !pull.is_empty());
        pulls
    }
}

/// Returns the error of a rendering that is asked for when the fit has to end.
pub fn out_of_time() -> Box<Diagnostic> {
    Diagnostic::error("the time of the fit is over")
}

/// Returns vectors that a symmetric matrix makes orthogonal and of length 1, by Gram and Schmidt's
/// method: the k-th has k entries. None if the matrix is not positive definite.
fn conjugate(matrix: &[f64], n: usize) -> Option<Vec<Vec<f64>>> {
    let product = |v: &[f64], j: usize| -> f64 {
        let terms = v.iter().enumerate().map(|(i, v)| v * matrix[i * n + j]);
        terms.sum()
    };
    let mut found: Vec<Vec<f64>> = Vec::new();
    for k in 0..n {
        let mut v = vec![0.0; k + 1];
        v[k] = 1.0;
        for other in &found {
            let along = product(other, k);
            v.iter_mut().zip(other).for_each(|(v, o)| *v -= along * o);
        }
        let square: f64 = (0..=k).map(|j| v[j] * product(&v, j)).sum();
        if !(square > 1e-9 * matrix[k * (n + 1)]) {
            return None;
        }
        found.push(v.iter().map(|v| v / square.sqrt()).collect());
    }
    Some(found)
}

/// Returns the indices of the pixels of a size that count, without its border.
fn inner_pixels((width, height): (usize, usize), counts: Option<&Plane>) -> Vec<usize> {
    let inner = |n: usize| MARGIN.min(n / 4)..n - MARGIN.min(n / 4);
    let row = |y: usize| inner(width).map(move |x| y * width + x);
    let is_counted = |i: &usize| counts.is_none_or(|c| c.values[*i] > 0.5);
    inner(height).flat_map(row).filter(is_counted).collect()
}

impl System {
    /// Returns the equations of derivatives, for residuals and their weights.
    fn of(columns: Vec<Residuals>, off: &Residuals, weights: &[f64]) -> Self {
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            let terms = a.iter().zip(b).zip(weights);
            terms.map(|((a, b), w)| w * a * b).sum()
        };
        // The first rendering's derivative times the second's residual, and the reverse.
        let crossed = |a: &Residuals, b: &Residuals| {
            0.5 * (dot(&a.first, &b.second) + dot(&a.second, &b.first))
        };
        let n = columns.len();
        let mut matrix = vec![0.0; n * n];
        let mut unbiased = matrix.clone();
        let means: Vec<Vec<f64>> = columns.iter().map(Residuals::means).collect();
        for i in 0..n {
            for j in 0..=i {
                matrix[i * n + j] = dot(&means[i], &means[j]);
                unbiased[i * n + j] = crossed(&columns[i], &columns[j]);
            }
        }
        Self {
            right: columns.iter().map(|c| -crossed(c, off)).collect(),
            matrix,
            unbiased,
            columns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns blobs at a position (x, y) with a size, as fractions of the width.
    pub(super) fn blobs(values: &[f64], (width, height): (usize, usize)) -> Plate {
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

    /// Returns a drawing with grain: `mix` has a pixel's value and its grain, from −0.5 to 0.5.
    pub(super) fn with_grain(mut drawing: Plate, mix: impl Fn(f32, f32) -> f32) -> Plate {
        let grain = |i: usize| ((i * 7919 + i * i * 31) % 101) as f32 / 101.0 - 0.5;
        for channel in &mut drawing.channels {
            for (i, v) in channel.values.iter_mut().enumerate() {
                *v = mix(*v, grain(i));
            }
        }
        drawing
    }

    /// Returns the fit of place and size to a drawing.
    pub(super) fn fit_of<'a>(target: &'a Plate, has_to_end: &'a dyn Fn() -> bool) -> Fit<'a> {
        let plane = &target.channels[0];
        Fit {
            target,
            sizes: Fit::pyramid((plane.width, plane.height)),
            steps: vec![0.003; 3],
            blur: Vec::new(),
            mask: None,
            has_to_end,
        }
    }

    #[test]
    fn place_and_size_of_a_drawing_are_found_again_under_another_gain_and_with_grain() {
        let truth = [0.52, 0.31, 1.1];
        let target = with_grain(blobs(&truth, (192, 128)), |v, grain| {
            0.1 + 0.6 * v + 0.02 * grain
        });
        let fit = fit_of(&target, &|| false);
        assert_eq!(fit.sizes, [(48, 32), (96, 64), (192, 128)]);
        let mut render = |v: &[f64], size: (usize, usize), _| Ok(blobs(v, size));
        let mut left = Vec::new();
        let found = fit
            .run(&[0.45, 0.36, 1.0], &mut render, &mut |step| {
                left.push((step.renders_left, step.pixels_left));
            })
            .unwrap();
        assert!(
            left.is_sorted_by(|a, b| a >= b) && left.last() == Some(&(0.0, 0.0)),
            "{left:?}"
        );
        assert!(!found.ended_early);
        // One of three values exceeds four standard errors by chance once in 5,000 runs.
        for (i, (v, t)) in found.values.iter().zip(truth).enumerate() {
            let error = found.error(i);
            assert!((v - t).abs() < 4.0 * error && error < 5e-3, "{found:?}");
        }
    }

    /// Two walls with fine patterns at distances that differ by 15%: a longer focal length from
    /// farther away makes nearly the same picture. One step of the position moves it by two pixels,
    /// as of a scene that is nearer than the start says.
    #[test]
    fn distance_and_focal_length_are_found_with_errors_that_hold_the_truth_from_any_start() {
        let walls = |values: &[f64], (width, height): (usize, usize)| {
            let plane = Plane::from_fn(width, height, |x, y| {
                let depth = if y < height / 2 { 1.0 } else { 1.15 };
                let scale = libm::exp(-values[1]) * (depth + values[0]) / depth;
                let place = |n: usize, of: usize| (n as f64 + 0.5 - 0.5 * of as f64) / width as f64;
                let (u, v) = (place(x, width) * scale, place(y, height) * scale);
                let (a, b) = (
                    libm::sin(170.0 * u + 40.0 * v),
                    libm::sin(90.0 * u - 150.0 * v),
                );
                (0.5 + 0.15 * a + 0.1 * b + 0.1 * libm::sin(30.0 * u)) as f32
            });
            Plate::from_planes([plane.clone(), plane.clone(), plane])
        };
        let target = with_grain(walls(&[0.0; 2], (192, 128)), |v, grain| v + 0.1 * grain);
        let mut fit = fit_of(&target, &|| false);
        fit.sizes = vec![(192, 128)];
        fit.steps = vec![4.0 / 192.0, 1.0 / 192.0];
        let found = [[0.0, 0.0], [0.06, 0.055], [-0.06, -0.055]].map(|start| {
            let mut render = |v: &[f64], size: (usize, usize), _| Ok(walls(v, size));
            fit.run(&start, &mut render, &mut |_| ()).unwrap()
        });
        for found in &found {
            for (i, v) in found.values.iter().enumerate() {
                assert!(v.abs() < 3.0 * found.error(i), "{found:?}");
                assert!(found.error(i) < 0.02, "{found:?}");
            }
        }
    }

    /// The parameter of blur enlarges the picture a little, as focus does through a real lens, and
    /// does nothing else, so that the picture determines only a combination of it and the size.
    #[test]
    fn what_a_picture_does_not_show_is_free_in_its_interval_in_the_errors_of_the_rest() {
        let drawn = |v: &[f64], size| blobs(&[v[0], v[1], v[2] * libm::exp(0.02 * v[3])], size);
        let truth = [0.52, 0.31, 1.1, 2.0];
        let target = with_grain(drawn(&truth, (96, 64)), |v, grain| v + 0.02 * grain);
        let mut fit = fit_of(&target, &|| false);
        fit.steps.push(0.5);
        let blur = BlurParameter {
            index: 3,
            range: [-1.0, 3.0],
        };
        fit.blur.push(blur);
        let mut render = |v: &[f64], size: (usize, usize), _| Ok(drawn(v, size));
        let found = fit.run(&[0.5, 0.33, 1.05, 0.0], &mut render, &mut |_| ());
        let found = found.unwrap();
        let free = blur.variance_about(found.values[3]).sqrt();
        assert!(blur.contains(found.values[3]));
        assert!((found.error(3) / free - 1.0).abs() < 0.1, "{found:?}");
        let size = 0.02 * found.values[2] * free;
        assert!((found.error(2) / size - 1.0).abs() < 0.1, "{found:?}");
        for (i, (v, t)) in found.values.iter().zip(truth).enumerate() {
            assert!((v - t).abs() < 3.0 * found.error(i), "{i}: {found:?}");
        }
    }

    #[test]
    fn the_nearest_of_several_starts_is_the_best_one() {
        let target = blobs(&[0.52, 0.31, 1.1], (96, 64));
        let fit = fit_of(&target, &|| false);
        let starts = [[0.2, 0.6, 0.7], [0.5, 0.33, 1.05], [0.8, 0.1, 1.6]].map(|s| s.to_vec());
        let mut render = |v: &[f64], size: (usize, usize), _| Ok(blobs(v, size));
        let best = fit.best_start(&starts, &mut render).unwrap();
        let off = |v: &[f64]| (v[0] - 0.52).abs() + (v[1] - 0.31).abs() + (v[2] - 1.1).abs();
        assert!(off(&best) < 0.3 * off(&starts[1]), "{best:?}");
    }

    /// The old picture shows other things beyond a part of it, as that of a room that is modeled
    /// in part.
    #[test]
    fn pixels_that_do_not_count_have_no_effect() {
        let truth = [0.52, 0.31, 1.1];
        let size = (192, 128);
        let counts = |x: usize, y: usize| x < 150 && y > 12;
        let mask = Mask {
            width: size.0,
            height: size.1,
            counts: (0..size.0 * size.1)
                .map(|i| counts(i % size.0, i / size.0))
                .collect(),
        };
        let plain = blobs(&truth, size);
        let target = plain.map(|p| {
            Plane::from_fn(size.0, size.1, |x, y| match counts(x, y) {
                true => p.at(x, y),
                false => ((x * 7 + y * 5) / 16 % 3) as f32 / 3.0,
            })
        });
        let found = |mask: Option<&Mask>| {
            let fit = Fit {
                target: &target,
                sizes: Fit::pyramid(size),
                steps: vec![0.003; 3],
                blur: Vec::new(),
                mask,
                has_to_end: &|| false,
            };
            let mut render = |v: &[f64], size: (usize, usize), _| Ok(blobs(v, size));
            let found = fit.run(&[0.5, 0.33, 1.05], &mut render, &mut |_| ());
            let found = found.unwrap();
            let chance = fit.chance(&found.values, &plain);
            let off = found.values.iter().zip(truth).map(|(v, t)| (v - t).abs());
            (off.fold(0.0, f64::max), chance)
        };
        let (off, chance) = found(Some(&mask));
        let (whole_off, whole_chance) = found(None);
        assert!(off < 1e-4 && whole_off > 10.0 * off, "{off} {whole_off}");
        assert!(chance < whole_chance, "{chance} {whole_chance}");
    }

    #[test]
    fn a_fit_that_has_to_end_keeps_its_best_values_with_errors_that_hold_the_truth() {
        let truth = [0.52, 0.31, 1.1];
        let target = blobs(&truth, (96, 64));
        let left = std::cell::Cell::new(40);
        let ended = || left.get() == 0;
        let fit = Fit {
            target: &target,
            sizes: Fit::pyramid((96, 64)),
            steps: vec![0.003; 3],
            blur: Vec::new(),
            mask: None,
            has_to_end: &ended,
        };
        let mut render = |v: &[f64], size: (usize, usize), _| {
            if ended() {
                return Err(ivcam_base::diag::Diagnostic::error("the time is over"));
            }
            left.set(left.get() - 1);
            Ok(blobs(v, size))
        };
        let start = [0.45, 0.36, 1.0];
        let mut reported = start.to_vec();
        let found = fit
            .run(&start, &mut render, &mut |step| {
                reported = step.values.to_vec();
            })
            .unwrap();
        assert!(found.ended_early && found.renders >= 40, "{found:?}");
        assert_eq!(found.values, reported);
        for (i, (v, t)) in found.values.iter().zip(truth).enumerate() {
            assert!((v - t).abs() < 4.0 * found.error(i), "{i}: {found:?}");
        }
        let off = |v: &[f64]| (v[0] - truth[0]).abs() + (v[1] - truth[1]).abs();
        assert!(off(&found.values) < 0.5 * off(&start), "{found:?}");
    }
}
