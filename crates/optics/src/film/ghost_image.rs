//! The ghosts of lights on a film, with the error of their levels.

use glam::{DVec3, Vec3};

use super::format::Resolution;
use super::region::Region;

/// The ghosts of lights. They are kept apart from the exposures, because their rays are traced from
/// the lights and not from the pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct GhostImage {
    /// The level of each pixel, row by row.
    pub pixels: Vec<DVec3>,
    /// The light that the lights' own images would have, as levels summed over pixels and channels.
    pub of_lights: f64,
    /// The estimated squared error of each pixel, by channel.
    squared_errors: Vec<DVec3>,
    /// The sum of the squares of the parts of all squared errors, which is their variance.
    variance: f64,
    /// The number of those parts.
    parts: usize,
}

impl GhostImage {
    /// Returns an image without light.
    pub fn new(resolution: Resolution) -> Self {
        Self {
            pixels: vec![DVec3::ZERO; resolution.pixels()],
            of_lights: 0.0,
            squared_errors: vec![DVec3::ZERO; resolution.pixels()],
            variance: 0.0,
            parts: 0,
        }
    }

    /// Adds the light of a ray to a pixel. `squared_error` is an independent part of the variance
    /// of the pixel's level, by channel.
    pub fn add(&mut self, pixel: u32, level: Vec3, squared_error: Vec3) {
        let squared_error = squared_error.as_dvec3();
        self.pixels[pixel as usize] += level.as_dvec3();
        self.squared_errors[pixel as usize] += squared_error;
        let part = squared_error.element_sum();
        self.variance += part * part;
        self.parts += usize::from(part > 0.0);
    }

    /// Returns the estimated squared error of a pixel, by channel.
    pub fn squared_error_of(&self, pixel: usize) -> DVec3 {
        self.squared_errors[pixel]
    }

    /// Returns the sum of levels over pixels and channels.
    pub fn sum(&self) -> f64 {
        self.pixels.iter().map(|p| p.element_sum()).sum()
    }

    /// Returns the estimated squared error, summed over pixels and channels, and the variance of
    /// that estimate.
    pub fn squared_error(&self) -> (f64, f64) {
        let sum: DVec3 = self.squared_errors.iter().sum();
        (sum.element_sum(), self.variance)
    }

    /// Returns the number of independent parts that estimate the squared error.
    pub(super) fn parts(&self) -> usize {
        self.parts
    }

    /// Returns the part of the image in a region of its picture. The light of the lights' own
    /// images is still that of the picture.
    pub fn cut(&self, region: Region, picture: Resolution) -> Self {
        let squared_errors = region.cut(&self.squared_errors, picture);
        let inside: DVec3 = squared_errors.iter().sum();
        let share = inside.element_sum() / self.squared_error().0;
        let share = if share > 0.0 { share } else { 0.0 };
        Self {
            pixels: region.cut(&self.pixels, picture),
            of_lights: self.of_lights,
            squared_errors,
            variance: share * self.variance,
            parts: (share * self.parts as f64) as usize,
        }
    }

    /// Returns the weighted sum of two images with independent errors; `share` is the weight of the
    /// other one.
    pub(super) fn join(&self, other: &Self, share: f64) -> Self {
        let [p, q] = [1.0 - share, share];
        let [a, b] = [p * p, q * q];
        let pixels = self.pixels.iter().zip(&other.pixels);
        let errors = self.squared_errors.iter().zip(&other.squared_errors);
        Self {
            pixels: pixels.map(|(one, two)| p * *one + q * *two).collect(),
            of_lights: p * self.of_lights + q * other.of_lights,
            squared_errors: errors.map(|(one, two)| a * *one + b * *two).collect(),
            variance: a * a * self.variance + b * b * other.variance,
            parts: self.parts + other.parts,
        }
    }
}
