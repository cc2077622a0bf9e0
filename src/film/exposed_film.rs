//! The exposed film: every pixel's samples, the ghosts of lights, and the estimated error.

use glam::DVec3;

use super::format::Resolution;
use super::pixel::Exposed;
use super::region::Region;
use crate::sampling::mix;

/// A second exposure of a pixel with independent samples. It is not part of the picture; the
/// difference of the two exposures estimates the error of the first for any sampler.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Twin {
    pub pixel: u32,
    pub exposed: Exposed,
}

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

/// One pixel in this many has a twin. The twins take about 3% of the time.
const TWIN_SHARE: u64 = 32;
/// The smallest number of twins in a picture with at least as many pixels. It bounds the width of
/// the confidence interval of small pictures.
const FEWEST_TWINS: u64 = 512;

/// The exposed film, row by row from the top of the upright picture.
#[derive(Clone, Debug)]
pub struct Film {
    /// The size of the picture in pixels.
    pub resolution: Resolution,
    /// The exposure of each pixel, without ghosts.
    pub(crate) pixels: Vec<Exposed>,
    /// The twins in order of pixels.
    twins: Vec<Twin>,
    /// The ghosts of lights, which are not traced by the pixels' samples.
    pub(crate) ghosts: Option<GhostImage>,
}

/// The ghosts of lights. They are kept apart from the exposures because they have no twins and are
/// not part of the error estimate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GhostImage {
    /// The level of each pixel, row by row.
    pub pixels: Vec<DVec3>,
    /// The light that the lights' own images would have, as levels summed over pixels and channels.
    pub of_lights: f64,
}

impl GhostImage {
    /// Returns an image without light.
    pub(crate) fn new(resolution: Resolution) -> Self {
        Self {
            pixels: vec![DVec3::ZERO; resolution.pixels()],
            of_lights: 0.0,
        }
    }

    /// Returns the sum of levels over pixels and channels.
    pub(crate) fn sum(&self) -> f64 {
        self.pixels.iter().map(|p| p.element_sum()).sum()
    }

    /// Returns the part of the image in a region of its picture. The light of the lights' own
    /// images is still that of the picture.
    pub(crate) fn cut(&self, region: Region, picture: Resolution) -> Self {
        Self {
            pixels: region.cut(&self.pixels, picture),
            of_lights: self.of_lights,
        }
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
    /// Returns an unexposed film.
    pub(crate) fn new(resolution: Resolution) -> Self {
        Self {
            resolution,
            pixels: vec![Exposed::default(); resolution.pixels()],
            twins: Vec::new(),
            ghosts: None,
        }
    }

    /// Returns the part of the film in a region, without ghosts, as a film of its own.
    pub(crate) fn cut(&self, region: Region) -> Self {
        let Resolution { width, .. } = self.resolution;
        let twin = |twin: &Twin| {
            let (x, y) = region.locate((twin.pixel % width, twin.pixel / width))?;
            Some(Twin {
                pixel: y * region.width + x,
                ..*twin
            })
        };
        Self {
            resolution: region.resolution(),
            pixels: region.cut(&self.pixels, self.resolution),
            twins: self.twins.iter().filter_map(twin).collect(),
            ghosts: None,
        }
    }

    /// Adds the exposure of another film of the same size, with a share of the sum. The share is
    /// not the ratio of a pixel's sample counts, because adaptive sampling changes those by pixel.
    pub(crate) fn join(&mut self, other: &Self, share: f64) {
        self.ghosts = match (&self.ghosts, &other.ghosts) {
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

    /// Returns the level of a pixel, ghosts included.
    pub fn level(&self, pixel: usize) -> DVec3 {
        let ghosts = self
            .ghosts
            .as_ref()
            .map_or(DVec3::ZERO, |g| g.pixels[pixel]);
        self.pixels[pixel].mean + ghosts
    }

    /// Returns the number of samples of a pixel.
    pub(crate) fn samples(&self, pixel: usize) -> u32 {
        self.pixels[pixel].count
    }

    /// Returns the standard error of a pixel's channels, from the scatter of its samples: that of
    /// independent samples, and an upper bound for stratified ones. It is infinite for fewer than
    /// two samples.
    pub(crate) fn standard_error(&self, pixel: usize) -> DVec3 {
        let variance = self.pixels[pixel].variance_of_mean();
        DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt())
    }

    /// Returns the mean of all channels of all pixels, without ghosts.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().map(|p| p.mean.element_sum()).sum();
        sum / (3.0 * self.pixels.len() as f64)
    }

    /// Returns whether a pixel has a twin. The choice is random but the same for every render.
    pub(crate) fn has_twin(&self, pixel: u32) -> bool {
        let count = self.pixels.len() as u64;
        let wanted = (count / TWIN_SHARE).max(FEWEST_TWINS);
        mix(u64::from(pixel) ^ 0x7477_696e) % count < wanted
    }

    /// Replaces the twins.
    pub(crate) fn set_twins(&mut self, mut twins: Vec<Twin>) {
        twins.sort_unstable_by_key(|t| t.pixel);
        self.twins = twins;
    }

    /// Returns the twin of a pixel; it is empty before the first pass.
    pub(crate) fn twin(&self, pixel: u32) -> Exposed {
        let found = self.twins.binary_search_by_key(&pixel, |t| t.pixel);
        found.map_or(Exposed::default(), |i| self.twins[i].exposed)
    }

    /// Returns the estimated root mean square error over the mean of the picture, or `None` for a
    /// film without twins and for a black picture.
    pub fn relative_rmse(&self) -> Option<f64> {
        self.error().map(|e| e.relative_rmse)
    }

    /// Estimates the error of the picture, or returns `None` for a film without twins and for a
    /// black picture.
    ///
    /// Half the squared difference of a pixel and its twin has the expectation of the pixel's
    /// variance, for any sampler. The sample variance within pixels is too large for stratified
    /// samples but is known for all pixels; a ratio estimator with it as the auxiliary variable
    /// extends the measurement from the twins to the whole picture. The standard error comes from
    /// the residuals of the twins and of the picture, and the interval is symmetric in the
    /// logarithm.
    pub fn error(&self) -> Option<ErrorEstimate> {
        let naive = |p: &Exposed| match p.count {
            0 | 1 => 1.0, // The variance is unknown, so all pixels get equal weight.
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
        // The factor is half, because the error is the root of the mean square.
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
    fn a_picture_without_twins_has_no_error_estimate() {
        let mut film = Film::new(Resolution {
            width: 1,
            height: 1,
        });
        film.pixels[0].add(DVec3::ONE);
        assert_eq!(film.relative_rmse(), None);
    }

    /// Each pixel has 16 samples whose spread is 1, and a mean that is off by 0.1 either way. The
    /// relative error of the picture is therefore 0.1 / 5.
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
