//! Functions of one variable, fitted to points by least squares.

use ivcam_base::math::least_squares::least_squares;

/// The a and k of y = a x (1 + k1 x² + k2 x⁴ + …) with `count` terms.
pub(super) fn odd_series(points: &[(f64, f64)], count: usize) -> Option<(f64, Vec<f64>)> {
    let exponents: Vec<i32> = (0..=count as i32).map(|i| 2 * i + 1).collect();
    let c = powers(points, &exponents)?;
    Some((c[0], c[1..].iter().map(|c_i| c_i / c[0]).collect()))
}

/// The coefficients of y as a sum of powers of x.
pub(super) fn powers(points: &[(f64, f64)], exponents: &[i32]) -> Option<Vec<f64>> {
    let widest = points.iter().map(|(x, _)| x.abs()).fold(0.0, f64::max);
    let row = |(x, _): &(f64, f64)| exponents.iter().map(|e| (x / widest).powi(*e)).collect();
    let rows: Vec<Vec<f64>> = points.iter().map(row).collect();
    let right: Vec<f64> = points.iter().map(|(_, y)| *y).collect();
    let found = least_squares(&rows, &right)?;
    Some(
        found
            .iter()
            .zip(exponents)
            .map(|(c, e)| c / widest.powi(*e))
            .collect(),
    )
}

/// The a and k of y = a x (1 + k1 x² + k2 x⁴ + k3 x⁶)/(1 + k4 x² + k5 x⁴ + k6 x⁶).
///
/// y (1 + k4 x² + …) = a x (1 + k1 x² + …) is linear in a, a k1, …, k6. Each round divides the
/// equations by the denominator of the last one, which makes their error that of y (Sanathanan and
/// Koerner 1963). The round with the least residual is taken; none if no round has a finite one.
pub(super) fn odd_ratio(points: &[(f64, f64)]) -> Option<(f64, Vec<f64>)> {
    const ROUNDS: usize = 12;
    let widest = points.iter().map(|(x, _)| x.abs()).fold(0.0, f64::max);
    let highest = points.iter().map(|(_, y)| y.abs()).fold(0.0, f64::max);
    let mut denominators = vec![1.0; points.len()];
    let mut best: Option<(f64, f64, Vec<f64>)> = None;
    for _ in 0..ROUNDS {
        let row = |((x, y), below): (&(f64, f64), &f64)| {
            let (x, y) = (x / widest, y / highest);
            let square = x * x;
            let powers = [1.0, square, square * square, square * square * square];
            let above = powers.map(|p| x * p / below);
            [&above[..], &[1, 2, 3].map(|i| -y * powers[i] / below)].concat()
        };
        let rows: Vec<Vec<f64>> = points.iter().zip(&denominators).map(row).collect();
        let right = points.iter().zip(&denominators);
        let right: Vec<f64> = right.map(|((_, y), below)| y / highest / below).collect();
        let Some(c) = least_squares(&rows, &right) else {
            break;
        };
        let scale = |i: usize| widest.powi(-2 * i as i32);
        let above = (1..=3).map(|i| c[i] / c[0] * scale(i));
        let k: Vec<f64> = above.chain((1..=3).map(|i| c[3 + i] * scale(i))).collect();
        let a = c[0] * highest / widest;
        let off = |(x, y): &(f64, f64)| (a * x * ratio(&k, x * x) - y).powi(2);
        let square: f64 = points.iter().map(off).sum();
        let is_less = best.as_ref().is_none_or(|(least, ..)| square < *least);
        if square.is_finite() && is_less {
            best = Some((square, a, k.clone()));
        }
        for (below, (x, _)) in denominators.iter_mut().zip(points) {
            *below = series(&k[3..], x * x);
        }
        if denominators.iter().any(|d| !(d.abs() > 1e-6)) {
            break;
        }
    }
    best.map(|(_, a, k)| (a, k))
}

/// The largest of residuals, which are not negative; 0 without any, and NaN if one is NaN.
pub(super) fn largest(residuals: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |max: f64, v: f64| if max.is_nan() || v <= max { max } else { v };
    residuals.into_iter().fold(0.0, larger)
}

/// 1 + k1 s + k2 s² + ….
pub(super) fn series(k: &[f64], s: f64) -> f64 {
    1.0 + s * k.iter().rev().fold(0.0, |sum, k| sum * s + k)
}

/// (1 + k1 s + k2 s² + k3 s³)/(1 + k4 s + k5 s² + …); without k4 and on it is a polynomial.
pub(super) fn ratio(k: &[f64], s: f64) -> f64 {
    let (above, below) = k.split_at(3.min(k.len()));
    series(above, s) / series(below, s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_residual_is_nan_if_any_is() {
        assert_eq!(largest([1.0, 3.0, 2.0]), 3.0);
        assert_eq!(largest([]), 0.0);
        for at in 0..3 {
            let mut residuals = [1.0, 3.0, 2.0];
            residuals[at] = f64::NAN;
            assert!(largest(residuals).is_nan(), "{residuals:?}");
        }
    }

    #[test]
    fn a_point_that_is_not_finite_has_no_fit() {
        let mut points: Vec<(f64, f64)> = (1..40)
            .map(|i| f64::from(i) / 40.0)
            .map(|x| (x, x))
            .collect();
        let (a, _) = odd_ratio(&points).unwrap();
        assert!((a - 1.0).abs() < 1e-9, "{a}");
        points[20].1 = f64::NAN;
        assert_eq!(odd_ratio(&points), None);
        assert_eq!(odd_series(&points, 3), None);
    }
}
