//! The error of a picture, or why it is unknown.

use std::fmt;

/// The error of a picture, as estimated from its own samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Root mean square error over the mean of the picture.
    pub relative_rmse: f64,
    /// The lower end of the 95% confidence interval.
    pub low: f64,
    /// The upper end of the 95% confidence interval.
    pub high: f64,
}

impl ErrorEstimate {
    /// The error of a picture that is black because there is nothing to see: no ray was traced, and
    /// every pixel is right.
    pub const EXACT: Self = Self {
        relative_rmse: 0.0,
        low: 0.0,
        high: 0.0,
    };
}

/// Why the error of a picture is unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ErrorUnknown {
    /// The film has not been measured.
    NotMeasured,
    /// The picture is black.
    Black,
    /// The picture is denoised, so its error is not that of its samples.
    Denoised,
    /// Diffraction has spread the light of the samples, and their noise with it.
    Diffracted {
        /// The relative error of the film before.
        rays: f64,
    },
    /// The estimate has too few pairs of exposures: the picture is small, or adaptive sampling
    /// has concentrated its samples on few pixels.
    FewPairs {
        /// The number of pairs.
        pairs: usize,
    },
    /// All samples of each pixel have the same light.
    NoScatter,
    /// A few pixels carry most of the estimate's variance.
    FewPixels {
        /// The number of pixels.
        pixels: usize,
        /// Their share of the variance of the estimate.
        share: f64,
    },
    /// The mean of the picture, which the error is relative to, is not known well enough.
    UncertainMean {
        /// The relative standard error of the mean.
        relative: f64,
    },
    /// A light that is small in the picture may have been missed by all samples.
    MissedLight {
        /// The area of the light in pixels.
        pixels: f64,
        /// The level of the light over the mean of the picture.
        brightness: f64,
    },
    /// Rays were cut, because they took more steps than the limit of work allows.
    CutRays {
        /// The number of rays.
        rays: u64,
    },
}

impl fmt::Display for ErrorUnknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotMeasured => write!(f, "not measured"),
            Self::Black => write!(f, "the picture is black"),
            Self::Denoised => write!(f, "the picture is denoised"),
            Self::Diffracted { rays } => {
                let percent = 100.0 * rays;
                write!(
                    f,
                    "diffraction spreads the noise, {percent:.2}% of the rays"
                )
            }
            Self::FewPairs { pairs } => {
                write!(f, "only {pairs} pairs of exposures estimate it")
            }
            Self::NoScatter => write!(f, "all samples of each pixel are equal"),
            Self::FewPixels { pixels, share } => {
                let (noun, verb) = match pixels {
                    1 => ("pixel", "carries"),
                    _ => ("pixels", "carry"),
                };
                let share = 100.0 * share;
                write!(f, "{pixels} {noun} {verb} {share:.0}% of the variance")
            }
            Self::UncertainMean { relative } => {
                let percent = 100.0 * relative;
                write!(f, "the picture's mean is uncertain by {percent:.0}%")
            }
            Self::CutRays { rays } => write!(f, "{rays} rays were cut"),
            Self::MissedLight { pixels, brightness } => write!(
                f,
                "a light of {pixels:.1e} pixels, {brightness:.0} times as bright as the picture, \
                 may have been missed"
            ),
        }
    }
}
