//! The exposed film: every pixel's samples, the ghosts of lights, and the estimated error.

use std::borrow::Cow;

use glam::DVec3;

use super::draw_probability::expected_errors;
use super::error::{ErrorEstimate, ErrorUnknown};
use super::format::Resolution;
use super::ghost_image::GhostImage;
use super::pixel::Exposed;
use super::squared_error::SquaredError;

/// The exposed film, row by row from the top of the upright picture.
#[derive(Clone, Debug)]
pub struct Film {
    /// The size of the picture in pixels.
    pub resolution: Resolution,
    /// The exposure of each pixel, without ghosts.
    pub pixels: Vec<Exposed>,
    /// The estimated error, if it was measured.
    pub squared_error: Option<SquaredError>,
    /// The ghosts of lights, which are not traced by the pixels' samples.
    pub ghosts: Option<GhostImage>,
    /// The squared error of each pixel that the samples of joined films let expect; empty for a
    /// film that is not joined. The differences of joined films are no part of it.
    expected: Vec<f32>,
}

impl Film {
    /// Returns an unexposed film.
    pub fn new(resolution: Resolution) -> Self {
        Self::of_pixels(resolution, vec![Exposed::default(); resolution.pixels()])
    }

    /// Returns a film with exposed pixels, without an estimated error and without ghosts.
    pub fn of_pixels(resolution: Resolution, pixels: Vec<Exposed>) -> Self {
        Self {
            resolution,
            pixels,
            squared_error: None,
            ghosts: None,
            expected: Vec::new(),
        }
    }

    /// Adds the exposure of another film of the same size, with a share of the sum. The share is
    /// not the ratio of a pixel's sample counts, because adaptive sampling changes those by pixel.
    pub fn join(&mut self, other: &Self, share: f64) {
        self.ghosts = match (&self.ghosts, &other.ghosts) {
            (Some(a), Some(b)) => Some(a.join(b, share)),
            (a, b) => a.clone().or(b.clone()),
        };
        if let (Some(a), Some(b)) = (self.squared_error, other.squared_error) {
            let [own, others] = [self.expected_errors(), other.expected_errors()];
            let overlap = self.overlap(&own, other, &others) * (a.sum() * b.sum()).max(0.0);
            let [p, q] = [(1.0 - share).powi(2), share.powi(2)].map(|weight| weight as f32);
            let both = own.iter().zip(&*others);
            self.expected = both.map(|(a, b)| p * a + q * b).collect();
            self.squared_error = Some(a.join(&b, share, overlap));
        } else {
            self.squared_error = None;
        }
        for (pixel, more) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.join_as(more, share);
        }
    }

    /// Returns the sum over pixels of the products of the squared errors of two films, each with
    /// the sum 1, from the errors that are expected of their pixels.
    ///
    /// Those of single samples are in part their differences from their neighbors, beside an edge
    /// too. So they are at most what the scatter of the samples of both films lets expect.
    fn overlap(&self, own: &[f32], other: &Self, others: &[f32]) -> f64 {
        let (mut sums, mut products) = ([0.0; 2], 0.0);
        let expected = own.iter().zip(others).map(|(a, b)| [*a, *b].map(f64::from));
        let pixels = self.pixels.iter().zip(&other.pixels);
        for ([a, b], expected) in pixels.map(|(a, b)| [a, b]).zip(expected) {
            let mut both = *a;
            both.join(b);
            let of_sample = both.variance_of_mean().element_sum() * f64::from(both.count);
            let [a, b] = [(a, expected[0]), (b, expected[1])]
                .map(|(pixel, error)| error.min(of_sample / f64::from(pixel.count.max(1))));
            sums = [sums[0] + a, sums[1] + b];
            products += a * b;
        }
        let overlap = products / (sums[0] * sums[1]);
        match overlap.is_finite() {
            true => overlap,
            false => 1.0 / own.len() as f64, // Nothing tells where the errors are.
        }
    }

    /// Returns the squared error of each pixel that the samples let expect.
    fn expected_errors(&self) -> Cow<'_, [f32]> {
        match self.expected.is_empty() {
            true => Cow::Owned(expected_errors(&self.pixels, self.resolution)),
            false => Cow::Borrowed(&self.expected),
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

    /// Returns the linear exposure values of all pixels, ghosts included, row by row.
    pub fn levels(&self) -> Vec<[f32; 3]> {
        let level = |i| self.level(i).as_vec3().to_array();
        (0..self.pixels.len()).map(level).collect()
    }

    /// Returns what [`Film::levels`] returns. The memory of the film is released from its end while
    /// the levels are made, so that little more than the film is in memory at any moment.
    pub fn into_levels(mut self) -> Vec<[f32; 3]> {
        const PARTS: usize = 16;
        let all = self.pixels.len();
        // Memory of zeros is taken from the system only when it is written.
        let mut levels = vec![[0.0; 3]; all];
        for part in (0..PARTS).rev() {
            let start = all * part / PARTS;
            for (level, i) in levels[start..].iter_mut().zip(start..self.pixels.len()) {
                *level = self.level(i).as_vec3().to_array();
            }
            self.pixels.truncate(start);
            self.pixels.shrink_to_fit();
        }
        levels
    }

    /// Returns the number of samples of a pixel.
    pub fn samples(&self, pixel: usize) -> u32 {
        self.pixels[pixel].count
    }

    /// Returns the standard error of a pixel's channels, from the scatter of its samples and of its
    /// ghosts' rays: that of independent samples, and an upper bound for stratified ones. It is
    /// infinite for fewer than two samples.
    pub fn standard_error(&self, pixel: usize) -> DVec3 {
        let ghosts = self.ghosts.as_ref();
        let of_ghosts = ghosts.map_or(DVec3::ZERO, |ghosts| ghosts.squared_error_of(pixel));
        let variance = self.pixels[pixel].variance_of_mean() + of_ghosts;
        DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt())
    }

    /// Returns the sum of levels over pixels and channels, without ghosts.
    pub fn sum(&self) -> f64 {
        self.pixels.iter().map(|p| p.mean.element_sum()).sum()
    }

    /// Returns the mean of all channels of all pixels, without ghosts.
    pub fn mean(&self) -> f64 {
        self.sum() / (3.0 * self.pixels.len() as f64)
    }

    /// Returns the estimated error of the picture, with that of its ghosts.
    ///
    /// # Errors
    /// Returns the reason if the error is unknown.
    pub fn error(&self) -> Result<ErrorEstimate, ErrorUnknown> {
        let of_ghosts = self.ghosts.as_ref().map(|ghosts| (ghosts, ghosts.sum()));
        let Some((ghosts, sum)) = of_ghosts.filter(|(_, sum)| *sum > 0.0) else {
            return self.error_of_samples();
        };
        let error = self.squared_error.ok_or(ErrorUnknown::NotMeasured)?;
        let mean = self.mean() + sum / (3.0 * self.pixels.len() as f64);
        error.with_ghosts(ghosts).relative(self.pixels.len(), mean)
    }

    /// Returns the estimated error of the picture without its ghosts.
    ///
    /// # Errors
    /// Returns the reason if the error is unknown.
    pub fn error_of_samples(&self) -> Result<ErrorEstimate, ErrorUnknown> {
        let error = self.squared_error.ok_or(ErrorUnknown::NotMeasured)?;
        error.relative(self.pixels.len(), self.mean())
    }

    /// Returns the estimated root mean square error over the mean of the picture, or `None` if it
    /// is unknown.
    pub fn relative_rmse(&self) -> Option<f64> {
        self.error().ok().map(|e| e.relative_rmse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{mix, unit};

    #[test]
    fn a_film_that_is_not_measured_has_no_error() {
        let mut film = Film::new(Resolution::of(1, 1));
        film.pixels[0].add(DVec3::ONE);
        assert_eq!(film.error(), Err(ErrorUnknown::NotMeasured));
        assert_eq!(film.relative_rmse(), None);
    }

    /// Single samples of two moments, which differ from the truth in one row of pixels: the errors
    /// overlap in that row alone, not in the whole film.
    #[test]
    fn single_samples_tell_where_the_errors_of_two_moments_overlap() {
        let size = Resolution::of(60, 40);
        let moment = |seed: u64| {
            let pixels = (0..60 * 40).map(|i| {
                let [noisy, lit] = [i / 60 == 20, i / 60 > 20];
                let level = match noisy {
                    true => f64::from(unit(mix(seed ^ mix(i))) < 0.5),
                    false => f64::from(lit),
                };
                let mut pixel = Exposed::default();
                pixel.add(DVec3::splat(level));
                pixel
            });
            Film::of_pixels(size, pixels.collect())
        };
        let [a, b] = [1, 2].map(moment);
        let found = a.overlap(&a.expected_errors(), &b, &b.expected_errors());
        // All errors are a half. Where the two samples of a pixel agree, no error is expected.
        assert!((0.8 / 60.0..2.5 / 60.0).contains(&found), "{found}");
    }

    #[test]
    fn the_levels_of_a_film_are_those_of_the_film_that_is_released() {
        for (width, height) in [(1, 1), (5, 3), (23, 16)] {
            let mut film = Film::new(Resolution { width, height });
            for (i, pixel) in film.pixels.iter_mut().enumerate() {
                pixel.add(DVec3::new(i as f64, 0.5, -1.0));
            }
            let mut ghosts = GhostImage::new(film.resolution);
            ghosts
                .pixels
                .iter_mut()
                .for_each(|p| *p = DVec3::splat(0.25));
            film.ghosts = Some(ghosts);
            let levels = film.levels();
            let last = film.pixels.len() - 1;
            assert_eq!(levels[last], [last as f32 + 0.25, 0.75, -0.75]);
            assert_eq!(film.into_levels(), levels);
        }
    }
}
