//! Judges which of several models, such as lenses, a picture agrees with.
//!
//! The parameters of all models mean the same. One model is fitted, and the derivatives of its
//! residuals are kept. Another model then takes a few renderings: steps by the kept derivatives
//! (chord steps), which the renderings themselves correct (Broyden, Mathematics of Computation 19,
//! 1965).

use ivcam_base::diag::Result;
use ivcam_base::math::symmetric::solve;

use super::{
    BLOCK, Fit, FitLevel, Fitted, Half, Measure, NUISANCE_STEPS, Renderer, Residuals, System,
    out_of_time,
};
use crate::plane::Plane;

/// The longer side in pixels up to which models are judged.
const JUDGED_SIDE: usize = 200;
/// The number of steps at each size. With the start and a rendering by other random numbers, a
/// model takes four renderings.
const CHORD_STEPS: usize = 2;
/// The damping of the first step. The derivatives are another model's, so a step is not as good as
/// they say.
const CHORD_DAMPING: f64 = 1e-3;

/// A fitted model, with the derivatives of its residuals at two sizes.
#[derive(Clone, Debug)]
pub struct FittedModel {
    /// The fitted parameters.
    pub values: Vec<f64>,
    small: KeptDerivatives,
    large: KeptDerivatives,
    /// The detail of the target at the larger size, over its standard deviation, and one over that.
    detail: [Plane; 2],
}

impl FittedModel {
    /// Returns how many pixels the large picture has for one of the small one.
    pub fn enlargement(&self) -> f64 {
        let [small, large] = [&self.small, &self.large].map(|k| (k.size.0 * k.size.1) as f64);
        large / small
    }
}

/// The size of the picture that a model is judged by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// By a small picture and kept derivatives, with four renderings.
    Small,
    /// By a picture twice as wide and kept derivatives, with four renderings.
    Large,
}

/// The derivatives of the residuals at one size.
#[derive(Clone, Debug)]
struct KeptDerivatives {
    size: (usize, usize),
    /// The local contrast of the target, whose tones are those of the fitted model.
    target: Plane,
    columns: Vec<Residuals>,
}

/// How well a model matches a picture, at a size that is the same for all models of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelMatch {
    /// The fitted parameters.
    pub values: Vec<f64>,
    /// The mean square of the residuals of local contrast, for each block of 12 pixels. Noise of
    /// the rendering averages out.
    squares: Vec<f64>,
}

impl ModelMatch {
    /// Returns the root mean square of the residuals, without the noise of the rendering.
    pub fn residual(&self) -> f64 {
        let sum: f64 = self.squares.iter().sum();
        (sum / self.squares.len().max(1) as f64).max(0.0).sqrt()
    }

    /// Returns by how many standard errors this model matches worse than another, from the
    /// differences of blocks, which are taken to be independent. It is 0 if no block differs.
    pub fn worse_than(&self, other: &Self) -> f64 {
        let pairs = self.squares.iter().zip(&other.squares);
        let off: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let n = off.len() as f64;
        let sum: f64 = off.iter().sum();
        let variance = n / (n - 1.0) * off.iter().map(|d| (d - sum / n).powi(2)).sum::<f64>();
        if sum == 0.0 {
            0.0
        } else {
            sum / variance.sqrt()
        }
    }
}

impl Fit<'_> {
    /// Fits a model by small pictures, and keeps its derivatives.
    ///
    /// # Errors
    /// Fails if the start cannot be rendered, or if the fit has to end.
    pub fn fit_model(&self, start: &[f64], render: &mut Renderer<'_>) -> Result<FittedModel> {
        let sizes = self.judged_sizes();
        let mut values = start.to_vec();
        for size in sizes {
            let mut level = self.coarse_level(*size, render);
            values = level.refine(&values, &mut |_, _, _, _| ())?.values;
            if (self.has_to_end)() {
                return Err(out_of_time());
            }
        }
        let mut kept = |size: (usize, usize)| {
            let mut level = self.coarse_level(size, render);
            level.match_tones(&values)?;
            self.keep(&mut level, &values)
        };
        let size = sizes[sizes.len() - 1];
        let (small, large) = (kept(sizes[sizes.len().saturating_sub(2)])?, kept(size)?);
        let mut level = FitLevel::new(self, size, Measure::Detail, render);
        level.match_tones(&values)?;
        Ok(FittedModel {
            small,
            large,
            detail: [level.target, level.scale],
            values,
        })
    }

    /// Fits the detail of the large picture with all parameters, also those that change only blur,
    /// until the step is small. Only matches of the same fitted model can be compared, and only
    /// with others of this function.
    ///
    /// # Errors
    /// Fails if the start cannot be rendered, or if the fit has to end.
    pub fn match_detail(
        &self,
        base: &FittedModel,
        start: &[f64],
        render: &mut Renderer<'_>,
    ) -> Result<ModelMatch> {
        let mut level = FitLevel::new(self, base.large.size, Measure::Detail, render);
        [level.target, level.scale] = base.detail.clone();
        let mut values = start.to_vec();
        for blur in &self.blur {
            level.search(&mut values, blur.index);
        }
        let (off, _) = level.descend(&mut values, &mut |_, _, _, _| ())?;
        if (self.has_to_end)() {
            return Err(out_of_time());
        }
        values.truncate(start.len());
        Ok(ModelMatch {
            squares: level.squares(&off),
            values,
        })
    }

    /// Fits a model, such as another lens, to a picture of one of the sizes of a fitted model, by
    /// a few steps. Only matches of the same fitted model and effort can be compared.
    ///
    /// # Errors
    /// Fails if the start cannot be rendered, or if the fit has to end.
    pub fn judge(
        &self,
        base: &FittedModel,
        effort: Effort,
        start: &[f64],
        render: &mut Renderer<'_>,
    ) -> Result<ModelMatch> {
        let kept = match effort {
            Effort::Small => &base.small,
            Effort::Large => &base.large,
        };
        let mut level = self.coarse_level(kept.size, render);
        level.target = kept.target.clone();
        level.chord(kept.columns.clone(), start)
    }

    /// Fits the detail of the largest picture by which models are judged, with the parameters that
    /// change only blur.
    ///
    /// # Errors
    /// Fails if the start cannot be rendered.
    pub fn fit_detail(&self, start: &[f64], render: &mut Renderer<'_>) -> Result<Fitted> {
        let sizes = self.judged_sizes();
        let mut values = start.to_vec();
        let mut level = FitLevel::new(self, sizes[sizes.len() - 1], Measure::Detail, render);
        level.fit_from(&mut values, &mut |_, _, _, _| ())
    }

    /// Returns the sizes at which models are judged: at least the smallest.
    fn judged_sizes(&self) -> &[(usize, usize)] {
        let is_small = |s: &&(usize, usize)| s.0.max(s.1) <= JUDGED_SIDE;
        let count = self.sizes.iter().take_while(is_small).count();
        &self.sizes[..count.max(1)]
    }

    /// Returns the derivatives at a size.
    fn keep(&self, level: &mut FitLevel<'_, '_>, values: &[f64]) -> Result<KeptDerivatives> {
        let off = level.residuals(values)?;
        let columns = level.columns(values, &off);
        if (self.has_to_end)() {
            return Err(out_of_time()); // Some derivatives may not have been rendered.
        }
        Ok(KeptDerivatives {
            size: level.size,
            target: level.target.clone(),
            columns,
        })
    }
}

impl FitLevel<'_, '_> {
    /// Takes a few steps by derivatives that are nearly those of this model, and corrects them by
    /// what each step has changed. The softness of a scan or a JPEG, of which every model may have
    /// another part, is fitted and left out; its derivative needs no rendering.
    fn chord(&mut self, mut columns: Vec<Residuals>, start: &[f64]) -> Result<ModelMatch> {
        let (count, geometry) = (start.len(), self.free.len());
        let mut values = start.to_vec();
        values.extend([0.0; 2]);
        self.free.push(count + 1);
        let mut off = self.residuals(&values)?;
        let mut seen = self.last.clone();
        let mut damping = CHORD_DAMPING;
        for _ in 0..CHORD_STEPS {
            columns.truncate(geometry);
            columns.push(self.softness(&seen, &values[count..]));
            let weights = self.weights(&off);
            let system = System::of(columns, &off, &weights);
            let step = solve(&system.matrix, &system.right, damping);
            columns = system.columns;
            let Some(step) = step else { break };
            let next_values = self.moved(&values, &step);
            match self.residuals(&next_values) {
                Ok(next) => {
                    self.correct(&mut columns, (&off, &next), &step);
                    if next.cost(&weights) < off.cost(&weights) {
                        (values, off) = (next_values, next);
                        seen = self.last.clone();
                        continue;
                    }
                }
                Err(_) if (self.fit.has_to_end)() => return Err(out_of_time()),
                Err(_) => {} // Too near to focus, for example.
            }
            damping *= 100.0;
        }
        off.second = self.residuals_of(&values, Half::Second)?;
        values.truncate(count);
        Ok(ModelMatch {
            squares: self.squares(&off),
            values,
        })
    }

    /// Returns the derivative of a rendering's residuals by the softness.
    fn softness(&self, seen: &Plane, aside: &[f64]) -> Residuals {
        let step = NUISANCE_STEPS[1];
        let [more, less] = [step, -step].map(|by| {
            let first = self.off(seen, &[aside[0], aside[1] + by]);
            let second = first.clone();
            Residuals { first, second }
        });
        more.slope(&less, 2.0 * step)
    }

    /// Corrects derivatives so that they say what a step has changed (Broyden's update), with each
    /// parameter in its own unit. That of the softness, the last, is right.
    fn correct(
        &self,
        columns: &mut [Residuals],
        (before, after): (&Residuals, &Residuals),
        step: &[f64],
    ) {
        let unit = |k: usize| self.step(self.free[k]);
        let moves = step[..step.len() - 1].iter().enumerate();
        let length: f64 = moves.map(|(k, s)| (s / unit(k)).powi(2)).sum();
        if length < 1e-12 {
            return;
        }
        let said =
            |i: usize| -> f64 { columns.iter().zip(step).map(|(c, s)| c.first[i] * s).sum() };
        let missing: Vec<f64> = (0..before.first.len())
            .map(|i| after.first[i] - before.first[i] - said(i))
            .collect();
        let last = columns.len() - 1;
        for (k, column) in columns[..last].iter_mut().enumerate() {
            let share = step[k] / (unit(k) * unit(k) * length);
            for (c, m) in column.first.iter_mut().zip(&missing) {
                *c += share * m;
            }
            column.second.clone_from(&column.first);
        }
    }

    /// Returns the mean square of residuals in each block.
    fn squares(&self, off: &Residuals) -> Vec<f64> {
        let across = self.size.0.div_ceil(BLOCK);
        let mut sums = vec![(0.0, 0.0); across * self.size.1.div_ceil(BLOCK)];
        for (k, pixel) in self.inner.iter().enumerate() {
            let (x, y) = (pixel % self.size.0, pixel / self.size.0);
            let (sum, count) = &mut sums[y / BLOCK * across + x / BLOCK];
            *sum += off.first[k] * off.second[k];
            *count += 1.0;
        }
        let kept = sums.into_iter().filter(|(_, count)| *count > 0.0);
        kept.map(|(sum, count)| sum / count).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::fit::tests::{blobs, fit_of, with_grain};
    use crate::fit::{BlurParameter, Effort};
    use crate::plane::{Plane, Plate};

    /// Returns blobs that are bent outward at the sides of the picture by a share, as by the
    /// distortion of a lens.
    fn bent_blobs(values: &[f64], size: (usize, usize), bend: f64) -> Plate {
        let (width, height) = (size.0 as f64, size.1 as f64);
        blobs(values, size).map(|p| {
            Plane::from_fn(size.0, size.1, |x, y| {
                let (x, y) = (x as f64 + 0.5 - 0.5 * width, y as f64 + 0.5 - 0.5 * height);
                let bent = 1.0 + bend * (x * x + y * y) / (0.25 * width * width);
                p.sample(bent * x + 0.5 * width, bent * y + 0.5 * height)
            })
        })
    }

    /// The camera is found with a model that does not bend the picture, as by a pinhole.
    #[test]
    fn the_model_that_bends_as_the_picture_does_is_found_by_four_renderings_at_each_size() {
        let truth = [0.52, 0.31, 1.1];
        let bent = bent_blobs(&truth, (192, 128), 0.1);
        let target = with_grain(bent, |v, grain| v + 0.01 * grain);
        let fit = fit_of(&target, &|| false);
        let mut plain = |v: &[f64], size: (usize, usize), _| Ok(blobs(v, size));
        let base = fit.fit_model(&[0.5, 0.33, 1.05], &mut plain).unwrap();
        let mut renders = 0;
        let mut judged = |bend: f64| {
            let mut render = |v: &[f64], size: (usize, usize), _| {
                renders += 1;
                Ok(bent_blobs(v, size, bend))
            };
            let small = fit.judge(&base, Effort::Small, &base.values, &mut render);
            fit.judge(&base, Effort::Large, &small.unwrap().values, &mut render)
                .unwrap()
        };
        let [straight, right, near, far] = [0.0, 0.1, 0.101, 0.2].map(&mut judged);
        assert_eq!(renders, 4 * 8);
        for (i, (v, t)) in right.values.iter().zip(truth).enumerate() {
            assert!((v - t).abs() < 2e-3, "{i}: {v} {t}");
        }
        for worse in [&straight, &far] {
            let errors = worse.worse_than(&right);
            assert!(
                worse.residual() > right.residual() && errors > 3.0,
                "{errors}"
            );
        }
        assert!(
            near.worse_than(&right).abs() < 2.0,
            "{}",
            near.worse_than(&right)
        );
        assert_eq!(right.worse_than(&right), 0.0);
        // Fits of detail are of the same opinion.
        let detail = [0.1, 0.2].map(|bend| {
            let mut render = |v: &[f64], size: (usize, usize), _| Ok(bent_blobs(v, size, bend));
            fit.match_detail(&base, &right.values, &mut render).unwrap()
        });
        let errors = detail[1].worse_than(&detail[0]);
        assert!(errors > 3.0, "{errors}");
        for (v, t) in detail[0].values.iter().zip(truth) {
            assert!((v - t).abs() < 2e-3, "{v} {t}");
        }
    }

    /// A model that blurs is started at a blur that is wrong by a factor of two.
    #[test]
    fn the_right_model_is_found_though_the_picture_is_blurred_by_an_unknown_amount() {
        let soft = |v: &[f64], size: (usize, usize), bend: f64| {
            let sigma = size.0 as f64 / 192.0 * libm::exp(v[3]);
            bent_blobs(&v[..3], size, bend).map(|p| p.blurred(sigma))
        };
        let truth = [0.52, 0.31, 1.1, 0.8];
        let target = with_grain(soft(&truth, (192, 128), 0.1), |v, grain| v + 0.01 * grain);
        let mut fit = fit_of(&target, &|| false);
        fit.steps.push(0.15);
        fit.blur = vec![BlurParameter {
            index: 3,
            range: [-2.0, 2.0],
        }];
        let start = [0.5, 0.33, 1.05, 0.1];
        let mut plain = |v: &[f64], size: (usize, usize), _| Ok(soft(v, size, 0.0));
        let base = fit.fit_model(&start, &mut plain).unwrap();
        let [right, wrong] = [0.1, 0.2].map(|bend| {
            let mut render = |v: &[f64], size: (usize, usize), _| Ok(soft(v, size, bend));
            fit.match_detail(&base, &base.values, &mut render).unwrap()
        });
        assert!(
            wrong.worse_than(&right) > 3.0,
            "{}",
            wrong.worse_than(&right)
        );
        assert!((right.values[3] - 0.8).abs() < 0.1, "{:?}", right.values);
    }

    #[test]
    fn a_model_whose_time_is_over_is_not_judged() {
        let target = blobs(&[0.52, 0.31, 1.1], (96, 64));
        let left = std::cell::Cell::new(1000);
        let ended = || left.get() == 0;
        let fit = fit_of(&target, &ended);
        let mut render = |v: &[f64], size: (usize, usize), _| {
            if ended() {
                return Err(super::out_of_time());
            }
            left.set(left.get() - 1);
            Ok(blobs(v, size))
        };
        let base = fit.fit_model(&[0.5, 0.33, 1.05], &mut render).unwrap();
        for enough in 0..4 {
            left.set(enough);
            let judged = fit.judge(&base, Effort::Large, &[0.5, 0.33, 1.05], &mut render);
            assert!(judged.is_err(), "{enough} renderings");
        }
        left.set(4);
        assert!(
            fit.judge(&base, Effort::Large, &[0.5, 0.33, 1.05], &mut render)
                .is_ok()
        );
    }
}
