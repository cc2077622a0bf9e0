//! The height of an aspheric surface over its vertex plane.

/// The height of an asphere as a function of the squared radius: a conic plus a polynomial.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    /// The curvature of the conic at the vertex, per millimeter.
    pub c: f64,
    /// The conic constant.
    pub k: f64,
    /// The coefficients of r^0, r^1, …; if `even`, those of r^0, r^2, …. Lengths are in
    /// millimeters.
    pub terms: Vec<f64>,
    /// Whether the coefficients of all odd powers are 0.
    pub even: bool,
    /// Whether the polynomial is measured along the normal of the conic. Its powers are then even.
    pub along_normal: bool,
}

impl Profile {
    /// The profile of a conic and the coefficients of r^0, r^1, ….
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
        Self {
            c,
            k,
            terms,
            even,
            along_normal: false,
        }
    }

    /// The value and the slope of a polynomial that is measured along the normal of the conic, when
    /// measured along the axis. `inside` is what [`Profile::sag`] takes the root of.
    #[inline(always)]
    pub(crate) fn along_axis(&self, [p, dp]: [f64; 2], r2: f64, inside: f64) -> [f64; 2] {
        let c2 = self.c * self.c;
        // 1/cos² of the angle of the normal, (1 − k c² r²)/inside, has the slope c²/inside².
        let over_cos = ((1.0 - self.k * c2 * r2) / inside).sqrt();
        [
            p * over_cos,
            dp * over_cos + 0.5 * p * c2 / (inside * inside * over_cos),
        ]
    }

    /// The sag, and its slope divided by the radius, at a squared radius; none outside the conic.
    pub(crate) fn sag(&self, r2: f64) -> Option<(f64, f64)> {
        let inside = 1.0 - (1.0 + self.k) * self.c * self.c * r2;
        if !(inside > 0.0) {
            return None;
        }
        let root = inside.sqrt();
        let (mut sag, mut slope) = (self.c * r2 / (1.0 + root), self.c / root);
        if self.even {
            // Horner's scheme in r², for the value and the derivative.
            let (mut p, mut dp) = (0.0, 0.0);
            for &a in self.terms.iter().rev() {
                dp = dp * r2 + p;
                p = p * r2 + a;
            }
            if self.along_normal {
                [p, dp] = self.along_axis([p, dp], r2, inside);
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
