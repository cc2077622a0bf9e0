//! FLIP: the difference that a viewer sees when two pictures alternate.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator
//! for Alternating Images", HPG 2020. The letters are the paper's. The input is sRGB levels; the
//! result per pixel is from 0 (equal) to 1 (as different as green and blue).

use crate::plane::{Plane, Plate, gaussian, length};

/// Pixels per degree for a screen 0.7 m wide with 3840 pixels, seen from 0.7 m, as in the paper.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * std::f64::consts::PI / 180.0;

/// The exponent of the color error, and the ends of its linear piece (section 4.1.4).
const Q_C: f64 = 0.7;
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;
/// The width in degrees and the exponent of the feature detectors (section 4.2).
const W: f64 = 0.082;
const Q_F: f64 = 0.5;

/// Contrast sensitivity as sums of Gaussians (a, b), for brightness, red-green and blue-yellow.
const SENSITIVITY: [[(f64, f64); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];

/// The primaries of sRGB in XYZ; the rows sum to the white point.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [
        10_135_552.0 / 24_577_794.0,
        8_788_810.0 / 24_577_794.0,
        4_435_075.0 / 24_577_794.0,
    ],
    [
        2_613_072.0 / 12_288_897.0,
        8_788_810.0 / 12_288_897.0,
        887_015.0 / 12_288_897.0,
    ],
    [
        1_425_312.0 / 73_733_382.0,
        8_788_810.0 / 73_733_382.0,
        70_074_185.0 / 73_733_382.0,
    ],
];

/// Returns the error of each pixel of two pictures of light, or of levels of a display.
pub(crate) fn flip(new: &Plate, old: &Plate, is_light: bool, pixels_per_degree: f64) -> Plane {
    let (new, old) = (opponent(new, is_light), opponent(old, is_light));
    let color = color_error(
        &perceived(&new, pixels_per_degree),
        &perceived(&old, pixels_per_degree),
    );
    let feature = feature_error(&new.channels[0], &old.channels[0], pixels_per_degree);
    color.zip(&feature, |c, f| {
        libm::pow(f64::from(c), 1.0 - f64::from(f)) as f32
    })
}

/// Converts to the linearized Lab space YCxCz, in which the eye's blur is applied.
fn opponent(plate: &Plate, is_light: bool) -> Plate {
    let light = |v: f32| match is_light {
        true => v,
        false => linear(f64::from(v)) as f32,
    };
    let linear = plate.map(|p| p.map(|v| light(v.clamp(0.0, 1.0))));
    let white = XYZ_FROM_RGB.map(|row| row.iter().sum::<f64>());
    per_pixel(&linear, |rgb| {
        let xyz = times(&XYZ_FROM_RGB, rgb);
        let [x, y, z] = [0, 1, 2].map(|i| xyz[i] / white[i]);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    })
}

/// Applies the eye's blur, and converts to Lab with Hunt's adjustment.
fn perceived(opponent: &Plate, pixels_per_degree: f64) -> Plate {
    let channels = [0, 1, 2]
        .map(|c| blurred_by_eye(&opponent.channels[c], &SENSITIVITY[c], pixels_per_degree));
    let white = XYZ_FROM_RGB.map(|row| row.iter().sum::<f64>());
    let rgb_from_xyz = inverse(&XYZ_FROM_RGB);
    per_pixel(&Plate::from_planes(channels), |[y, cx, cz]| {
        let y = (y + 16.0) / 116.0;
        let xyz = [cx / 500.0 + y, y, y - cz / 200.0];
        let rgb = times(&rgb_from_xyz, [0, 1, 2].map(|i| xyz[i] * white[i]));
        hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
    })
}

/// Filters one channel by its contrast sensitivity, a sum of separable Gaussians.
fn blurred_by_eye(channel: &Plane, terms: &[(f64, f64); 2], pixels_per_degree: f64) -> Plane {
    let pi2 = std::f64::consts::PI * std::f64::consts::PI;
    // The radius for all channels is three standard deviations of the widest Gaussian.
    let radius = (3.0 * (0.04 / (2.0 * pi2)).sqrt() * pixels_per_degree).ceil() as usize;
    let sigma = |b: f64| (b / (2.0 * pi2)).sqrt() * pixels_per_degree;
    let mass = |(a, b): (f64, f64)| {
        let along: f64 = (0..=2 * radius)
            .map(|i| {
                let x = (i as f64 - radius as f64) / sigma(b);
                libm::exp(-0.5 * x * x)
            })
            .sum();
        a * (std::f64::consts::PI / b).sqrt() * along * along
    };
    let total: f64 = terms.iter().map(|&t| mass(t)).sum();
    let mut sum = channel.map(|_| 0.0);
    for &(a, b) in terms.iter().filter(|t| t.0 > 0.0) {
        let kernel = gaussian(sigma(b), radius);
        let share = (mass((a, b)) / total) as f32;
        sum = sum.zip(&channel.filtered(&kernel, &kernel), |s, v| s + share * v);
    }
    sum
}

/// Returns the color error of each pixel (section 4.1.4).
fn color_error(new: &Plate, old: &Plate) -> Plane {
    let largest = libm::pow(
        hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])),
        Q_C,
    );
    let knee = P_C * largest;
    let values = (0..new.width * new.height).map(|i| {
        let distance = hyab(new.color(i).map(f64::from), old.color(i).map(f64::from));
        let error = libm::pow(distance, Q_C);
        let error = if error < knee {
            P_T / knee * error
        } else {
            P_T + (error - knee) / (largest - knee) * (1.0 - P_T)
        };
        error.clamp(0.0, 1.0) as f32
    });
    Plane {
        width: new.width,
        height: new.height,
        values: values.collect(),
    }
}

/// Returns the feature error of each pixel: the larger of the differences in edges and in points.
fn feature_error(new: &Plane, old: &Plane, pixels_per_degree: f64) -> Plane {
    let sigma = 0.5 * W * pixels_per_degree;
    let radius = (3.0 * sigma).ceil() as usize;
    let bell = gaussian(sigma, radius);
    let along = |weight: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let terms = bell.iter().enumerate();
        let kernel: Vec<f64> = terms
            .map(|(i, g)| g * weight(i as f64 - radius as f64))
            .collect();
        balanced(&kernel)
    };
    let edge = along(&|x| -x);
    let point = along(&|x| x * x / (sigma * sigma) - 1.0);
    let strengths = |p: &Plane, kernel: &[f64]| {
        let scaled = p.map(|v| (v + 16.0) / 116.0);
        let (x, y) = (
            scaled.filtered(kernel, &bell),
            scaled.filtered(&bell, kernel),
        );
        x.zip(&y, length)
    };
    let difference =
        |kernel: &[f64]| strengths(new, kernel).zip(&strengths(old, kernel), |a, b| (a - b).abs());
    difference(&edge).zip(&difference(&point), |e, p| {
        let larger = f64::from(e.max(p)) * std::f64::consts::FRAC_1_SQRT_2;
        libm::pow(larger, Q_F).min(1.0) as f32
    })
}

/// Scales the positive weights to sum to 1 and the negative ones to sum to -1.
fn balanced(kernel: &[f64]) -> Vec<f64> {
    let up: f64 = kernel.iter().filter(|k| **k > 0.0).sum();
    let down: f64 = kernel.iter().filter(|k| **k < 0.0).sum();
    kernel
        .iter()
        .map(|&k| if k > 0.0 { k / up } else { -k / down })
        .collect()
}

/// Returns the HyAB distance of two colors in Lab.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [l, u, v] = [0, 1, 2].map(|i| a[i] - b[i]);
    l.abs() + (u * u + v * v).sqrt()
}

/// Converts linear RGB to Lab with Hunt's adjustment, which weakens dark colors.
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    let xyz = times(&XYZ_FROM_RGB, rgb);
    let white = XYZ_FROM_RGB.map(|row| row.iter().sum::<f64>());
    const DELTA: f64 = 6.0 / 29.0;
    let root = |t: f64| {
        if t > DELTA * DELTA * DELTA {
            libm::cbrt(t)
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let [x, y, z] = [0, 1, 2].map(|i| root(xyz[i] / white[i]));
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// Inverts the sRGB transfer curve.
fn linear(level: f64) -> f64 {
    if level <= 0.04045 {
        level / 12.92
    } else {
        libm::pow((level + 0.055) / 1.055, 2.4)
    }
}

fn per_pixel(plate: &Plate, f: impl Fn([f64; 3]) -> [f64; 3]) -> Plate {
    let mut out = plate.clone();
    for i in 0..plate.width * plate.height {
        let color = f(plate.color(i).map(f64::from));
        for (channel, value) in out.channels.iter_mut().zip(color) {
            channel.values[i] = value as f32;
        }
    }
    out
}

fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let columns = glam::DMat3::from_cols_array_2d(m).inverse();
    columns.to_cols_array_2d()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(color: [f32; 3]) -> Plate {
        Plate::from_planes(color.map(|v| Plane::from_fn(32, 32, |_, _| v)))
    }

    fn between(a: [f32; 3], b: [f32; 3]) -> f32 {
        let errors = flip(&flat(a), &flat(b), false, PIXELS_PER_DEGREE);
        errors.values.iter().sum::<f32>() / errors.values.len() as f32
    }

    #[test]
    fn light_has_the_errors_of_the_levels_that_show_it() {
        let colors = [[0.3, 0.4, 0.5], [0.35, 0.4, 0.48]];
        let light = colors.map(|color| color.map(|v: f32| linear(f64::from(v)) as f32));
        let of_light = flip(&flat(light[0]), &flat(light[1]), true, PIXELS_PER_DEGREE);
        let error = between(colors[0], colors[1]);
        assert!(
            (of_light.values[0] - error).abs() < 1e-5 && error > 0.01,
            "{error}"
        );
    }

    #[test]
    fn green_and_blue_are_as_far_apart_as_colors_get() {
        assert!((between([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 1e-5);
        assert_eq!(between([0.3, 0.4, 0.5], [0.3, 0.4, 0.5]), 0.0);
    }

    #[test]
    fn the_error_is_symmetric() {
        let (a, b) = ([0.2, 0.5, 0.9], [0.25, 0.45, 0.9]);
        assert_eq!(between(a, b), between(b, a));
    }
}
