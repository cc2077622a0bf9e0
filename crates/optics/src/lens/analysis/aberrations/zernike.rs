//! Fringe Zernike polynomials and least-squares fits of them.
//!
//! The order is that of the University of Arizona's fringe set, counted from 1; each polynomial is
//! 1 at the edge of the disc where its angular factor is 1 (no normalization of the rms). ρ is the
//! radius in the pupil, and θ is counted from +x toward +y, which is the direction of the field.

use glam::DVec2;

/// The number of terms of the full fringe set.
pub(super) const TERMS: usize = 37;

/// The radial and the azimuthal order of a term, counted from 1. A negative azimuthal order is a
/// sine.
pub(super) fn orders(term: usize) -> (i32, i32) {
    if term == 37 {
        // The set ends with the spherical term of twelfth order.
        return (12, 0);
    }
    // Terms with the same (n + |m|)/2 = g are together: g² + 1 to (g + 1)².
    let g = ((term as f64).sqrt().ceil() as i32) - 1;
    let place = term as i32 - g * g - 1;
    let (m, is_sine) = (g - place / 2, place % 2 == 1);
    (2 * g - m, if is_sine { -m } else { m })
}

/// A polynomial at a point of the unit disc.
pub(super) fn value(term: usize, at: DVec2) -> f64 {
    let (n, m) = orders(term);
    let (rho, theta) = (at.length(), libm::atan2(at.y, at.x));
    let angular = match m {
        0 => 1.0,
        m if m > 0 => libm::cos(f64::from(m) * theta),
        m => libm::sin(f64::from(-m) * theta),
    };
    radial(n, m.abs(), rho) * angular
}

/// The radial polynomial of orders n and m ≥ 0.
fn radial(n: i32, m: i32, rho: f64) -> f64 {
    let factorial = |k: i32| (1..=k).map(f64::from).product::<f64>();
    let term = |k: i32| {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let below = factorial(k) * factorial((n + m) / 2 - k) * factorial((n - m) / 2 - k);
        sign * factorial(n - k) / below * rho.powi(n - 2 * k)
    };
    (0..=(n - m) / 2).map(term).sum()
}

/// The coefficients of the first `terms` polynomials that fit values on points of the unit disc
/// best, by Householder's QR decomposition. Returns none for fewer points than twice the terms, or
/// if the points do not determine the coefficients.
pub(super) fn fit(points: &[(DVec2, f64)], terms: usize) -> Option<Vec<f64>> {
    let rows = points.len();
    if rows < 2 * terms {
        return None;
    }
    let column = |j: usize| {
        points
            .iter()
            .map(move |(at, _)| value(j + 1, *at))
            .collect()
    };
    let mut columns: Vec<Vec<f64>> = (0..terms).map(column).collect();
    let mut right: Vec<f64> = points.iter().map(|(_, value)| *value).collect();
    for j in 0..terms {
        let norm = columns[j][j..].iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(norm > 1e-9 * (rows as f64).sqrt()) {
            return None;
        }
        let alpha = -norm.copysign(columns[j][j]);
        let mut mirror = columns[j][j..].to_vec();
        mirror[0] -= alpha;
        let square: f64 = mirror.iter().map(|v| v * v).sum();
        let reflect = |values: &mut [f64]| {
            let dot: f64 = mirror.iter().zip(values.iter()).map(|(a, b)| a * b).sum();
            for (value, m) in values.iter_mut().zip(&mirror) {
                *value -= 2.0 * dot / square * m;
            }
        };
        columns[j..].iter_mut().for_each(|c| reflect(&mut c[j..]));
        reflect(&mut right[j..]);
    }
    let mut solution = vec![0.0; terms];
    for j in (0..terms).rev() {
        let known: f64 = (j + 1..terms).map(|k| columns[k][j] * solution[k]).sum();
        solution[j] = (right[j] - known) / columns[j][j];
    }
    solution.iter().all(|c| c.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc() -> impl Iterator<Item = DVec2> {
        let side = 24;
        let cell = move |i: i32| (2.0 * f64::from(i) + 1.0) / f64::from(side) - 1.0;
        let all = (0..side * side).map(move |k| DVec2::new(cell(k % side), cell(k / side)));
        all.filter(|p| p.length() <= 1.0)
    }

    /// The fringe set as it is printed in Wyant and Creath, table III (1992).
    #[test]
    fn the_first_terms_are_those_of_the_table() {
        let p = DVec2::new(0.3, -0.6);
        let (r, x, y) = (p.length(), p.x, p.y);
        let table = [
            1.0,
            x,
            y,
            2.0 * r * r - 1.0,
            x * x - y * y,
            2.0 * x * y,
            (3.0 * r * r - 2.0) * x,
            (3.0 * r * r - 2.0) * y,
            6.0 * r.powi(4) - 6.0 * r * r + 1.0,
            x * x * x - 3.0 * x * y * y,
            3.0 * x * x * y - y * y * y,
        ];
        for (i, expected) in table.into_iter().enumerate() {
            assert!((value(i + 1, p) - expected).abs() < 1e-14, "{}", i + 1);
        }
        assert_eq!(
            [orders(16), orders(25), orders(36), orders(37)],
            [(6, 0), (8, 0), (10, 0), (12, 0)]
        );
    }

    /// ρ² = (Z4 + Z1)/2.
    #[test]
    fn a_quadratic_is_half_of_the_fourth_term_and_half_of_the_first() {
        let points: Vec<_> = disc().map(|p| (p, 3.0 * p.length_squared())).collect();
        let found = fit(&points, TERMS).unwrap();
        for (i, c) in found.iter().enumerate() {
            let expected = if i == 0 || i == 3 { 1.5 } else { 0.0 };
            assert!((c - expected).abs() < 1e-10, "term {}: {c}", i + 1);
        }
    }

    #[test]
    fn a_fit_returns_the_coefficients_of_a_part_of_the_disc() {
        let known: Vec<f64> = (0..16).map(|i| f64::from(i * 7 % 5) - 1.7).collect();
        let wave = |p: DVec2| (1..=16).map(|j| known[j - 1] * value(j, p)).sum::<f64>();
        let points: Vec<_> = disc().filter(|p| p.y < 0.2).map(|p| (p, wave(p))).collect();
        for (c, expected) in fit(&points, 16).unwrap().iter().zip(&known) {
            assert!((c - expected).abs() < 1e-8, "{c} {expected}");
        }
    }
}
