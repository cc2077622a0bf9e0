//! The exposed film: every pixel's samples, the ghosts of lights, and the estimated error.

use glam::DVec3;

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
}

impl Film {
    /// Returns an unexposed film.
    pub fn new(resolution: Resolution) -> Self {
        Self {
            resolution,
            pixels: vec![Exposed::default(); resolution.pixels()],
            squared_error: None,
            ghosts: None,
        }
    }

    /// Adds the exposure of another film of the same size, with a share of the sum. The share is
    /// not the ratio of a pixel's sample counts, because adaptive sampling changes those by pixel.
    pub fn join(&mut self, other: &Self, share: f64) {
        self.ghosts = match (&self.ghosts, &other.ghosts) {
            (Some(a), Some(b)) => Some(a.join(b, share)),
            (a, b) => a.clone().or(b.clone()),
        };
        self.squared_error = match (&self.squared_error, &other.squared_error) {
            (Some(a), Some(b)) => Some(a.join(b, share, self.overlap(other, a.sum() * b.sum()))),
            _ => None,
        };
        for (pixel, more) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.join_as(more, share);
        }
    }

    /// Returns the sum over pixels of the products of the squared errors of two films, whose sums
    /// have a product. A pixel's part of a sum is that of its samples' scatter.
    fn overlap(&self, other: &Self, of_sums: f64) -> f64 {
        let scatter = |p: &Exposed| p.variance_of_mean().element_sum();
        let (mut sums, mut products) = ([0.0; 2], 0.0);
        for (a, b) in self.pixels.iter().zip(&other.pixels) {
            let [a, b] = [a, b].map(scatter);
            sums = [sums[0] + a, sums[1] + b];
            products += a * b;
        }
        let overlap = of_sums * products / (sums[0] * sums[1]);
        if overlap.is_finite() {
            overlap.max(0.0)
        } else {
            of_sums.max(0.0) / self.pixels.len() as f64
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

    #[test]
    fn a_film_that_is_not_measured_has_no_error() {
        let mut film = Film::new(Resolution::of(1, 1));
        film.pixels[0].add(DVec3::ONE);
        assert_eq!(film.error(), Err(ErrorUnknown::NotMeasured));
        assert_eq!(film.relative_rmse(), None);
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
