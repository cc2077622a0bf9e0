//! Adds radiance up into irradiance, and turns that into exposure and levels.
//!
//! Film is 36×24 mm with infinite fidelity, and saturates in proportion to exposure (the paper,
//! section Assumptions). A pixel's sums are made in one fixed order, so that a picture has the
//! same bits at any number of threads.

use glam::DVec3;

use crate::diag::{Diagnostic, Result};

/// The size of the exposed film, in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmFormat {
    pub width: f64,
    pub height: f64,
}

impl FilmFormat {
    /// 35 mm still film: the paper's.
    pub const STANDARD: Self = Self {
        width: 36.0,
        height: 24.0,
    };

    pub fn half_diagonal(self) -> f64 {
        0.5 * self.width.hypot(self.height)
    }
}

/// Pixels across and down. Ten a millimeter in 1999: 360×240.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    pub width: u32,
    pub height: u32,
}

impl Resolution {
    pub const VINTAGE: Self = Self {
        width: 360,
        height: 240,
    };
    /// A side of more pixels than this is refused: a slip of the finger, not a wish.
    pub const LIMIT: u32 = 65_536;

    /// # Errors
    /// A picture of no pixels, or one too large to be meant.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(
                Diagnostic::error(format!("a picture of {width}x{height} has no pixels"))
                    .with_help("give a size such as `--size 360x240`"),
            );
        }
        let pixels = u64::from(width) * u64::from(height);
        if width > Self::LIMIT || height > Self::LIMIT || pixels > 1 << 30 {
            return Err(
                Diagnostic::error(format!("a picture of {width}x{height} is too large"))
                    .with_help("the limit is 65536 pixels a side and 2^30 in all"),
            );
        }
        Ok(Self { width, height })
    }

    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    pub fn aspect(self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }
}

/// What a pixel has received: a running mean and sum of squared deviations of each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposed {
    pub count: u32,
    pub mean: DVec3,
    squares: DVec3,
}

impl Exposed {
    /// Adds one sample; Welford's update, which does not cancel.
    pub fn add(&mut self, value: DVec3) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / f64::from(self.count);
        self.squares += off * (value - self.mean);
    }

    /// Adds another pixel's samples (Chan, Golub and LeVeque's update).
    pub fn join(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (n, m) = (f64::from(self.count), f64::from(other.count));
        let off = other.mean - self.mean;
        self.count += other.count;
        self.mean += off * (m / (n + m));
        self.squares += other.squares + off * off * (n * m / (n + m));
    }

    /// The variance of the mean, as for independent samples: for stratified ones it is an upper
    /// bound. Infinite for fewer than two samples.
    pub fn variance_of_mean(&self) -> DVec3 {
        match self.count {
            0 | 1 => DVec3::INFINITY,
            n => self.squares / (f64::from(n) * f64::from(n - 1)),
        }
    }
}

/// The exposed film: row by row from the top, as the picture is seen (upright).
#[derive(Clone, Debug)]
pub struct Film {
    pub resolution: Resolution,
    pub pixels: Vec<Exposed>,
}

impl Film {
    pub fn new(resolution: Resolution) -> Self {
        Self {
            resolution,
            pixels: vec![Exposed::default(); resolution.pixels()],
        }
    }

    /// Adds what another film of the same size has received.
    pub fn join(&mut self, other: &Self) {
        for (pixel, more) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.join(more);
        }
    }

    /// Mean of all channels of all pixels.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().map(|p| p.mean.element_sum()).sum();
        sum / (3.0 * self.pixels.len() as f64)
    }

    /// Estimated root mean square error over the mean of the picture, from the samples' own
    /// variance. `None` for fewer than two samples a pixel, or a black picture.
    pub fn relative_rmse(&self) -> Option<f64> {
        let sum: f64 = self
            .pixels
            .iter()
            .map(|p| p.variance_of_mean().element_sum())
            .sum();
        let mse = sum / (3.0 * self.pixels.len() as f64);
        let relative = mse.sqrt() / self.mean();
        relative.is_finite().then_some(relative)
    }
}

/// How exposure becomes a level between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response {
    /// Level is proportional to exposure, then clipped: the paper's film, and the right one for
    /// Inventor's colors, which are display values.
    Linear,
    /// The sRGB transfer curve over linear light.
    Srgb,
}

impl Response {
    pub fn level(self, exposure: f64) -> f64 {
        let x = if exposure.is_finite() {
            exposure.clamp(0.0, 1.0)
        } else {
            0.0
        };
        match self {
            Self::Linear => x,
            Self::Srgb if x <= 0.003_130_8 => 12.92 * x,
            Self::Srgb => 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_the_mean_is_the_textbooks() {
        let values = [1.0, 4.0, 4.0, 7.0];
        let mut pixel = Exposed::default();
        values.iter().for_each(|&v| pixel.add(DVec3::splat(v)));
        // Mean 4, squared deviations 9 + 0 + 0 + 9, divided by 4·3.
        assert_eq!(pixel.mean.x, 4.0);
        assert!((pixel.variance_of_mean().x - 1.5).abs() < 1e-15);
    }

    #[test]
    fn samples_in_two_parts_are_the_samples_in_one() {
        let values = [0.3, 2.0, 5.5, 1.0, 4.25];
        let (mut one, mut first, mut second) = Default::default();
        let add = |pixel: &mut Exposed, v: f64| pixel.add(DVec3::splat(v));
        values.iter().for_each(|&v| add(&mut one, v));
        values[..2].iter().for_each(|&v| add(&mut first, v));
        values[2..].iter().for_each(|&v| add(&mut second, v));
        first.join(&second);
        assert_eq!(first.count, one.count);
        assert!((first.mean - one.mean).length() < 1e-14);
        assert!((first.variance_of_mean() - one.variance_of_mean()).length() < 1e-14);
    }

    #[test]
    fn one_sample_says_nothing_about_its_error() {
        let mut film = Film::new(Resolution {
            width: 1,
            height: 1,
        });
        film.pixels[0].add(DVec3::ONE);
        assert_eq!(film.relative_rmse(), None);
    }

    #[test]
    fn an_overexposed_and_an_undefined_pixel_stay_in_range() {
        assert_eq!(Response::Linear.level(3.0), 1.0);
        assert_eq!(Response::Linear.level(f64::NAN), 0.0);
        assert!((Response::Srgb.level(0.5) - 0.735_357).abs() < 1e-6);
    }

    #[test]
    fn a_picture_of_no_size_is_refused() {
        assert!(Resolution::new(0, 240).is_err());
        assert!(Resolution::new(100_000, 1).is_err());
    }
}
