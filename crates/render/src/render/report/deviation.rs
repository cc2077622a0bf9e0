//! The error of a film against a reference.

use ivcam_optics::film::{Exposed, Film};
use serde::Serialize;

/// The error of a film against a reference, over all channels of all pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// Mean squared error, in squared levels.
    pub mse: f64,
    /// MSE over the squared mean of the reference.
    pub rel_mse: f64,
    /// Mean difference over the mean of the reference.
    pub bias: f64,
    /// The standard error of `bias`, from the scatter of the pixels' differences.
    pub bias_error: f64,
    /// MSE of the worst 1% of pixels, over the squared mean of the reference.
    pub worst: f64,
}

impl Deviation {
    /// Compares a film with a reference of the same size, whose pixels are red, green and blue.
    pub fn of(film: &Film, reference: &[[f64; 3]]) -> Self {
        let pixels = film.pixels.iter().zip(reference);
        let difference =
            |(p, r): (&Exposed, &[f64; 3])| (p.mean - glam::DVec3::from_array(*r)).to_array();
        let differences: Vec<[f64; 3]> = pixels.map(difference).collect();
        let n = 3.0 * reference.len() as f64;
        let mean = reference.iter().flatten().sum::<f64>() / n;
        let square = |d: &[f64; 3]| d.iter().map(|x| x * x).sum::<f64>();
        let mse = differences.iter().map(square).sum::<f64>() / n;
        let offset = differences.iter().flatten().sum::<f64>() / n;
        // The channels of a pixel share their rays, so only pixels are independent.
        let by_pixel = differences
            .iter()
            .map(|d| d.iter().sum::<f64>() / 3.0 - offset);
        let scatter = by_pixel.map(|x| x * x).sum::<f64>() / (n / 3.0 - 1.0).max(1.0);
        let mut squares: Vec<f64> = differences.iter().map(|d| square(d) / 3.0).collect();
        squares.sort_by(|a, b| b.total_cmp(a));
        let tail = squares.len().div_ceil(100);
        let worst = squares[..tail].iter().sum::<f64>() / tail as f64;
        Self {
            mse,
            rel_mse: mse / (mean * mean),
            bias: offset / mean,
            bias_error: (scatter / (n / 3.0)).sqrt() / mean,
            worst: worst / (mean * mean),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_offset_is_bias_and_nothing_else() {
        let mut film = Film::new(ivcam_optics::film::Resolution::of(20, 10));
        film.pixels
            .iter_mut()
            .for_each(|p| p.add(glam::DVec3::splat(1.1)));
        let deviation = Deviation::of(&film, &[[1.0; 3]; 200]);
        assert!((deviation.bias - 0.1).abs() < 1e-12 && deviation.bias_error < 1e-12);
        assert!((deviation.rel_mse - 0.01).abs() < 1e-12);
    }
}
