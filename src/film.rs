//! Adds radiance up into irradiance, and turns that into exposure and levels.
//!
//! Film is 36×24 mm with infinite fidelity, and saturates in proportion to exposure (the paper,
//! section Assumptions); `metering` and `response` are for films that do not. A pixel's sums are made in one fixed order, so that a picture has the
//! same bits at any number of threads.

mod metering;
mod response;

use glam::DVec3;

use crate::diag::{Diagnostic, Result};

pub use metering::Metering;
pub use response::{Emulsion, Response};

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
        self.mean += off * (1.0 / f64::from(self.count));
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

    /// The same, but so that the other has a given share of the mean, however many its samples are.
    pub fn join_as(&mut self, other: &Self, share: f64) {
        let (n, m) = (f64::from(self.count), f64::from(other.count));
        if n < 2.0 || m < 2.0 || (m - share * (n + m)).abs() < 1e-9 * m {
            return self.join(other);
        }
        let [a, b] = [1.0 - share, share];
        let variance = self.variance_of_mean() * a * a + other.variance_of_mean() * b * b;
        self.mean = self.mean * a + other.mean * b;
        self.count += other.count;
        self.squares = variance * (n + m) * (n + m - 1.0);
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

/// A second exposure of a pixel by other samples. It is not in the picture; the difference of
/// the two tells how wrong the first is, whatever the samples' order.
#[derive(Clone, Copy, Debug)]
pub struct Twin {
    pub pixel: u32,
    pub exposed: Exposed,
}

/// How wrong a picture is, as estimated from itself: root mean square error over its mean, and
/// the interval in which the true one lies 95 times in 100.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    pub relative_rmse: f64,
    pub low: f64,
    pub high: f64,
}

/// One pixel in so many has a twin,
const TWIN_SHARE: u64 = 32;
/// and at least so many of a picture have one, if there are as many.
const FEWEST_TWINS: u64 = 512;

/// The exposed film: row by row from the top, as the picture is seen (upright).
#[derive(Clone, Debug)]
pub struct Film {
    pub resolution: Resolution,
    pub pixels: Vec<Exposed>,
    /// In order of pixels.
    twins: Vec<Twin>,
    /// Light that comes another way than through the samples.
    pub glare: Option<Glare>,
}

/// Ghosts of lights, apart from the exposures: they have no twins, and no share in the error.
#[derive(Clone, Debug, PartialEq)]
pub struct Glare {
    /// Row by row, as levels.
    pub pixels: Vec<DVec3>,
    /// What the lights' own images would bring, as levels summed over pixels and channels.
    pub of_lights: f64,
}

impl Glare {
    pub fn new(resolution: Resolution) -> Self {
        Self {
            pixels: vec![DVec3::ZERO; resolution.pixels()],
            of_lights: 0.0,
        }
    }

    /// Levels summed over pixels and channels.
    pub fn sum(&self) -> f64 {
        self.pixels.iter().map(|p| p.element_sum()).sum()
    }

    fn scaled(&self, part: f64) -> Self {
        Self {
            pixels: self.pixels.iter().map(|p| part * *p).collect(),
            of_lights: part * self.of_lights,
        }
    }

    fn add(&mut self, other: &Self) {
        for (pixel, more) in self.pixels.iter_mut().zip(&other.pixels) {
            *pixel += more;
        }
        self.of_lights += other.of_lights;
    }
}

impl Film {
    pub fn new(resolution: Resolution) -> Self {
        Self {
            resolution,
            pixels: vec![Exposed::default(); resolution.pixels()],
            twins: Vec::new(),
            glare: None,
        }
    }

    /// Adds what another film of the same size has received, for a share of the whole. A pixel's
    /// number of samples does not say what share: it may be large where the error is.
    pub fn join(&mut self, other: &Self, share: f64) {
        self.glare = match (&self.glare, &other.glare) {
            (Some(a), Some(b)) => {
                let mut sum = a.scaled(1.0 - share);
                sum.add(&b.scaled(share));
                Some(sum)
            }
            (a, b) => a.clone().or(b.clone()),
        };
        for (pixel, more) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.join_as(more, share);
        }
        if self.twins.is_empty() {
            self.twins = other.twins.clone();
            return;
        }
        for (twin, more) in self.twins.iter_mut().zip(&other.twins) {
            twin.exposed.join_as(&more.exposed, share);
        }
    }

    /// What a pixel has received in all.
    pub fn level(&self, pixel: usize) -> DVec3 {
        let glare = self.glare.as_ref().map_or(DVec3::ZERO, |g| g.pixels[pixel]);
        self.pixels[pixel].mean + glare
    }

    /// Mean of all channels of all pixels, without glare.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().map(|p| p.mean.element_sum()).sum();
        sum / (3.0 * self.pixels.len() as f64)
    }

    /// Whether a pixel is exposed twice, to tell the error: a fixed random choice.
    pub fn has_twin(&self, pixel: u32) -> bool {
        let count = self.pixels.len() as u64;
        let wanted = (count / TWIN_SHARE).max(FEWEST_TWINS);
        crate::sampling::mix(u64::from(pixel) ^ 0x7477_696e) % count < wanted
    }

    pub fn set_twins(&mut self, mut twins: Vec<Twin>) {
        twins.sort_unstable_by_key(|t| t.pixel);
        self.twins = twins;
    }

    /// The second exposure of a pixel so far.
    pub fn twin(&self, pixel: u32) -> Exposed {
        let found = self.twins.binary_search_by_key(&pixel, |t| t.pixel);
        found.map_or(Exposed::default(), |i| self.twins[i].exposed)
    }

    /// Estimated root mean square error over the mean of the picture. `None` without twins, and
    /// for a black picture.
    pub fn relative_rmse(&self) -> Option<f64> {
        self.error().map(|e| e.relative_rmse)
    }

    /// The error of the picture.
    ///
    /// Half the squared difference of a pixel and its twin is the variance of either, on average,
    /// for any sampler. The samples' variance within the pixels, which is too large for
    /// stratified samples but known everywhere, carries it over to the whole picture: a ratio
    /// estimate. Its standard error comes from the residuals, for the twins that were drawn and
    /// for the picture that came out, and the interval is even in the logarithm.
    pub fn error(&self) -> Option<ErrorEstimate> {
        let naive = |p: &Exposed| match p.count {
            0 | 1 => 1.0, // nothing known: all pixels alike
            _ => p.variance_of_mean().element_sum(),
        };
        let pairs: Vec<(f64, f64)> = self
            .twins
            .iter()
            .map(|t| {
                let one = &self.pixels[t.pixel as usize];
                let apart = (one.mean - t.exposed.mean).length_squared();
                (0.5 * apart, 0.5 * (naive(one) + naive(&t.exposed)))
            })
            .collect();
        let (n, all) = (pairs.len() as f64, self.pixels.len() as f64);
        let measured: f64 = pairs.iter().map(|p| p.0).sum();
        let expected: f64 = pairs.iter().map(|p| p.1).sum();
        if !(n > 1.0 && measured > 0.0 && expected > 0.0) {
            return None;
        }
        let ratio = measured / expected;
        let everywhere = self.pixels.iter().map(naive).sum::<f64>() / all;
        let mse = ratio * everywhere / 3.0;
        let residual = |(d, v): &(f64, f64)| (d - ratio * v) * (d - ratio * v);
        let scatter = pairs.iter().map(residual).sum::<f64>() / (n - 1.0);
        let relative = (scatter * (1.0 / n + 1.0 / all)).sqrt() / (measured / n);
        // Half, for the error is the root of the mean square.
        let reach = libm::exp(0.5 * 1.96 * relative);
        let rmse = mse.sqrt() / self.mean();
        rmse.is_finite().then_some(ErrorEstimate {
            relative_rmse: rmse,
            low: rmse / reach,
            high: rmse * reach,
        })
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
    fn a_moment_s_share_is_not_its_number_of_samples() {
        let of = |values: &[f64]| {
            let mut pixel = Exposed::default();
            values.iter().for_each(|&v| pixel.add(DVec3::splat(v)));
            pixel
        };
        let (mut still, busy) = (of(&[1.0, 3.0]), of(&[4.0, 8.0, 4.0, 8.0]));
        let expected = (still.variance_of_mean() + busy.variance_of_mean()) / 4.0;
        still.join_as(&busy, 0.5);
        assert_eq!((still.count, still.mean.x), (6, 4.0));
        assert!((still.variance_of_mean() - expected).length() < 1e-14);
    }

    #[test]
    fn a_picture_without_a_second_exposure_says_nothing_about_its_error() {
        let mut film = Film::new(Resolution {
            width: 1,
            height: 1,
        });
        film.pixels[0].add(DVec3::ONE);
        assert_eq!(film.relative_rmse(), None);
    }

    /// Pixels of 16 samples in pairs of opposite error: the spread within a pixel is 1, the error
    /// of its mean exactly 0.1 times a known number.
    #[test]
    fn the_error_is_that_of_the_means_and_not_of_the_samples() {
        let mut film = Film::new(Resolution {
            width: 64,
            height: 32,
        });
        let offset = |key: u64| {
            if crate::sampling::mix(key) & 1 == 0 {
                0.1
            } else {
                -0.1
            }
        };
        let exposed = |key: u64| {
            let mut sum = Exposed::default();
            for i in 0..16 {
                let spread = if i % 2 == 0 { 1.0 } else { -1.0 };
                sum.add(DVec3::splat(5.0 + offset(key) + spread));
            }
            sum
        };
        for i in 0..2048 {
            film.pixels[i] = exposed(i as u64);
        }
        let twin = |pixel: u32| Twin {
            pixel,
            exposed: exposed(u64::from(pixel) + (1 << 32)),
        };
        film.set_twins((0..2048).filter(|p| film.has_twin(*p)).map(twin).collect());
        let error = film.error().unwrap();
        assert!(error.low < 0.02 && 0.02 < error.high, "{error:?}");
        assert!(error.high / error.low < 1.3, "{error:?}");
    }

    #[test]
    fn a_picture_of_no_size_is_refused() {
        assert!(Resolution::new(0, 240).is_err());
        assert!(Resolution::new(100_000, 1).is_err());
    }
}
