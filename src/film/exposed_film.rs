//! The exposed film: every pixel's samples, light that comes another way, and the error.

use glam::DVec3;

use super::format::Resolution;
use super::pixel::Exposed;
use crate::sampling::mix;

/// A second exposure of a pixel by other samples. It is not in the picture; the difference of
/// the two tells how wrong the first is, whatever the samples' order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Twin {
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
    pub(crate) fn new(resolution: Resolution) -> Self {
        Self {
            resolution,
            pixels: vec![Exposed::default(); resolution.pixels()],
            twins: Vec::new(),
            glare: None,
        }
    }

    /// Adds what another film of the same size has received, for a share of the whole. A pixel's
    /// number of samples does not say what share: it may be large where the error is.
    pub(crate) fn join(&mut self, other: &Self, share: f64) {
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
    pub(crate) fn has_twin(&self, pixel: u32) -> bool {
        let count = self.pixels.len() as u64;
        let wanted = (count / TWIN_SHARE).max(FEWEST_TWINS);
        mix(u64::from(pixel) ^ 0x7477_696e) % count < wanted
    }

    pub(crate) fn set_twins(&mut self, mut twins: Vec<Twin>) {
        twins.sort_unstable_by_key(|t| t.pixel);
        self.twins = twins;
    }

    /// The second exposure of a pixel so far.
    pub(crate) fn twin(&self, pixel: u32) -> Exposed {
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
            if mix(key) & 1 == 0 { 0.1 } else { -0.1 }
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
}
