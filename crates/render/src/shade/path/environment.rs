//! Light from far away, as a picture of all directions.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use crate::scene::{AliasTable, sound_color};

/// An equirectangular picture: its rows go from the zenith to the nadir, and its middle column is
/// toward −z, its left half toward −x. A pixel has one radiance.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    width: usize,
    height: usize,
    /// The radiances, row by row from the zenith.
    pixels: Vec<Vec3>,
    /// The choice of a pixel by its mean radiance times its solid angle.
    table: AliasTable,
}

impl EnvironmentLight {
    /// Makes the light of a picture's radiances, row by row from the top. Returns `None` if the
    /// picture has no pixels. NaN and negative values count as black.
    pub fn new(width: usize, height: usize, pixels: Vec<Vec3>) -> Option<Self> {
        if width == 0 || height == 0 || pixels.len() != width.checked_mul(height)? {
            return None;
        }
        let pixels: Vec<Vec3> = pixels.into_iter().map(sound_color).collect();
        let mut weights = Vec::with_capacity(pixels.len());
        for (row, pixels) in pixels.chunks_exact(width).enumerate() {
            let solid_angle = solid_angle(width, height, row) as f32;
            weights.extend(pixels.iter().map(|color| mean(*color) * solid_angle));
        }
        Some(Self {
            width,
            height,
            table: AliasTable::new(&weights),
            pixels,
        })
    }

    /// Whether no light comes from anywhere.
    pub(super) fn is_black(&self) -> bool {
        self.table.is_empty()
    }

    fn pixel(&self, direction: Vec3) -> Vec3 {
        let d = direction.normalize_or(Vec3::NEG_Z);
        let across = libm::atan2f(d.x, -d.z) / TAU + 0.5;
        let down = libm::acosf(d.y.clamp(-1.0, 1.0)) / PI;
        let at = |share: f32, size: usize| ((share * size as f32) as usize).min(size - 1);
        self.pixels[at(down, self.height) * self.width + at(across, self.width)]
    }

    /// The radiance from a direction, and the density with which it is drawn.
    pub(super) fn radiance(&self, direction: Vec3) -> (Vec3, f32) {
        let color = self.pixel(direction);
        (color, mean(color) / self.table.total as f32)
    }

    /// Draws a direction; the picture is not black. The second number of `choice` continues the
    /// first below its last bit.
    pub(super) fn sample(&self, choice: [f32; 2], u: [f32; 2]) -> Vec3 {
        let (pixel, _) = self.table.choose(choice);
        let (row, column) = (pixel as usize / self.width, pixel as usize % self.width);
        let cosine = |row: usize| libm::cosf(PI * row as f32 / self.height as f32);
        let (top, bottom) = (cosine(row), cosine(row + 1));
        let y = (top + u[0] * (bottom - top)).clamp(-1.0, 1.0);
        let r = (1.0 - y * y).max(0.0).sqrt();
        let turn = TAU * ((column as f32 + u[1]) / self.width as f32 - 0.5);
        Vec3::new(r * libm::sinf(turn), y, -r * libm::cosf(turn))
    }
}

/// The mean of the channels.
pub(super) fn mean(color: Vec3) -> f32 {
    color.element_sum() / 3.0
}

/// The solid angle of a pixel of a row, in steradians.
pub(super) fn solid_angle(width: usize, height: usize, row: usize) -> f64 {
    let cosine = |row: usize| libm::cos(std::f64::consts::PI * row as f64 / height as f64);
    let turn = std::f64::consts::TAU / width as f64;
    turn * (cosine(row) - cosine(row + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_drawn_with_the_stated_density() {
        let pixels = (0..32).map(|i| Vec3::new(0.1 + i as f32, 0.5, ((i * 7) % 5) as f32));
        let light = EnvironmentLight::new(8, 4, pixels.collect()).unwrap();
        // The mean of radiance over density is the integral of the radiance.
        let n = 40_000;
        let (mut sum, mut square) = (0.0f64, 0.0f64);
        for i in 0..n {
            let turn = |share: f64| (f64::from(i) * share).fract() as f32;
            let direction =
                light.sample([turn(0.618_033), 0.0], [turn(0.754_877), turn(0.569_840)]);
            let (color, pdf) = light.radiance(direction);
            let value = f64::from(color.z / pdf);
            (sum, square) = (sum + value, square + value * value);
        }
        let exact: f64 = (0..32)
            .map(|i| f64::from(light.pixels[i].z * solid_angle(8, 4, i / 8) as f32))
            .sum();
        let mean = sum / f64::from(n);
        let sigma = ((square / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
        assert!((mean - exact).abs() < 3.0 * sigma, "{mean} {exact} {sigma}");
        let all: f32 = (0..4).map(|row| 8.0 * solid_angle(8, 4, row) as f32).sum();
        assert!((all - 4.0 * PI).abs() < 1e-4);
    }

    #[test]
    fn a_picture_without_pixels_is_refused_and_a_black_one_is_dark() {
        assert!(EnvironmentLight::new(0, 0, Vec::new()).is_none());
        let dark = EnvironmentLight::new(1, 1, vec![Vec3::NAN]).unwrap();
        assert!(dark.is_black() && dark.pixel(Vec3::Y) == Vec3::ZERO);
        let one = EnvironmentLight::new(1, 1, vec![Vec3::ONE]).unwrap();
        assert!((one.radiance(Vec3::X).1 - 0.25 / PI).abs() < 1e-6);
    }
}
