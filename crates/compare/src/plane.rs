//! Pictures for computation: one plane of values, or three that make a color.
//!
//! A position is in pixels from the top left corner, so that the first pixel's center is (½, ½).

use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_PICTURE, read_file};
use ivcam_optics::picture::{Raster, Samples, exr_text};
use rayon::prelude::*;

/// One value per pixel, with rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// The values, row by row.
    pub values: Vec<f32>,
}

/// Red, green and blue planes: levels from 0 to 1, or exposures.
#[derive(Clone, Debug, PartialEq)]
pub struct Plate {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Red, green and blue.
    pub channels: [Plane; 3],
    /// For each pixel whether its values in the file are finite; `None` if all are. The others are
    /// black here.
    pub finite: Option<Vec<bool>>,
    /// Whether the values are linear light, which a display shows by the curve of sRGB. Otherwise
    /// they are levels of a display.
    pub is_light: bool,
}

impl Plane {
    /// Returns a plane with the value `f(x, y)` at each pixel.
    pub fn from_fn(width: usize, height: usize, f: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        Self::from_rows(width, height, &|y, row| {
            for (x, v) in row.iter_mut().enumerate() {
                *v = f(x, y);
            }
        })
    }

    /// Returns a plane whose rows the function fills. It is not generic, so that what the threads
    /// do is compiled once.
    fn from_rows(width: usize, height: usize, fill: &(dyn Fn(usize, &mut [f32]) + Sync)) -> Self {
        let mut values = vec![0.0; width * height];
        let rows = values.par_chunks_mut(width.max(1)).enumerate();
        rows.for_each(|(y, row)| fill(y, row));
        Self {
            width,
            height,
            values,
        }
    }

    /// Returns the values of a row.
    fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..][..self.width]
    }

    /// Returns the longer side, in pixels.
    pub(super) fn longer_side(&self) -> f64 {
        self.width.max(self.height) as f64
    }

    /// Returns the value of a pixel.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Returns the value of the nearest pixel of the picture.
    pub fn near(&self, x: isize, y: isize) -> f32 {
        let clamp = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
        self.at(clamp(x, self.width), clamp(y, self.height))
    }

    /// Applies a function to each value.
    pub fn map(&self, f: impl Fn(f32) -> f32 + Sync) -> Self {
        Self::from_rows(self.width, self.height, &|y, row| {
            for (v, &a) in row.iter_mut().zip(self.row(y)) {
                *v = f(a);
            }
        })
    }

    /// Applies a function to the values of two planes of the same size.
    pub fn zip(&self, other: &Self, f: impl Fn(f32, f32) -> f32 + Sync) -> Self {
        Self::from_rows(self.width, self.height, &|y, row| {
            let pairs = self.row(y).iter().zip(other.row(y));
            for (v, (&a, &b)) in row.iter_mut().zip(pairs) {
                *v = f(a, b);
            }
        })
    }

    /// Filters rows with one kernel and columns with another; the border is repeated outward.
    /// Kernels have an odd length and are not reversed: the result is a correlation.
    pub fn filtered(&self, along_x: &[f64], along_y: &[f64]) -> Self {
        let rows = Self::from_fn(self.width, self.height, |x, y| {
            taps(along_x, |i| self.near(x as isize + i, y as isize))
        });
        Self::from_fn(self.width, self.height, |x, y| {
            taps(along_y, |i| rows.near(x as isize, y as isize + i))
        })
    }

    /// Blurs by a Gaussian of a standard deviation in pixels, cut at three standard deviations.
    pub fn blurred(&self, sigma: f64) -> Self {
        let kernel = gaussian(sigma, (3.0 * sigma).ceil() as usize);
        self.filtered(&kernel, &kernel)
    }

    /// Resamples to another size with a Catmull-Rom kernel as wide as the larger of the two pixels.
    pub fn resized(&self, width: usize, height: usize) -> Self {
        let (columns, rows) = (weights(self.width, width), weights(self.height, height));
        let sum = |w: &Weights, get: &dyn Fn(usize) -> f32| {
            let terms = w.iter().map(|&(i, w)| w * f64::from(get(i)));
            terms.sum::<f64>() as f32
        };
        let narrow = Self::from_fn(width, self.height, |x, y| {
            sum(&columns[x], &|i| self.at(i, y))
        });
        Self::from_fn(width, height, |x, y| sum(&rows[y], &|i| narrow.at(x, i)))
    }

    /// Interpolates the value at a position by Catmull-Rom; the border is repeated outward.
    pub fn sample(&self, x: f64, y: f64) -> f32 {
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (wx, wy) = (four_weights(x - left), four_weights(y - top));
        let (left, top) = (left as isize - 1, top as isize - 1);
        let mut sum = 0.0;
        for (j, wy) in wy.iter().enumerate() {
            for (i, wx) in wx.iter().enumerate() {
                let v = self.near(left + i as isize, top + j as isize);
                sum += wx * wy * f64::from(v);
            }
        }
        sum as f32
    }

    /// Returns the plane mirrored left to right.
    pub(crate) fn mirrored(&self) -> Self {
        Self::from_fn(self.width, self.height, |x, y| {
            self.at(self.width - 1 - x, y)
        })
    }

    /// Returns the gradient along x and along y, half the central difference.
    pub fn gradients(&self) -> [Self; 2] {
        let difference = [-0.5, 0.0, 0.5];
        [
            self.filtered(&difference, &[1.0]),
            self.filtered(&[1.0], &difference),
        ]
    }
}

impl Plate {
    /// Reads a picture file in any format that [`Raster::open`] reads. Numbers in floating point
    /// are light, unless the file is an EXR of ivcam that states a linear response: its levels are
    /// those of a display.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or is not a picture.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = read_file(path, MAX_PICTURE)?;
        let raster = Raster::decode_upright(&bytes, &path.to_string_lossy())?;
        let mut plate = Self::from_raster(&raster);
        if matches!(raster.samples, Samples::F32(_)) {
            let response = exr_text(&bytes, "ivcam:response");
            plate.is_light = response.is_none_or(|response| response != "linear");
        }
        Ok(plate)
    }

    /// Converts a picture file without its alpha, because archival pictures are opaque.
    pub fn from_raster(raster: &Raster) -> Self {
        let (width, height) = (raster.width as usize, raster.height as usize);
        let is_finite = |i: usize| raster.color(i).iter().all(|v| v.is_finite());
        let finite: Vec<bool> = (0..width * height).map(is_finite).collect();
        let value = |i: usize, c: usize| if finite[i] { raster.color(i)[c] } else { 0.0 };
        let plane = |c: usize| Plane::from_fn(width, height, |x, y| value(y * width + x, c));
        Self {
            finite: finite.contains(&false).then(|| finite.clone()),
            ..Self::from_planes([plane(0), plane(1), plane(2)])
        }
    }

    /// Returns the warning that one of two pictures, each with its name, has linear light and the
    /// other levels of a display; `None` if they have the same.
    pub fn mixed(pair: [(&Self, &str); 2]) -> Option<Box<Diagnostic>> {
        let named = |is_light| pair.iter().find(|(plate, _)| plate.is_light == is_light);
        let ((_, light), (_, levels)) = (named(true)?, named(false)?);
        let message = format!("`{light}` has linear light, and `{levels}` levels of a display");
        let help = "`ivcam expose LIGHT.exr --response srgb -o LEVELS.png` develops the light";
        Some(Diagnostic::warning(message).with_help(help))
    }

    /// Combines red, green and blue planes of the same size.
    pub fn from_planes(channels: [Plane; 3]) -> Self {
        let (width, height) = (channels[0].width, channels[0].height);
        Self {
            width,
            height,
            channels,
            finite: None,
            is_light: false,
        }
    }

    /// Applies a function to each channel.
    pub fn map(&self, f: impl Fn(&Plane) -> Plane) -> Self {
        Self::from_planes([0, 1, 2].map(|c| f(&self.channels[c])))
    }

    /// Returns red, green and blue of a pixel.
    pub fn color(&self, pixel: usize) -> [f32; 3] {
        [0, 1, 2].map(|c| self.channels[c].values[pixel])
    }

    /// Returns the brightness by Rec. 601's weights, as SSIM's authors do.
    pub fn luma(&self) -> Plane {
        let [r, g, b] = &self.channels;
        r.zip(g, |r, g| 0.299 * r + 0.587 * g)
            .zip(b, |y, b| y + 0.114 * b)
    }
}

/// Returns a normalized Gaussian of 2·radius + 1 taps.
pub(crate) fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    let bell = |i: usize| {
        let x = i as f64 - radius as f64;
        libm::exp(-0.5 * x * x / (sigma * sigma))
    };
    let kernel: Vec<f64> = (0..=2 * radius).map(bell).collect();
    let sum: f64 = kernel.iter().sum();
    kernel.iter().map(|k| k / sum).collect()
}

/// Returns the length of a gradient.
pub(crate) fn length(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

fn taps(kernel: &[f64], get: impl Fn(isize) -> f32) -> f32 {
    let half = (kernel.len() / 2) as isize;
    let terms = kernel.iter().enumerate();
    terms
        .map(|(i, k)| k * f64::from(get(i as isize - half)))
        .sum::<f64>() as f32
}

/// The pixels that a resampled one is made of, with their weights.
type Weights = Vec<(usize, f64)>;

fn weights(from: usize, to: usize) -> Vec<Weights> {
    let step = from as f64 / to as f64;
    let wide = step.max(1.0);
    (0..to)
        .map(|i| {
            let center = (i as f64 + 0.5) * step;
            let first = (center - 2.0 * wide).floor() as isize;
            let last = (center + 2.0 * wide).ceil() as isize;
            let raw: Vec<(usize, f64)> = (first..=last)
                .map(|j| {
                    let inside = j.clamp(0, from as isize - 1) as usize;
                    (inside, catmull_rom((j as f64 + 0.5 - center) / wide))
                })
                .filter(|(_, w)| *w != 0.0)
                .collect();
            let sum: f64 = raw.iter().map(|(_, w)| w).sum();
            raw.into_iter().map(|(j, w)| (j, w / sum)).collect()
        })
        .collect()
}

/// Returns Keys' cubic kernel with a = -1/2, which reproduces parabolas.
fn catmull_rom(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 {
        1.0 + x * x * (1.5 * x - 2.5)
    } else if x < 2.0 {
        2.0 + x * (x * (2.5 - 0.5 * x) - 4.0)
    } else {
        0.0
    }
}

fn four_weights(t: f64) -> [f64; 4] {
    [-1.0, 0.0, 1.0, 2.0].map(|i| catmull_rom(i - t))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parabola(width: usize, height: usize) -> Plane {
        Plane::from_fn(width, height, |x, y| {
            let (x, y) = (x as f32 + 0.5, y as f32 + 0.5);
            0.01 * x * x + 0.1 * y
        })
    }

    #[test]
    fn a_parabola_is_sampled_exactly_between_pixels() {
        let p = parabola(16, 12);
        for (x, y) in [(5.2, 4.9), (8.0, 7.5), (10.99, 6.01)] {
            let exact = 0.01 * x * x + 0.1 * y;
            assert!((f64::from(p.sample(x, y)) - exact).abs() < 1e-5);
        }
    }

    #[test]
    fn resizing_keeps_a_ramp_and_its_own_size_changes_nothing() {
        let ramp = Plane::from_fn(40, 8, |x, _| x as f32 + 0.5);
        assert_eq!(ramp.resized(40, 8), ramp);
        let half = ramp.resized(20, 4);
        assert!((half.at(10, 2) - 21.0).abs() < 1e-4);
        let twice = ramp.resized(80, 16);
        assert!((twice.at(41, 7) - 20.75).abs() < 1e-4);
    }

    #[test]
    fn a_blur_keeps_the_mean_of_a_constant() {
        let flat = Plane::from_fn(9, 9, |_, _| 0.3);
        assert!(
            flat.blurred(2.0)
                .values
                .iter()
                .all(|v| (v - 0.3).abs() < 1e-6)
        );
    }
}
