//! Numbers of about 32 digits: unevaluated sums of two `f64` (Dekker, "A floating-point technique
//! for extending the available precision", 1971).

use std::ops::{Add, Div, Mul, Neg, Sub};

/// The sum of a number and a much smaller one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Double {
    high: f64,
    low: f64,
}

impl Double {
    /// 1.
    pub const ONE: Self = Self {
        high: 1.0,
        low: 0.0,
    };

    /// The sum of two numbers, the first at least as large as the second.
    fn sorted(high: f64, low: f64) -> Self {
        let sum = high + low;
        if !sum.is_finite() {
            return Self::from(sum);
        }
        Self {
            high: sum,
            low: low - (sum - high),
        }
    }

    /// Returns the nearest `f64`.
    pub fn rounded(self) -> f64 {
        self.high
    }

    /// Returns the square root; not a number for a negative number.
    pub fn sqrt(self) -> Self {
        if self.high == 0.0 {
            return Self::default();
        }
        // One step of Newton's method doubles the digits.
        let root = Self::from(self.high.sqrt());
        let rest = self - root * root;
        root + Self::from(rest.high / (2.0 * root.high))
    }
}

impl From<f64> for Double {
    fn from(value: f64) -> Self {
        Self {
            high: value,
            low: 0.0,
        }
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let sum = self.high + other.high;
        let back = sum - self.high;
        let lost = (self.high - (sum - back)) + (other.high - back);
        Self::sorted(sum, lost + self.low + other.low)
    }
}

impl Neg for Double {
    type Output = Self;

    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let product = self.high * other.high;
        let lost = self.high.mul_add(other.high, -product);
        Self::sorted(
            product,
            lost + (self.high * other.low + self.low * other.high),
        )
    }
}

impl Div for Double {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        if !first.is_finite() {
            return Self::from(first);
        }
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        Self::sorted(first, second) + Self::from(rest.high / other.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_and_quotients_have_32_digits() {
        for value in [2.0, 1e-9, 3e17] {
            let root = Double::from(value).sqrt();
            let off = root * root - Double::from(value);
            assert!(off.rounded().abs() < 1e-30 * value, "{value}");
            let third = Double::from(value) / Double::from(3.0);
            let off = third * Double::from(3.0) - Double::from(value);
            assert!(off.rounded().abs() < 1e-30 * value, "{value}");
        }
    }

    #[test]
    fn small_parts_of_sums_are_kept() {
        let sum = Double::from(1.0) + Double::from(1e-25) - Double::from(1.0);
        assert_eq!(sum.rounded(), 1e-25);
        assert!(Double::from(-1.0).sqrt().rounded().is_nan());
    }
}
