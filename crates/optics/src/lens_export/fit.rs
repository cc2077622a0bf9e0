//! The camera models of OpenCV and ROS, fitted to chief rays.
//!
//! Angles are in radians from the axis, radii in pixels from the picture's middle.

use ivcam_base::diag::{Diagnostic, Result};

use crate::lens_export::series::{largest, odd_ratio, odd_series, ratio, series};
use crate::lens_export::view::{Sample, View};

/// The greatest angle at which a model of the tangent is fitted. At 89.9 degrees the tangent is
/// 573, and the coefficients of its powers are below the rounding of what they are applied to.
const STEEPEST: f64 = 1.5;

/// A camera model. All are functions of the angle alone; tangential coefficients are 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraModel {
    /// Brown and Conrady: r = f t (1 + k1 t² + k2 t⁴ + k3 t⁶), t being the angle's tangent.
    Brown,
    /// The rational model: r = f t (1 + k1 t² + k2 t⁴ + k3 t⁶)/(1 + k4 t² + k5 t⁴ + k6 t⁶).
    Rational,
    /// Kannala and Brandt: r = f θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸).
    Fisheye,
}

/// A model with the coefficients that fit a picture best.
#[derive(Clone, Debug)]
pub(crate) struct ModelFit {
    /// The model.
    pub model: CameraModel,
    /// The focal length f in pixels.
    pub focal: f64,
    /// The coefficients k1, k2, ….
    pub k: Vec<f64>,
    /// The root mean square residual over the picture, in pixels.
    pub rms: f64,
    /// The greatest residual, in pixels.
    pub max: f64,
}

/// The result of fitting every model.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The model that is exported.
    pub(crate) fit: ModelFit,
    /// Every model with its fit, or the reason why it does not fit.
    pub(crate) all: Vec<(CameraModel, std::result::Result<ModelFit, String>)>,
}

impl CameraModel {
    /// The models with the names of OpenCV and of ROS, the simplest first.
    pub(crate) const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Brown, "brown", "plumb_bob"),
        (Self::Rational, "rational", "rational_polynomial"),
        (Self::Fisheye, "fisheye", "equidistant"),
    ];

    /// The model of a name of OpenCV or of ROS.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.iter();
        all.find(|(_, a, b)| name == *a || name == *b)
            .map(|(model, ..)| *model)
    }

    /// The name in messages and in files for OpenCV.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// The name in files for ROS.
    pub(crate) fn ros_name(self) -> &'static str {
        Self::ALL[self as usize].2
    }

    /// The radius over the focal length at an angle.
    pub(crate) fn radius(self, k: &[f64], angle: f64) -> f64 {
        match self {
            Self::Fisheye => angle * series(k, angle * angle),
            Self::Brown | Self::Rational => {
                let t = libm::tan(angle);
                t * ratio(k, t * t)
            }
        }
    }

    /// Fits the model to a picture. Fails with the reason if no residual of at most `tolerance`
    /// pixels can be had.
    fn fit(self, samples: &[Sample], tolerance: f64) -> std::result::Result<ModelFit, String> {
        let widest = samples.iter().map(|s| s.angle).fold(0.0, f64::max);
        if self != Self::Fisheye && widest > STEEPEST {
            return Err(format!(
                "the field reaches {:.2} degrees from the axis, and the model ends before 90",
                widest.to_degrees()
            ));
        }
        let of_tangent = |s: &Sample| (libm::tan(s.angle), s.radius);
        let points: Vec<(f64, f64)> = match self {
            Self::Fisheye => samples.iter().map(|s| (s.angle, s.radius)).collect(),
            _ => samples.iter().map(of_tangent).collect(),
        };
        let (focal, k) = match self {
            Self::Brown => odd_series(&points, 3),
            Self::Rational => odd_ratio(&points),
            Self::Fisheye => odd_series(&points, 4),
        }
        .ok_or("its coefficients cannot be determined")?;
        let mut fit = ModelFit {
            model: self,
            focal,
            k,
            rms: 0.0,
            max: 0.0,
        };
        let off = |s: &Sample| (fit.radius(s.angle) - s.radius).abs();
        let off: Vec<f64> = samples.iter().map(off).collect();
        fit.rms = (off.iter().map(|o| o * o).sum::<f64>() / off.len() as f64).sqrt();
        // A pole between samples leaves NaN or a large number at one of them.
        fit.max = largest(off);
        if !(fit.max <= tolerance) {
            return Err(format!(
                "the best coefficients leave {:.3} pixels at most ({:.3} rms), more than {tolerance}",
                fit.max, fit.rms
            ));
        }
        if !fit.is_monotonic(widest) {
            return Err("the best coefficients map two angles to one radius".to_owned());
        }
        Ok(fit)
    }
}

impl ModelFit {
    /// The radius in pixels at an angle.
    pub(crate) fn radius(&self, angle: f64) -> f64 {
        self.focal * self.model.radius(&self.k, angle)
    }

    /// Whether the radius grows with the angle, so that the model can be inverted.
    fn is_monotonic(&self, widest: f64) -> bool {
        const STEPS: u32 = 1000;
        let at = |i: u32| self.radius(widest * f64::from(i) / f64::from(STEPS));
        self.focal > 0.0 && (0..STEPS).all(|i| at(i + 1) > at(i))
    }

    /// The coefficients in OpenCV's order: k1, k2, p1, p2, k3, k4, …, or k1 to k4 of a fish-eye.
    pub(crate) fn coefficients(&self) -> Vec<f64> {
        match self.model {
            CameraModel::Fisheye => self.k.clone(),
            _ => [&self.k[..2], &[0.0, 0.0], &self.k[2..]].concat(),
        }
    }
}

impl Chosen {
    /// Fits all models and takes one, or the first that fits.
    ///
    /// # Errors
    ///
    /// Returns an error with the reason of each if the model, or every one, leaves a residual of
    /// more than `tolerance` pixels.
    pub fn of(view: &View<'_>, model: Option<CameraModel>, tolerance: f64) -> Result<Self> {
        let samples = view.samples();
        let fit = |(model, ..): &(CameraModel, _, _)| (*model, model.fit(&samples, tolerance));
        let all: Vec<_> = CameraModel::ALL.iter().map(fit).collect();
        let wanted = |(m, _): &&(CameraModel, _)| model.is_none_or(|model| model == *m);
        let chosen = all
            .iter()
            .filter(wanted)
            .find_map(|(_, fit)| fit.clone().ok());
        if let Some(fit) = chosen {
            return Ok(Self { fit, all });
        }
        let reason = |(model, fit): &(CameraModel, std::result::Result<ModelFit, String>)| match fit
        {
            Ok(fit) => format!("{} fits within {:.3} pixels", model.name(), fit.max),
            Err(reason) => format!("{}: {reason}", model.name()),
        };
        let failed = all
            .iter()
            .filter(wanted)
            .map(reason)
            .collect::<Vec<_>>()
            .join("; ");
        let fitting: Vec<_> = all
            .iter()
            .filter(|(_, fit)| fit.is_ok())
            .map(reason)
            .collect();
        let help = match fitting.first() {
            Some(other) => other.clone(),
            None => "an exact map is `--export stmap`; --residual PIXELS allows a larger residual"
                .to_owned(),
        };
        let name = view.lens.name();
        Err(
            Diagnostic::error(format!("`{name}` does not fit the camera model {failed}"))
                .with_help(help),
        )
    }
}
