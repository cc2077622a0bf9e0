//! The slope of a line through points, with its uncertainty.

use ivcam_optics::film::student;
use serde::Serialize;

/// The exponent of a power law, fitted to points in logarithms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// The exponent, which is the slope of the line through the logarithms.
    pub exponent: f64,
    /// Half the width of the 95% confidence interval, from the scatter of the points about the
    /// line; `None` for two points.
    pub uncertainty: Option<f64>,
}

impl Slope {
    /// Fits y ∝ x^exponent to points with positive coordinates by least squares of the logarithms.
    /// Returns `None` if the points do not determine it.
    pub(crate) fn of(points: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points
            .filter(|(x, y)| *x > 0.0 && *y > 0.0)
            .map(|(x, y)| (libm::log(x), libm::log(y)))
            .collect();
        let n = logs.len() as f64;
        let middle = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
        let (mx, my) = (middle(|p| p.0), middle(|p| p.1));
        let over: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
        let under: f64 = logs.iter().map(|(x, _)| (x - mx) * (x - mx)).sum();
        if !(under > 0.0) {
            return None;
        }
        let exponent = over / under;
        let off = |(x, y): &(f64, f64)| y - my - exponent * (x - mx);
        let squares: f64 = logs.iter().map(|p| off(p) * off(p)).sum();
        let freedom = n - 2.0;
        Some(Self {
            exponent,
            uncertainty: (freedom > 0.0)
                .then(|| student(freedom) * (squares / freedom / under).sqrt()),
        })
    }

    /// Formats the exponent: `-0.52 ± 0.03`.
    pub(crate) fn text(&self) -> String {
        match self.uncertainty {
            Some(uncertainty) => format!("{:.2} ± {uncertainty:.2}", self.exponent),
            None => format!("{:.2}", self.exponent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let points = |n: i32| (1..=n).map(|i| (f64::from(i), 3.0 / f64::from(i).sqrt()));
        let slope = Slope::of(points(5)).unwrap();
        assert!((slope.exponent + 0.5).abs() < 1e-12);
        assert!(slope.uncertainty.unwrap() < 1e-12);
        assert_eq!(Slope::of(points(2)).unwrap().uncertainty, None);
        assert_eq!(Slope::of(points(1)), None);
        assert_eq!(Slope::of(points(0)), None);
    }

    /// The textbook's formula by hand: in logarithms the points are (0, 0), (1, 0), (2, 1), (3, 1),
    /// so the slope is 0.4, the squares of the residuals add up to 0.2, and the standard error is
    /// √(0.2 / 2 / 5). Student's quantile for 2 degrees of freedom is 4.303.
    #[test]
    fn the_uncertainty_is_that_of_the_textbook() {
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 1.0)];
        let slope = Slope::of(points.map(|(x, y)| (f64::exp(x), f64::exp(y))).into_iter());
        let slope = slope.unwrap();
        assert!((slope.exponent - 0.4).abs() < 1e-12);
        let expected = 4.303 * f64::sqrt(0.02);
        assert!((slope.uncertainty.unwrap() / expected - 1.0).abs() < 1e-3);
    }
}
