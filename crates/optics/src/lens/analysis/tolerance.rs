//! The yield of a lens that is made within tolerances, by Monte Carlo.

use std::f64::consts::TAU;

use ivcam_base::diag::Result;
use rayon::prelude::*;

use crate::lens::analysis::aberrations::merit::{Merit, MeritPoint, MeritSetting};
use crate::lens::lens::Lens;
use crate::prescription::changes::{Change, Quantity};
use crate::sampling::{mix, unit};

/// How a number of a made lens is distributed about its nominal value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Evenly within the tolerance.
    Uniform,
    /// Normally, with half the tolerance as standard deviation, and drawn again beyond it.
    Normal,
}

/// The tolerance of a number of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// The number of the surface, from 0.
    pub surface: usize,
    /// What varies.
    pub quantity: Quantity,
    /// The greatest difference from the nominal value, in its unit.
    pub amount: f64,
    /// How it varies within that.
    pub distribution: Distribution,
}

/// A figure of merit with limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Requirement {
    /// The focal length is between two values, in millimeters.
    FocalLength(f64, f64),
    /// The rms spot of every point is at most this, in millimeters.
    Rms(f64),
    /// The rms wavefront of every point is at most this, in waves.
    Wavefront(f64),
    /// The distortion of every point is at most this share, of either sign.
    Distortion(f64),
    /// The light of every point is at least this share of the axis's.
    Illumination(f64),
    /// The modulation of every point is at least this, tangential and sagittal, at the frequency
    /// with this number in the setting.
    Modulation(usize, f64),
}

/// The result of a Monte Carlo analysis.
#[derive(Clone, Debug)]
pub struct Yield {
    /// The figures of the nominal lens.
    pub nominal: Merit,
    /// The number of lenses that were made.
    pub trials: usize,
    /// The number of them that meet all requirements.
    pub passed: usize,
    /// The largest rms spot of each lens, in millimeters and rising order; infinite for a lens that
    /// gives no light to a point.
    pub worst_rms: Vec<f64>,
    /// For each requirement, its figure at the worst point of each lens in rising order. That of a
    /// lens that gives no light to a point is infinite, on the side that fails.
    pub worst: Vec<Vec<f64>>,
    /// For each tolerance, how many lenses of those that fail have it in the outer half of its
    /// range. By chance it is half of them for a uniform distribution and 28% for a normal one.
    pub outer: Vec<usize>,
}

impl Yield {
    /// The share of lenses that pass.
    pub fn share(&self) -> f64 {
        self.passed as f64 / self.trials as f64
    }

    /// The ends of the 95% interval of the share by Wilson's formula, which holds for shares near 0
    /// and 1 as well.
    pub fn interval(&self) -> [f64; 2] {
        const Z: f64 = 1.959_963_984_540_054;
        let (n, p) = (self.trials as f64, self.share());
        let scale = 1.0 / (1.0 + Z * Z / n);
        let middle = scale * (p + 0.5 * Z * Z / n);
        let half = scale * Z * (p * (1.0 - p) / n + 0.25 * Z * Z / (n * n)).sqrt();
        [middle - half, middle + half]
    }

    /// A quantile of the largest rms spots, in millimeters.
    pub fn rms_quantile(&self, share: f64) -> f64 {
        let last = self.worst_rms.len().saturating_sub(1);
        let at = (share * last as f64).round() as usize;
        self.worst_rms.get(at).copied().unwrap_or(f64::NAN)
    }

    /// A quantile of the figure of a requirement.
    pub fn quantile(&self, requirement: usize, share: f64) -> f64 {
        let values = self.worst.get(requirement).map_or(&[][..], |all| all);
        let at = (share * values.len().saturating_sub(1) as f64).round() as usize;
        values.get(at).copied().unwrap_or(f64::NAN)
    }
}

impl Requirement {
    /// Whether a large figure is better, as of light and modulation.
    pub fn is_least(&self) -> bool {
        matches!(self, Self::Illumination(_) | Self::Modulation(..))
    }

    /// The figure of the point that is the farthest from the requirement, and the number of that
    /// point; the focal length is of no point. None if a point has no light.
    pub fn worst(&self, merit: &Merit) -> Option<(f64, Option<usize>)> {
        let figure = |point: &MeritPoint| match *self {
            Self::FocalLength(..) => None,
            Self::Rms(_) => Some(point.rms),
            Self::Wavefront(_) => Some(point.wavefront),
            Self::Distortion(_) => point.distortion.map(f64::abs),
            Self::Illumination(_) => Some(point.illumination),
            Self::Modulation(number, _) => point
                .modulation
                .get(number)
                .map(|both| both[0].min(both[1])),
        };
        if let Self::FocalLength(..) = self {
            return Some((merit.efl, None));
        }
        let figures = merit.points.iter().map(|point| figure(point.as_ref()?));
        let figures: Vec<f64> = figures.collect::<Option<_>>()?;
        let sign = if self.is_least() { -1.0 } else { 1.0 };
        let worst = (0..figures.len()).max_by(|&i, &j| {
            let [a, b] = [i, j].map(|point| sign * figures[point]);
            a.total_cmp(&b)
        })?;
        Some((figures[worst], Some(worst)))
    }

    /// The figure of the worst point; without light, infinite on the side that fails.
    fn figure(&self, merit: Option<&Merit>) -> f64 {
        let dark = match self.is_least() {
            true => f64::NEG_INFINITY,
            false => f64::INFINITY,
        };
        let worst = merit.and_then(|merit| self.worst(merit));
        worst.map_or(dark, |(figure, _)| figure)
    }

    /// Whether a lens meets the requirement. A point without light meets none.
    pub fn is_met(&self, merit: &Merit) -> bool {
        let every = |meets: &dyn Fn(&MeritPoint) -> bool| {
            let meets = |point: &Option<_>| point.as_ref().is_some_and(meets);
            merit.points.iter().all(meets)
        };
        match *self {
            Self::FocalLength(low, high) => (low..=high).contains(&merit.efl),
            Self::Rms(most) => every(&|point| point.rms <= most),
            Self::Wavefront(most) => every(&|point| point.wavefront <= most),
            Self::Distortion(most) => {
                every(&|point| point.distortion.is_some_and(|d| d.abs() <= most))
            }
            Self::Illumination(least) => every(&|point| point.illumination >= least),
            Self::Modulation(number, least) => every(&|point| {
                let found = point.modulation.get(number);
                found.is_some_and(|both| both.iter().all(|m| *m >= least))
            }),
        }
    }
}

/// A lens made within tolerances: the changes of one trial.
fn drawn(nominal: &[f64], tolerances: &[Tolerance], trial: u64, seed: u64) -> Vec<Change> {
    let mut key = mix(mix(seed) ^ trial);
    let mut next = || {
        key = mix(key);
        unit(key)
    };
    let draw = |(value, tolerance): (&f64, &Tolerance)| {
        let share = match tolerance.distribution {
            Distribution::Uniform => 2.0 * next() - 1.0,
            Distribution::Normal => loop {
                // Box and Muller's transform. 1 − u is not 0.
                let radius = (-2.0 * libm::log(1.0 - next())).sqrt();
                let share = 0.5 * radius * libm::cos(TAU * next());
                if share.abs() <= 1.0 {
                    break share;
                }
            },
        };
        Change {
            surface: tolerance.surface,
            quantity: tolerance.quantity,
            value: value + share * tolerance.amount,
        }
    };
    std::iter::zip(nominal, tolerances).map(draw).collect()
}

/// Whether a lens passes, its largest rms spot, its figure for each requirement, and whether each
/// tolerance is in the outer half of its range.
type Trial = (bool, f64, Vec<f64>, Vec<bool>);

/// The yield of a lens. Trials are numbered, and each depends on the seed and its number alone, so
/// that the result is the same at any number of threads.
///
/// # Errors
///
/// Returns an error if a tolerance is of a surface or a number that the lens does not have, or if
/// the nominal lens has no image.
pub fn yield_of(
    lens: &Lens,
    tolerances: &[Tolerance],
    requirements: &[Requirement],
    setting: &MeritSetting,
    (trials, seed): (usize, u64),
) -> Result<Yield> {
    let missing = |what: String| ivcam_base::diag::Diagnostic::error(what);
    let prescription = lens.prescription();
    let value = |t: &Tolerance| {
        let found = prescription.value_of(t.surface, t.quantity);
        found.ok_or_else(|| missing(format!("surface {} has no such number", t.surface)))
    };
    let nominal: Vec<f64> = tolerances.iter().map(value).collect::<Result<_>>()?;
    let merit = Merit::of(lens, setting)
        .ok_or_else(|| missing(format!("`{}` has no image to describe", lens.name())))?;
    let made: Vec<Result<Trial>> = (0..trials as u64)
        .into_par_iter()
        .map(|trial| {
            let changes = drawn(&nominal, tolerances, trial, seed);
            let made = lens.with(prescription.with_changes(&changes)?);
            let merit = Merit::of(&made, setting);
            let passes = merit
                .as_ref()
                .is_some_and(|merit| requirements.iter().all(|r| r.is_met(merit)));
            let worst = requirements.iter().map(|r| r.figure(merit.as_ref()));
            let worst: Vec<f64> = worst.collect();
            let rms = merit.and_then(|merit| merit.worst_rms());
            let outer = std::iter::zip(&changes, std::iter::zip(&nominal, tolerances));
            let outer = outer.map(|(c, (value, t))| (c.value - value).abs() > 0.5 * t.amount);
            let rms = rms.unwrap_or(f64::INFINITY);
            Ok((passes, rms, worst, outer.collect()))
        })
        .collect();
    let mut result = Yield {
        nominal: merit,
        trials,
        passed: 0,
        worst_rms: Vec::with_capacity(trials),
        worst: vec![Vec::with_capacity(trials); requirements.len()],
        outer: vec![0; tolerances.len()],
    };
    for trial in made {
        let (passes, rms, worst, outer) = trial?;
        for (all, figure) in result.worst.iter_mut().zip(worst) {
            all.push(figure);
        }
        result.passed += usize::from(passes);
        result.worst_rms.push(rms);
        for (count, is_outer) in result.outer.iter_mut().zip(outer) {
            *count += usize::from(is_outer && !passes);
        }
    }
    result.worst_rms.sort_by(f64::total_cmp);
    for all in &mut result.worst {
        all.sort_by(f64::total_cmp);
    }
    Ok(result)
}
