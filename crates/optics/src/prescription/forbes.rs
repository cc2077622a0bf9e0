//! Forbes's polynomials of aspheres, Q-bfs and Q-con, as powers of the distance from the axis.
//!
//! G. W. Forbes, "Shape specification for axially symmetric optical surfaces", Optics Express 15,
//! 5218 (2007), and "Robust, efficient computational methods for axially symmetric optical
//! aspheres", Optics Express 18, 19700 (2010). With u = r/radius and x = u² the departure is
//! u⁴ Σ aₘ Qₘ(x) along the axis for Q-con, whose Qₘ are the Jacobi polynomials of (0, 4), and
//! u² (1 − u²) Σ aₘ Qₘ(x) along the normal for Q-bfs, whose slopes are orthogonal.

use crate::prescription::surface::{MAX_POWER, polynomial};

/// The number of polynomials whose powers of r are at most [`MAX_POWER`].
const COUNT: usize = MAX_POWER / 2 - 1;

/// Coefficients of the powers of x.
type Powers = [f64; COUNT];

/// A set of Forbes's polynomials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ForbesSet {
    /// For mild aspheres, measured along the normal of the conic.
    Bfs,
    /// For strong aspheres, measured along the axis from the conic.
    Con,
}

impl ForbesSet {
    /// The coefficients of the powers of r, at most [`MAX_POWER`], of a sum of polynomials with
    /// these coefficients, in the unit of `radius`.
    ///
    /// # Errors
    /// The number of the first polynomial of a higher power whose coefficient is not 0.
    pub(crate) fn terms(
        self,
        coefficients: &[f64],
        radius: f64,
    ) -> Result<Box<[f64; MAX_POWER + 1]>, usize> {
        let beyond = coefficients.iter().skip(COUNT).position(|a| *a != 0.0);
        if let Some(first) = beyond {
            return Err(COUNT + first);
        }
        let mut sum = [0.0; COUNT];
        for (q, a) in self.polynomials().iter().zip(coefficients) {
            add(&mut sum, q, *a);
        }
        // In front of the sum stands x² or x − x².
        let at = |i: usize| i.checked_sub(1).map_or(0.0, |i| sum[i]);
        let power = |i: usize| match self {
            Self::Con => at(i),
            Self::Bfs => sum.get(i).unwrap_or(&0.0) - at(i),
        };
        let square = radius * radius;
        let scaled = (0..=COUNT).scan(square, |scale, i| {
            let term = (2 * i + 2, power(i) / *scale);
            *scale *= square;
            Some(term)
        });
        Ok(polynomial(scaled))
    }

    /// The polynomials, by the recurrences of the papers.
    fn polynomials(self) -> [Powers; COUNT] {
        match self {
            Self::Bfs => bfs(),
            Self::Con => con(),
        }
    }
}

/// Adds `factor` times `other`.
fn add(sum: &mut Powers, other: &Powers, factor: f64) {
    for (s, o) in sum.iter_mut().zip(other) {
        *s += factor * o;
    }
}

/// (a + b x) p + c q.
fn step([a, b, c]: [f64; 3], p: &Powers, q: &Powers) -> Powers {
    std::array::from_fn(|i| a * p[i] + b * i.checked_sub(1).map_or(0.0, |i| p[i]) + c * q[i])
}

/// The polynomial a + b x.
fn line(a: f64, b: f64) -> Powers {
    let mut powers = [0.0; COUNT];
    (powers[0], powers[1]) = (a, b);
    powers
}

/// Equations A.12 to A.16 of the paper of 2010.
fn bfs() -> [Powers; COUNT] {
    let mut f = [0.0; COUNT];
    let (mut g, mut h) = ([0.0; COUNT], [0.0; COUNT]);
    (f[0], f[1], g[0]) = (2.0, 0.5 * 19_f64.sqrt(), -0.5);
    let mut p = [line(2.0, 0.0), line(6.0, -8.0)];
    let mut all = [[0.0; COUNT]; COUNT];
    all[0] = line(1.0, 0.0);
    all[1] = line(13.0 / 19_f64.sqrt(), -16.0 / 19_f64.sqrt());
    for m in 2..COUNT {
        let number = m as f64;
        h[m - 2] = -number * (number - 1.0) / (2.0 * f[m - 2]);
        g[m - 1] = -(1.0 + g[m - 2] * h[m - 2]) / f[m - 1];
        let rest = g[m - 1] * g[m - 1] + h[m - 2] * h[m - 2];
        f[m] = (number * (number + 1.0) + 3.0 - rest).sqrt();
        p = [p[1], step([2.0, -4.0, -1.0], &p[1], &p[0])];
        let mut next = p[1];
        add(&mut next, &all[m - 1], -g[m - 1]);
        add(&mut next, &all[m - 2], -h[m - 2]);
        all[m] = next.map(|a| a / f[m]);
    }
    all
}

/// The recurrence of the Jacobi polynomials of (0, 4) at 2x − 1.
fn con() -> [Powers; COUNT] {
    let mut all = [[0.0; COUNT]; COUNT];
    (all[0], all[1]) = (line(1.0, 0.0), line(-5.0, 6.0));
    for m in 1..COUNT - 1 {
        let n = m as f64;
        let over = 2.0 * (n + 1.0) * (n + 5.0) * (2.0 * n + 4.0);
        let slope = (2.0 * n + 5.0) * (2.0 * n + 6.0) * (2.0 * n + 4.0);
        let constant = -16.0 * (2.0 * n + 5.0) - slope;
        let before = -2.0 * n * (n + 4.0) * (2.0 * n + 6.0);
        let factors = [constant, 2.0 * slope, before].map(|factor| factor / over);
        all[m + 1] = step(factors, &all[m], &all[m - 1]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(powers: &[f64], x: f64) -> f64 {
        powers.iter().rev().fold(0.0, |sum, a| sum * x + a)
    }

    /// The sum of products of binomial coefficients that defines a Jacobi polynomial.
    #[test]
    fn q_con_are_jacobi_polynomials() {
        let choose =
            |n: usize, k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
        for (m, q) in con().iter().enumerate() {
            for x in (0..=20).map(|i| f64::from(i) / 20.0) {
                let term = |s: usize| {
                    let powers = (x - 1.0).powi(s as i32) * x.powi((m - s) as i32);
                    choose(m, s) * choose(m + 4, s) * powers
                };
                let exact: f64 = (0..=m).map(term).sum();
                assert!((value(q, x) - exact).abs() < 1e-8, "{m} at {x}");
            }
        }
    }

    /// The mean of the product of two slopes over the angle whose sine is u is 1 or 0 (Forbes
    /// 2007). The slopes are polynomials of a degree below 40 in the sine, for which the mean over
    /// 64 places is exact.
    #[test]
    fn the_slopes_of_q_bfs_are_orthogonal() {
        let terms = |m: usize| {
            let mut coefficients = [0.0; COUNT];
            coefficients[m] = 1.0;
            ForbesSet::Bfs.terms(&coefficients, 1.0).unwrap()
        };
        let slope = |terms: &[f64; MAX_POWER + 1], u: f64| {
            let slopes: Vec<f64> = (1..=MAX_POWER).map(|p| p as f64 * terms[p]).collect();
            value(&slopes, u)
        };
        for (m, n) in (0..COUNT).flat_map(|m| (0..=m).map(move |n| (m, n))) {
            let (a, b) = (terms(m), terms(n));
            let sines = (0..64).map(|i| libm::sin(std::f64::consts::PI * f64::from(i) / 64.0));
            let mean = sines.map(|u| slope(&a, u) * slope(&b, u)).sum::<f64>() / 64.0;
            let wanted = if m == n { 1.0 } else { 0.0 };
            assert!((mean - wanted).abs() < 1e-7, "{m}, {n}: {mean}");
        }
    }

    #[test]
    fn a_polynomial_of_too_high_a_power_is_named() {
        let mut coefficients = vec![0.0; COUNT + 2];
        assert!(ForbesSet::Con.terms(&coefficients, 3.0).is_ok());
        coefficients[COUNT + 1] = 1.0;
        assert_eq!(
            ForbesSet::Con.terms(&coefficients, 3.0).unwrap_err(),
            COUNT + 1
        );
    }
}
