//! The height of an aspheric surface over its vertex plane.

/// A conic and a polynomial, as a height over the square of the radius.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    pub c: f64,
    pub k: f64,
    /// Coefficients of r^0, r^1, …; or of r^0, r^2, … where all are even.
    pub terms: Vec<f64>,
    pub even: bool,
}

impl Profile {
    pub(crate) fn new(c: f64, k: f64, terms: &[f64]) -> Self {
        let used = terms
            .iter()
            .rposition(|t| *t != 0.0)
            .map_or(0, |last| last + 1);
        let terms = &terms[..used];
        let even = terms.iter().skip(1).step_by(2).all(|t| *t == 0.0);
        let terms = terms
            .iter()
            .step_by(if even { 2 } else { 1 })
            .copied()
            .collect();
        Self { c, k, terms, even }
    }

    /// Sag and slope over radius at a squared radius; none outside the conic.
    pub(crate) fn sag(&self, r2: f64) -> Option<(f64, f64)> {
        let inside = 1.0 - (1.0 + self.k) * self.c * self.c * r2;
        if !(inside > 0.0) {
            return None;
        }
        let root = inside.sqrt();
        let (mut sag, mut slope) = (self.c * r2 / (1.0 + root), self.c / root);
        if self.even {
            // Horner in r²: value and derivative together.
            let (mut p, mut dp) = (0.0, 0.0);
            for &a in self.terms.iter().rev() {
                dp = dp * r2 + p;
                p = p * r2 + a;
            }
            sag += p;
            slope += 2.0 * dp;
        } else {
            let r = r2.sqrt();
            let (mut p, mut dp) = (0.0, 0.0);
            for &a in self.terms.iter().rev() {
                dp = dp * r + p;
                p = p * r + a;
            }
            sag += p;
            if r > 0.0 {
                slope += dp / r;
            }
        }
        Some((sag, slope))
    }
}
